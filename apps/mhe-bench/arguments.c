/* SPDX-License-Identifier: Apache-2.0 */
#include "arguments.h"

#include "console.h"

#include <stdlib.h>
#include <string.h>

#define REPEATS_MAX 1000

const char arguments_help[] =
    "Times every layer of the estimator and whole runs, variant against variant in alternation.\n"
    "\n"
    "  mhe-bench CONFIG.yaml [--set path.to.key=value]... [--vary path.to.key=v1,v2,v3]...\n"
    "            [--repeats N] [--quick] [--out DIR]\n"
    "  mhe-bench --version | --help\n"
    "\n"
    "Each --vary multiplies the variants; the last one varies fastest, and ratios are to the "
    "first\n"
    "variant. Without --vary the window varies: horizon.window=2,3,5,7,10,15,22. Layers are timed\n"
    "once for all windows. --repeats: how often each variant runs (5). --quick: two runs of at "
    "most\n"
    "25 estimates, and without --vary three windows. bench.json and the picture rate.svg go to "
    "DIR,\n"
    "./out/<config name> unless given. Exit status: 0 done; 1 a run failed; 2 the command line, "
    "the\n"
    "configuration or an input file is wrong.\n";

static const char *const words[] = {"--out",   "--set",     "--vary", "--repeats",
                                    "--quick", "--version", "--help"};

static mhe_status take_repeats(int argc, char **argv, int *i, arguments *a, mhe_error *err) {
    const char *value = NULL;
    mhe_status status = console_value(argc, argv, i, &value, err);
    if (status != MHE_OK) {
        return status;
    }
    char *end = NULL;
    const long repeats = strtol(value, &end, 10);
    if (*end != '\0' || repeats < 1 || repeats > REPEATS_MAX) {
        return mhe_fail(err, MHE_E_ARGUMENT, "--repeats is a whole number from 1 to %d, not '%s'",
                        REPEATS_MAX, value);
    }
    a->repeats = (int32_t)repeats;
    return MHE_OK;
}

static mhe_status take_word(int argc, char **argv, int *i, arguments *a, mhe_error *err) {
    const char *word = argv[*i];
    if (strcmp(word, "--out") == 0) {
        return console_value(argc, argv, i, &a->out, err);
    }
    if (strcmp(word, "--set") == 0) {
        return console_value(argc, argv, i, &a->set[a->n_set++], err);
    }
    if (strcmp(word, "--vary") == 0) {
        return console_value(argc, argv, i, &a->vary[a->n_vary++], err);
    }
    if (strcmp(word, "--repeats") == 0) {
        return take_repeats(argc, argv, i, a, err);
    }
    if (strcmp(word, "--quick") == 0) {
        a->quick = 1;
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
    a->vary = calloc((size_t)argc, sizeof *a->vary);
    if (a->set == NULL || a->vary == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int i = 1; i < argc; i++) {
        mhe_status status = take_word(argc, argv, &i, a, err);
        if (status != MHE_OK) {
            return status;
        }
    }
    if (a->mode == MODE_BENCH && a->config == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT,
                        "no config file is given; 'mhe-bench --help' shows the usage");
    }
    return MHE_OK;
}

void arguments_free(arguments *a) {
    free(a->set);
    free(a->vary);
}
