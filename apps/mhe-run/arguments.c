/* SPDX-License-Identifier: Apache-2.0 */
#include "arguments.h"

#include "console.h"

#include <mhe/library.h>
#include <stdlib.h>
#include <string.h>

const char arguments_help[] =
    "Estimates joint angles, activations and muscle forces from markers and EMG.\n"
    "\n"
    "  mhe-run CONFIG.yaml [--out DIR] [--set path.to.key=value]... [--quiet] [--realtime] "
    "[--trust]\n"
    "  mhe-run --check CONFIG.yaml [--set path.to.key=value]... [--trust]\n"
    "  mhe-run --list-plugins [--json]\n"
    "  mhe-run --describe ID [--json | --markdown]\n"
    "  mhe-run --version | --help\n"
    "\n"
    "--realtime feeds the recorded frames by the clock, as they would come live: a frame that "
    "comes\n"
    "while another is in work is skipped when a newer one is there. Unless the config says "
    "otherwise\n"
    "estimates are of the newest frame and each ends before the next one; rate, latency, jitter "
    "and\n"
    "missed frames are reported.\n"
    "--trust lets the config name folders of plugins (plugin_path), whose code then runs.\n"
    "--describe config shows every key of the config file. Results go to DIR, ./out/<config name>\n"
    "unless given. Exit status: 0 done; 1 the run failed (every solve did, too) or was "
    "interrupted; 2 the command line, "
    "the\n"
    "configuration or an input file is wrong.\n";

static const char *const words[] = {"--out",          "--set",  "--quiet",    "--check",
                                    "--list-plugins", "--json", "--markdown", "--describe",
                                    "--version",      "--help", "--realtime", "--trust"};

static mhe_status take_word(int argc, char **argv, int *i, arguments *a, mhe_error *err) {
    const char *word = argv[*i];
    if (strcmp(word, "--out") == 0) {
        return console_value(argc, argv, i, &a->out, err);
    }
    if (strcmp(word, "--set") == 0) {
        return console_value(argc, argv, i, &a->set[a->n_set++], err);
    }
    if (strcmp(word, "--check") == 0) {
        a->mode = MODE_CHECK;
        return console_value(argc, argv, i, &a->config, err);
    }
    if (strcmp(word, "--describe") == 0) {
        a->mode = MODE_DESCRIBE;
        return console_value(argc, argv, i, &a->id, err);
    }
    if (strcmp(word, "--quiet") == 0) {
        a->quiet = 1;
    } else if (strcmp(word, "--realtime") == 0) {
        a->realtime = 1;
    } else if (strcmp(word, "--trust") == 0) {
        a->trust = 1;
    } else if (strcmp(word, "--list-plugins") == 0) {
        a->mode = MODE_LIST;
    } else if (strcmp(word, "--json") == 0) {
        a->format = MHE_FORMAT_JSON;
    } else if (strcmp(word, "--markdown") == 0) {
        a->format = MHE_FORMAT_MARKDOWN;
    } else if (strcmp(word, "--version") == 0) {
        a->mode = MODE_VERSION;
    } else if (strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0) {
        a->mode = MODE_HELP;
    } else {
        return console_config(word, words, sizeof words / sizeof words[0], &a->config, err);
    }
    return MHE_OK;
}

mhe_status arguments_parse(int argc, char **argv, arguments *a, mhe_error *err) {
    *a = (arguments){0};
    a->set = calloc((size_t)argc, sizeof *a->set);
    if (a->set == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int i = 1; i < argc; i++) {
        mhe_status status = take_word(argc, argv, &i, a, err);
        if (status != MHE_OK) {
            return status;
        }
    }
    if ((a->mode == MODE_RUN || a->mode == MODE_CHECK) && a->config == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT,
                        "no config file is given; 'mhe-run --help' shows the usage");
    }
    return MHE_OK;
}
