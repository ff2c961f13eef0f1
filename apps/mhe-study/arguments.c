/* SPDX-License-Identifier: Apache-2.0 */
#include "arguments.h"

#include "workers.h"

#define FOLDERS_MAX 1000

static const words_command commands[] = {
    {"run", "STUDY.yaml", "study file",
     "every trial of the study that DIR has no result of; a run that was ended in any way goes on "
     "where it was. At the end results.csv (one line a trial, the same to the byte on any number "
     "of workers) and timing.csv. 'mhe-study run --help' shows every key of a study file",
     1, NULL},
    {"report", "DIR", "results folder",
     "statistics, figures and a page in DIR/report, as the study's section 'report' asks; it needs "
     "Debian's python3-pandas, python3-statsmodels and python3-matplotlib",
     1, NULL},
    {"submit", "STUDY.yaml", "study file",
     "the same study as a Slurm job array of N tasks, each with so many workers (1)", 1, NULL},
    {"merge", "DIR", "results folder",
     "the tables of what DIR has, with the rows of other folders of the same study", FOLDERS_MAX,
     NULL}};

#define AT(field) offsetof(arguments, field)
#define RUN (1u << COMMAND_RUN)
#define SUBMIT (1u << COMMAND_SUBMIT)

static const words_option options[] = {
    WORDS_OUT("folder of the results; ./out/<study's name> unless given", RUN | SUBMIT, AT(out)),
    WORDS_SET("study", RUN | SUBMIT, AT(set)),
    {.name = "--workers",
     .value = "N",
     .help = "processes; as many as there are processors",
     .commands = RUN | SUBMIT,
     .kind = WORDS_INT,
     .at = AT(n_workers),
     .low = 1,
     .high = WORKERS_MAX},
    {.name = "--shard",
     .value = "I/N",
     .help = "0/8 ... 7/8 does one of eight parts, in a process or on a machine of its own",
     .commands = RUN,
     .kind = WORDS_OTHER,
     .at = AT(shard),
     .take = cluster_take_part},
    {.name = "--check",
     .help = "reads the study and all it names, and runs nothing",
     .commands = RUN,
     .kind = WORDS_FLAG,
     .at = AT(check),
     .low = 1},
    {.name = "--engine",
     .value = "slurm",
     .help = "what the tasks are given to",
     .commands = SUBMIT,
     .kind = WORDS_TEXT,
     .at = AT(engine)},
    {.name = "--tasks",
     .value = "N",
     .help = "parts of the array (16)",
     .commands = SUBMIT,
     .kind = WORDS_INT,
     .at = AT(n_tasks),
     .low = 1,
     .high = CLUSTER_TASKS_MAX},
    {.name = "--option",
     .value = "WORD",
     .help = "goes to sbatch as it is: --option --partition=fast; may be given often",
     .commands = SUBMIT,
     .kind = WORDS_LIST,
     .at = AT(option)},
    {.name = "--trust",
     .help = "the study may name a program that makes its trials, which then runs",
     .commands = RUN | SUBMIT,
     .kind = WORDS_FLAG,
     .at = AT(trust),
     .low = 1},
    WORDS_QUIET("progress bar", AT(quiet))};

const words_program arguments_program = {
    .name = "mhe-study",
    .summary = "Runs an estimator on simulated recordings under many conditions, many times.",
    .usage = "  mhe-study run STUDY.yaml [--out DIR] [--workers N] [--set path.to.key=value]... "
             "[--quiet] [--trust]\n"
             "  mhe-study run --check STUDY.yaml [--set path.to.key=value]...\n"
             "  mhe-study report DIR [--quiet]\n"
             "  mhe-study submit STUDY.yaml --engine slurm [--out DIR] [--tasks N] [--workers N]\n"
             "      [--option WORD]... [--set path.to.key=value]...\n"
             "  mhe-study merge DIR [DIR]...\n"
             "  mhe-study --version | --help\n",
    .notes = "Exit status: 0 done; 1 failed, interrupted or incomplete; 2 the command line or an "
             "input is\nwrong.\n",
    .commands = commands,
    .n_commands = sizeof commands / sizeof commands[0],
    .options = options,
    .n_options = sizeof options / sizeof options[0],
    .mode = AT(mode),
    .operand = AT(file),
    .others = AT(others)};
