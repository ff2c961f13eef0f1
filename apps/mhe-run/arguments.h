/* SPDX-License-Identifier: Apache-2.0 */
/* arguments.h: the command line of mhe-run. */
#ifndef ARGUMENTS_H
#define ARGUMENTS_H

#include "words.h"

#define MODE_RUN 0
#define MODE_CHECK 1
#define MODE_LIST 2
#define MODE_DESCRIBE 3

typedef struct arguments {
    int32_t mode;
    int32_t quiet;
    int32_t realtime;
    int32_t trust;      /* a config may name folders of plugins */
    int32_t format;     /* MHE_FORMAT_* */
    const char *config; /* run, check */
    const char *id;     /* describe */
    const char *out;    /* NULL: ./out/<config name> */
    words_list set, others;
} arguments;

extern const words_program arguments_program;

#endif
