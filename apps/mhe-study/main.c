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
    words_help(&arguments_program);
    return MHE_OK;
}

static const struct command {
    mhe_status (*run)(const arguments *a, const mhe_host *host, mhe_error *err);
    mhe_status (*help)(mhe_error *err);
} commands[] = {[COMMAND_RUN] = {run_study, help_run},
                [COMMAND_REPORT] = {report_make, help_all},
                [COMMAND_SUBMIT] = {submit_study, help_all},
                [COMMAND_MERGE] = {run_merge, help_all}};

int main(int argc, char **argv) {
    const mhe_host host = console_host("mhe-study");
    arguments a = {.shard = {0, 1}, .n_tasks = 16};
    mhe_error err = {0};
    int32_t command = 0, outcome = WORDS_RUN;
    /* Workers are processes: threads of a library below would only stand in each other's way. */
    (void)setenv("OMP_NUM_THREADS", "1", 0);
    (void)setenv("OPENBLAS_NUM_THREADS", "1", 0);
    mhe_status status = words_parse(&arguments_program, argc, argv, &a, &command, &outcome, &err);
    if (status == MHE_OK && outcome != WORDS_ANSWERED) {
        status = outcome == WORDS_HELP ? commands[command].help(&err)
                                       : commands[command].run(&a, &host, &err);
    }
    words_free(&arguments_program, &a);
    return console_end("mhe-study", status, &err);
}
