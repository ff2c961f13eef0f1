/* SPDX-License-Identifier: Apache-2.0 */
/* arguments.h: the command line behind a command's name. */
#ifndef ARGUMENTS_H
#define ARGUMENTS_H

#include <mhe/abi.h>

/* What a command takes. */
#define ARGUMENTS_RUN 1    /* a study file, --workers, --shard */
#define ARGUMENTS_SUBMIT 2 /* a study file, --engine, --tasks, --option */
#define ARGUMENTS_FOLDER 4 /* a results folder, and for `merge` more of them */

typedef struct arguments {
    const char *file;    /* study file or results folder */
    const char **others; /* [n_others]: more folders */
    int32_t n_others;
    const char *out; /* NULL: ./out/<study's name> */
    const char **set;
    int32_t n_set;
    int32_t n_workers;       /* 0: as many as there are processors */
    int32_t shard, n_shards; /* --shard 2/8: the third of eight parts; 0/1 */
    const char *engine;
    int32_t n_tasks;
    const char **option; /* of the engine, lent as they stand */
    int32_t n_option;
    int32_t quiet, check, help;
} arguments;

/* argv[2] and on. Give it back with arguments_free, also after a failure. */
mhe_status arguments_parse(int argc, char **argv, int32_t takes, arguments *a, mhe_error *err);
void arguments_free(arguments *a);

#endif
