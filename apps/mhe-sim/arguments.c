/* SPDX-License-Identifier: Apache-2.0 */
#include "arguments.h"

#include <stdlib.h>

#define INPUT_NEEDED "a config file and --input are needed; 'mhe-sim --help'"

static const words_command commands[] = {
    {"forward", "CONFIG.yaml", "config file",
     "from the config's initial state under the excitations of the file (one column a muscle, "
     "linear between rows); writes reference.sto (the truth), markers.trc and emg.sto",
     1, INPUT_NEEDED},
    {"follow", "CONFIG.yaml", "config file",
     "through the postures of the file (one column a coordinate, a minimum-jerk path from row to "
     "row) with muscle controls that the config's costs and solver find on the way; writes the "
     "same files",
     1, INPUT_NEEDED},
    {"reference", "CONFIG.yaml", "config file",
     "optimal motions, the config's steps one after the other; for every step with an output "
     "reference.sto, forces.sto, markers.trc and emg.sto in a folder of its own, and motion.svg "
     "that shows them all; 'mhe-sim reference --help' shows every key of a step",
     1, "a config file is needed; 'mhe-sim --help'"},
    {"noise", "CONFIG.yaml", "config file",
     "markers.trc and emg.sto as instruments with errors would have recorded them of such a "
     "reference.sto; where the config has electrodes also recording.c3d, markers and raw EMG; "
     "noise.yaml says what was applied, noise.svg shows it; 'mhe-sim noise --help' shows every "
     "key of its config",
     1, "a config file is needed; 'mhe-sim --help'"}};

#define AT(field) offsetof(arguments, field)
#define MOTIONS (1u << COMMAND_FORWARD | 1u << COMMAND_FOLLOW)

static mhe_status take_rate(const char *word, const char *value, void *target, mhe_error *err) {
    char *end = NULL;
    const double rate = strtod(value, &end);
    if (end == value || *end != '\0' || !(rate > 0 && rate <= 1e5)) {
        return mhe_fail(err, MHE_E_ARGUMENT, "%s '%s': a number of Hz above 0 is needed", word,
                        value);
    }
    *(double *)target = rate;
    return MHE_OK;
}

static const words_option options[] = {
    WORDS_OUT("default ./out/<config name>; of a motion ./out/<config name>-sim", 0, AT(out)),
    WORDS_SET("config", 0, AT(set)),
    {.name = "--input",
     .value = "FILE.sto",
     .help = "excitations to act with, or postures to go through",
     .commands = MOTIONS,
     .kind = WORDS_TEXT,
     .at = AT(input)},
    {.name = "--rate",
     .value = "HZ",
     .help = "rows a second (100)",
     .commands = MOTIONS,
     .kind = WORDS_OTHER,
     .at = AT(rate),
     .take = take_rate},
    {.name = "--no-cache",
     .help = "solves all steps and keeps none; else a step that was solved before, from the same "
             "config, "
             "model, files and program, is read back from $XDG_CACHE_HOME/mhe (~/.cache/mhe), "
             "which may be "
             "deleted at any time",
     .commands = 1u << COMMAND_REFERENCE,
     .kind = WORDS_FLAG,
     .at = AT(no_cache),
     .low = 1}};

const words_program arguments_program = {
    .name = "mhe-sim",
    .summary =
        "Simulates motions of a musculoskeletal model (CVODES carries the state), and recordings.",
    .usage = "  mhe-sim forward CONFIG.yaml --input EXCITATIONS.sto [--rate HZ] [options]\n"
             "  mhe-sim follow CONFIG.yaml --input POSTURES.sto [--rate HZ] [options]\n"
             "  mhe-sim reference CONFIG.yaml [options]\n"
             "  mhe-sim noise CONFIG.yaml [options]\n"
             "  mhe-sim --version | --help\n",
    .notes = "Exit status: 0 done; 1 failed; 2 the command line or an input is wrong.\n",
    .commands = commands,
    .n_commands = sizeof commands / sizeof commands[0],
    .options = options,
    .n_options = sizeof options / sizeof options[0],
    .mode = AT(mode),
    .operand = AT(config),
    .others = AT(others)};

mhe_status arguments_folder(const arguments *a, const char *name, const char *suffix, char *out,
                            size_t size, mhe_error *err) {
    const int n = a->out != NULL ? snprintf(out, size, "%s", a->out)
                                 : snprintf(out, size, "out/%s%s", name, suffix);
    return n >= 0 && (size_t)n < size
               ? MHE_OK
               : mhe_fail(err, MHE_E_ARGUMENT, "the path of the output folder is too long");
}
