/* SPDX-License-Identifier: Apache-2.0 */
#include "arguments.h"

#include "base/text.h"
#include "console.h"
#include "workers.h"

#include <stdlib.h>
#include <string.h>

static mhe_status whole_number(const char *word, const char *value, long low, long high,
                               int32_t *out, mhe_error *err) {
    char *end = NULL;
    const long n = strtol(value, &end, 10);
    if (end == value || *end != '\0' || n < low || n > high) {
        return mhe_fail(err, MHE_E_ARGUMENT, "%s: '%s' is no whole number from %ld to %ld", word,
                        value, low, high);
    }
    *out = (int32_t)n;
    return MHE_OK;
}

/* "2/8" */
static mhe_status shard_of(const char *value, arguments *a, mhe_error *err) {
    char *end = NULL;
    const long shard = strtol(value, &end, 10);
    const long n = end != value && *end == '/' ? strtol(end + 1, &end, 10) : 0;
    if (*end != '\0' || shard < 0 || n < 1 || n > 100000 || shard >= n) {
        return mhe_fail(err, MHE_E_ARGUMENT,
                        "--shard: '%s' is not like 0/8 ... 7/8, the first to the last of eight",
                        value);
    }
    a->shard = (int32_t)shard;
    a->n_shards = (int32_t)n;
    return MHE_OK;
}

enum { OUT, SET, WORKERS, SHARD, ENGINE, TASKS, OPTION, QUIET, CHECK, HELP };

static const struct word {
    const char *name;
    int32_t what, takes, has_value;
} words[] = {
    {"--out", OUT, ARGUMENTS_RUN | ARGUMENTS_SUBMIT, 1},
    {"--set", SET, ARGUMENTS_RUN | ARGUMENTS_SUBMIT, 1},
    {"--workers", WORKERS, ARGUMENTS_RUN | ARGUMENTS_SUBMIT, 1},
    {"--shard", SHARD, ARGUMENTS_RUN, 1},
    {"--check", CHECK, ARGUMENTS_RUN, 0},
    {"--engine", ENGINE, ARGUMENTS_SUBMIT, 1},
    {"--tasks", TASKS, ARGUMENTS_SUBMIT, 1},
    {"--option", OPTION, ARGUMENTS_SUBMIT, 1},
    {"--quiet", QUIET, ARGUMENTS_RUN | ARGUMENTS_SUBMIT | ARGUMENTS_FOLDER, 0},
    {"--help", HELP, ARGUMENTS_RUN | ARGUMENTS_SUBMIT | ARGUMENTS_FOLDER, 0},
    {"-h", HELP, ARGUMENTS_RUN | ARGUMENTS_SUBMIT | ARGUMENTS_FOLDER, 0},
};
#define N_WORDS (sizeof words / sizeof words[0])

static mhe_status take(const struct word *word, const char *value, arguments *a, mhe_error *err) {
    switch (word->what) {
    case OUT:
        a->out = value;
        break;
    case SET:
        a->set[a->n_set++] = value;
        break;
    case WORKERS:
        return whole_number("--workers", value, 1, WORKERS_MAX, &a->n_workers, err);
    case SHARD:
        return shard_of(value, a, err);
    case ENGINE:
        a->engine = value;
        break;
    case TASKS:
        return whole_number("--tasks", value, 1, 100000, &a->n_tasks, err);
    case OPTION:
        a->option[a->n_option++] = value;
        break;
    case QUIET:
        a->quiet = 1;
        break;
    case CHECK:
        a->check = 1;
        break;
    default:
        a->help = 1;
        break;
    }
    return MHE_OK;
}

static mhe_status unknown(const char *given, int32_t takes, mhe_error *err) {
    const char *names[N_WORDS];
    char hint[256];
    int32_t n = 0;
    for (size_t i = 0; i < N_WORDS; i++) {
        if (words[i].takes & takes) {
            names[n++] = words[i].name;
        }
    }
    return mhe_fail(err, MHE_E_ARGUMENT, "unknown option '%s'%s", given,
                    mhi_suggest(hint, sizeof hint, given, names, n));
}

static mhe_status take_word(int argc, char **argv, int *i, int32_t takes, arguments *a,
                            mhe_error *err) {
    const char *given = argv[*i], *value = NULL;
    for (size_t k = 0; k < N_WORDS; k++) {
        if ((words[k].takes & takes) != 0 && strcmp(given, words[k].name) == 0) {
            mhe_status status =
                words[k].has_value ? console_value(argc, argv, i, &value, err) : MHE_OK;
            return status == MHE_OK ? take(&words[k], value, a, err) : status;
        }
    }
    if (given[0] == '-' && given[1] != '\0') {
        return unknown(given, takes, err);
    }
    if (a->file == NULL) {
        a->file = given;
    } else if (takes & ARGUMENTS_FOLDER) {
        a->others[a->n_others++] = given;
    } else {
        return mhe_fail(err, MHE_E_ARGUMENT, "one study at a time: '%s' and '%s'", a->file, given);
    }
    return MHE_OK;
}

mhe_status arguments_parse(int argc, char **argv, int32_t takes, arguments *a, mhe_error *err) {
    *a = (arguments){.n_shards = 1, .n_tasks = 16};
    a->set = calloc((size_t)argc, sizeof *a->set);
    a->option = calloc((size_t)argc, sizeof *a->option);
    a->others = calloc((size_t)argc, sizeof *a->others);
    if (a->set == NULL || a->option == NULL || a->others == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int i = 2; i < argc; i++) {
        mhe_status status = take_word(argc, argv, &i, takes, a, err);
        if (status != MHE_OK) {
            return status;
        }
    }
    if (a->file == NULL && !a->help) {
        return mhe_fail(err, MHE_E_ARGUMENT, "no %s is given; 'mhe-study --help' shows the usage",
                        takes & ARGUMENTS_FOLDER ? "results folder" : "study file");
    }
    return MHE_OK;
}

void arguments_free(arguments *a) {
    free(a->set);
    free(a->option);
    free(a->others);
}
