/* SPDX-License-Identifier: Apache-2.0 */
/* arguments.h: the command line of mhe-sim behind the command. */
#ifndef MHE_SIM_ARGUMENTS_H
#define MHE_SIM_ARGUMENTS_H

#include <mhe/abi.h>

typedef struct arguments {
    const char *config;
    const char *input; /* --input */
    double rate;       /* --rate, Hz */
    const char *out;   /* --out; NULL: ./out/<config name><suffix> */
    const char **set;  /* --set [n_set], points into argv */
    int32_t n_set;
    int32_t no_cache; /* --no-cache */
    int32_t help;     /* --help: nothing else was looked at */
} arguments;

/* What a command takes beyond --out and --set. */
#define ARGUMENTS_INPUT 1 /* needs --input, takes --rate */
#define ARGUMENTS_CACHE 2 /* --no-cache */

/* Reads the words from argv[2] on; `takes`: ARGUMENTS_* or 0. Give
 * it back with arguments_free, also after a failure. MHE_E_ARGUMENT. */
mhe_status arguments_parse(int argc, char **argv, int32_t takes, arguments *result, mhe_error *err);
void arguments_free(arguments *a);

/* The output folder, into out [size]: --out, or "out/<name><suffix>". */
mhe_status arguments_folder(const arguments *a, const char *name, const char *suffix, char *out,
                            size_t size, mhe_error *err);

#endif
