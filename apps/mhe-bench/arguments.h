/* SPDX-License-Identifier: Apache-2.0 */
/* arguments.h: the command line of mhe-bench. */
#ifndef ARGUMENTS_H
#define ARGUMENTS_H

#include "words.h"

typedef struct arguments {
    int32_t mode; /* 1: --scale */
    int32_t scale;
    int32_t quick;
    int32_t no_layers;
    int32_t frames;  /* frames.csv is wanted */
    int32_t repeats; /* 0: not given */
    const char *config;
    const char *out; /* NULL: ./out/<config name> */
    words_list set, vary, others;
} arguments;

extern const words_program arguments_program;

#endif
