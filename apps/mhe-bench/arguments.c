/* SPDX-License-Identifier: Apache-2.0 */
#include "arguments.h"

#define REPEATS_MAX 1000

static const words_command commands[] = {
    {.name = "", .operand = "CONFIG.yaml", .what = "config file", .most = 1}};

#define AT(field) offsetof(arguments, field)

static const words_option options[] = {
    WORDS_OUT("folder of bench.json and the picture rate.svg; ./out/<config name> unless given", 0,
              AT(out)),
    WORDS_SET("config", 0, AT(set)),
    {.name = "--vary",
     .value = "path.to.key=v1,v2",
     .help = "multiplies the variants; the last one varies fastest, and ratios are to the first "
             "variant. "
             "Without it the window varies: horizon.window=2,3,5,7,10,15,22",
     .kind = WORDS_LIST,
     .at = AT(vary)},
    {.name = "--repeats",
     .value = "N",
     .help = "how often each variant runs (5). A frame does the same work each time: with two or "
             "more, percentiles of the feedback are told for each frame by its median over the "
             "runs, too, which leaves out what the machine adds",
     .kind = WORDS_INT,
     .at = AT(repeats),
     .low = 1,
     .high = REPEATS_MAX},
    {.name = "--no-layers",
     .help = "whole runs alone",
     .kind = WORDS_FLAG,
     .at = AT(no_layers),
     .low = 1},
    {.name = "--frames",
     .help = "writes frames.csv, too: preparation and feedback of every estimate in every run (but "
             "the first, which starts from nothing)",
     .kind = WORDS_FLAG,
     .at = AT(frames),
     .low = 1},
    {.name = "--scale",
     .help = "no CONFIG: how a frame's time grows with coordinates (7 to 37) and muscles (20 to "
             "150), on models that are made up in DIR, ./out/scale unless given",
     .kind = WORDS_FLAG,
     .at = AT(scale),
     .low = 1,
     .mode = 1},
    {.name = "--quick",
     .help = "two runs of at most 25 estimates, and without --vary three windows; with --scale "
             "the three smallest models",
     .kind = WORDS_FLAG,
     .at = AT(quick),
     .low = 1}};

const words_program arguments_program = {
    .name = "mhe-bench",
    .summary = "Times every layer of the estimator and whole runs, variant against variant in "
               "alternation.",
    .usage =
        "  mhe-bench CONFIG.yaml [--set path.to.key=value]... [--vary path.to.key=v1,v2,v3]...\n"
        "            [--repeats N] [--no-layers] [--frames] [--quick] [--out DIR]\n"
        "  mhe-bench --scale [--set path.to.key=value]... [--repeats N] [--quick] [--out DIR]\n"
        "  mhe-bench --version | --help\n",
    .notes = "Layers are timed once for all windows. Exit status: 0 done; 1 a run failed; 2 the\n"
             "command line, the configuration or an input file is wrong.\n",
    .commands = commands,
    .n_commands = 1,
    .options = options,
    .n_options = sizeof options / sizeof options[0],
    .mode = AT(mode),
    .operand = AT(config),
    .others = AT(others),
    .modes_without = 1u << 1};
