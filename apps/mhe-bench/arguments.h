/* SPDX-License-Identifier: Apache-2.0 */
/* arguments.h: the command line of mhe-bench. */
#ifndef ARGUMENTS_H
#define ARGUMENTS_H

#include <mhe/abi.h>

#define MODE_BENCH 0
#define MODE_HELP 1
#define MODE_VERSION 2

typedef struct arguments {
    int mode;
    int quick;
    int32_t repeats; /* 0: not given */
    const char *config;
    const char *out;          /* NULL: ./out/<config name> */
    const char **set, **vary; /* [n_set], [n_vary], point into argv */
    int32_t n_set, n_vary;
} arguments;

/* MHE_E_ARGUMENT: `err` says which word is wrong and what is valid. */
mhe_status arguments_parse(int argc, char **argv, arguments *result, mhe_error *err);
void arguments_free(arguments *a);

extern const char arguments_help[];

#endif
