/* SPDX-License-Identifier: Apache-2.0 */
/* arguments.h: the command line of mhe-run. */
#ifndef ARGUMENTS_H
#define ARGUMENTS_H

#include <mhe/abi.h>

#define MODE_RUN 0
#define MODE_CHECK 1
#define MODE_LIST 2
#define MODE_DESCRIBE 3
#define MODE_HELP 4
#define MODE_VERSION 5

typedef struct arguments {
    int mode;
    int quiet;
    int realtime;
    int trust;          /* a config may name folders of plugins */
    int32_t format;     /* MHE_FORMAT_* */
    const char *config; /* run, check */
    const char *id;     /* describe */
    const char *out;    /* NULL: ./out/<config name> */
    const char **set;   /* [n_set], points into argv; freed with free() */
    int32_t n_set;
} arguments;

/* MHE_E_ARGUMENT: `err` says which word is wrong and what is valid. */
mhe_status arguments_parse(int argc, char **argv, arguments *result, mhe_error *err);

extern const char arguments_help[];

#endif
