/* SPDX-License-Identifier: Apache-2.0 */
#include "arguments.h"

#include "batch.h"

#include <mhe/library.h>

static const words_command commands[] = {
    {.name = "", .operand = "CONFIG.yaml", .what = "config file", .most = 1}};

#define AT(field) offsetof(arguments, field)

static const words_option options[] = {
    WORDS_OUT("folder of the results; ./out/<config name> unless given", 0, AT(out)),
    WORDS_SET("config", 0, AT(set)),
    WORDS_QUIET("progress bar", AT(quiet)),
    {.name = "--realtime",
     .help = "feeds the recorded frames by the clock, as they would come live: a frame that comes "
             "while "
             "another is in work is skipped when a newer one is there. Unless the config says "
             "otherwise "
             "estimates are of the newest frame and each ends before the next one; rate, latency, "
             "jitter "
             "and missed frames are reported",
     .kind = WORDS_FLAG,
     .at = AT(realtime),
     .low = 1},
    WORDS_TRUST(AT(trust)),
    {.name = "--check",
     .value = "CONFIG.yaml",
     .help = "reads config, model and data, and estimates nothing",
     .kind = WORDS_TEXT,
     .at = AT(config),
     .mode = MODE_CHECK},
    {.name = "--batch",
     .value = "LIST",
     .help =
         "the trials of a session over the processors, each in a folder of its own below --out: "
         "LIST is a table (.csv) with a line a trial and columns 'name' and keys of the config, "
         "or a folder of recordings, or of configs. Started again it goes on where it was; "
         "batch.csv and batch.html show all trials",
     .kind = WORDS_TEXT,
     .at = AT(batch),
     .mode = MODE_BATCH},
    {.name = "--workers",
     .value = "N",
     .help = "processes of --batch; as many as there are processors",
     .kind = WORDS_INT,
     .at = AT(n_workers),
     .low = 1,
     .high = BATCH_WORKERS_MAX},
    {.name = "--shard",
     .value = "I/N",
     .help = "0/8 ... 7/8 does one of eight parts of --batch, in a process or on a machine of its "
             "own",
     .kind = WORDS_OTHER,
     .at = AT(shard),
     .take = cluster_take_part},
    {.name = "--engine",
     .value = "slurm",
     .help = "hands --batch to a cluster, as a job array of --tasks",
     .kind = WORDS_TEXT,
     .at = AT(engine)},
    {.name = "--tasks",
     .value = "N",
     .help = "parts of the array (16)",
     .kind = WORDS_INT,
     .at = AT(n_tasks),
     .low = 1,
     .high = CLUSTER_TASKS_MAX},
    {.name = "--option",
     .value = "WORD",
     .help = "goes to sbatch as it is: --option --partition=fast; may be given often",
     .kind = WORDS_LIST,
     .at = AT(option)},
    {.name = "--list-plugins",
     .help = "the plugins that are found, and the files that were refused",
     .kind = WORDS_FLAG,
     .at = AT(mode),
     .mode = MODE_LIST},
    {.name = "--describe",
     .value = "ID",
     .help = "a plugin and its options; 'config': every key of the config file",
     .kind = WORDS_TEXT,
     .at = AT(id),
     .mode = MODE_DESCRIBE},
    {.name = "--json",
     .help = "--list-plugins and --describe as JSON",
     .kind = WORDS_FLAG,
     .at = AT(format),
     .low = MHE_FORMAT_JSON},
    {.name = "--markdown",
     .help = "--describe as markdown",
     .kind = WORDS_FLAG,
     .at = AT(format),
     .low = MHE_FORMAT_MARKDOWN}};

const words_program arguments_program = {
    .name = "mhe-run",
    .summary = "Estimates joint angles, activations and muscle forces from markers and EMG.",
    .usage =
        "  mhe-run CONFIG.yaml [--out DIR] [--set path.to.key=value]... [--quiet] [--realtime] "
        "[--trust]\n"
        "  mhe-run --check CONFIG.yaml [--set path.to.key=value]... [--trust]\n"
        "  mhe-run [CONFIG.yaml] --batch LIST|FOLDER [--out DIR] [--set path.to.key=value]... "
        "[--workers N]\n"
        "      [--shard I/N | --engine slurm [--tasks N] [--option WORD]...]\n"
        "  mhe-run --list-plugins [--json]\n"
        "  mhe-run --describe ID [--json | --markdown]\n"
        "  mhe-run --version | --help\n",
    .notes = "Exit status: 0 done; 1 the run failed (every solve did, too) or was interrupted; 2 "
             "the\ncommand line, the configuration or an input file is wrong.\n",
    .commands = commands,
    .n_commands = 1,
    .options = options,
    .n_options = sizeof options / sizeof options[0],
    .mode = AT(mode),
    .operand = AT(config),
    .others = AT(others),
    .modes_without = 1u << MODE_LIST | 1u << MODE_DESCRIBE | 1u << MODE_BATCH};
