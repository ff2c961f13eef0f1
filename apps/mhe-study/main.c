/* SPDX-License-Identifier: Apache-2.0 */
/* mhe-study: many estimates under many conditions, and what they come to. */
#include "arguments.h"
#include "console.h"
#include "report.h"
#include "run.h"
#include "study.h"
#include "submit.h"

#include <stdio.h>
#include <stdlib.h>

static const char help[] =
    "Runs an estimator on simulated recordings under many conditions, many times.\n"
    "\n"
    "  mhe-study run STUDY.yaml [--out DIR] [--workers N] [--set path.to.key=value]... [--quiet]\n"
    "  mhe-study run --check STUDY.yaml [--set path.to.key=value]...\n"
    "  mhe-study report DIR [--quiet]\n"
    "  mhe-study submit STUDY.yaml --engine slurm [--out DIR] [--tasks N] [--workers N]\n"
    "      [--option WORD]... [--set path.to.key=value]...\n"
    "  mhe-study merge DIR [DIR]...\n"
    "  mhe-study --version | --help\n"
    "\n"
    "run: every trial of the study that DIR (default ./out/<study's name>) has no result of; a "
    "run\n"
    "that was ended in any way goes on where it was. At the end results.csv (one line a trial, "
    "the\n"
    "same to the byte on any number of workers), timing.csv. --shard 0/8 ... 7/8 does one of "
    "eight\n"
    "parts, in a process or on a machine of its own.\n"
    "report: statistics, figures and a page in DIR/report, as the study's section 'report' asks;\n"
    "it needs Debian's python3-pandas, python3-statsmodels and python3-matplotlib.\n"
    "submit: the same study as a Slurm job array of N tasks (16), each with so many workers (1);\n"
    "WORDs go to sbatch as they are: --option --partition=fast.\n"
    "merge: the tables of what DIR has, with the rows of other folders of the same study.\n"
    "'mhe-study run --help' shows every key of a study file.\n"
    "Exit status: 0 done; 1 failed, interrupted or incomplete; 2 the command line or an input is\n"
    "wrong.\n";

static mhe_status help_run(mhe_error *err) {
    mhi_text text = {0};
    study_describe(&text);
    (void)fputs("mhe-study run STUDY.yaml [--out DIR] [--workers N] [--shard I/N] [--check]\n"
                "    [--set path.to.key=value]... [--quiet]\n\nKeys of the study:\n\n",
                stdout);
    return console_print(&text, err);
}

static mhe_status help_all(mhe_error *err) {
    (void)err;
    (void)fputs(help, stdout);
    return MHE_OK;
}

static const struct command {
    const char *name;
    int32_t takes; /* ARGUMENTS_* */
    mhe_status (*run)(const arguments *a, const mhe_host *host, mhe_error *err);
    mhe_status (*help)(mhe_error *err);
} commands[] = {{"run", ARGUMENTS_RUN, run_study, help_run},
                {"report", ARGUMENTS_FOLDER, report_make, help_all},
                {"submit", ARGUMENTS_SUBMIT, submit_study, help_all},
                {"merge", ARGUMENTS_FOLDER, run_merge, help_all}};
#define N_COMMANDS ((int32_t)(sizeof commands / sizeof commands[0]))

static mhe_status run_command(const struct command *command, int argc, char **argv,
                              mhe_error *err) {
    const mhe_host host = console_host("mhe-study");
    arguments a;
    mhe_status status = arguments_parse(argc, argv, command->takes, &a, err);
    if (status == MHE_OK) {
        status = a.help ? command->help(err) : command->run(&a, &host, err);
    }
    arguments_free(&a);
    return status;
}

int main(int argc, char **argv) {
    mhe_error err = {0};
    const char *names[N_COMMANDS];
    int32_t chosen;
    /* Workers are processes: threads of a library below would only stand in each other's way. */
    (void)setenv("OMP_NUM_THREADS", "1", 0);
    (void)setenv("OPENBLAS_NUM_THREADS", "1", 0);
    for (int32_t i = 0; i < N_COMMANDS; i++) {
        names[i] = commands[i].name;
    }
    mhe_status status = console_command("mhe-study", help, names, N_COMMANDS,
                                        argc >= 2 ? argv[1] : NULL, &chosen, &err);
    if (chosen >= 0) {
        status = run_command(&commands[chosen], argc, argv, &err);
    }
    return console_end("mhe-study", status, &err);
}
