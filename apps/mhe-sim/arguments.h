/* SPDX-License-Identifier: Apache-2.0 */
/* arguments.h: the command line of mhe-sim. */
#ifndef MHE_SIM_ARGUMENTS_H
#define MHE_SIM_ARGUMENTS_H

#include "words.h"

/* Commands, in the order of the table. */
enum { COMMAND_FORWARD, COMMAND_FOLLOW, COMMAND_REFERENCE, COMMAND_NOISE };

typedef struct arguments {
    int32_t mode; /* 0 */
    const char *config;
    const char *input; /* --input */
    double rate;       /* --rate, Hz */
    const char *out;   /* --out; NULL: ./out/<config name><suffix> */
    words_list set, others;
    int32_t no_cache; /* --no-cache */
} arguments;

extern const words_program arguments_program;

/* The output folder, into out [size]: --out, or "out/<name><suffix>". */
mhe_status arguments_folder(const arguments *a, const char *name, const char *suffix, char *out,
                            size_t size, mhe_error *err);

#endif
