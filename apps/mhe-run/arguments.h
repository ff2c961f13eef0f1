/* SPDX-License-Identifier: Apache-2.0 */
/* arguments.h: the command line of mhe-run. */
#ifndef ARGUMENTS_H
#define ARGUMENTS_H

#include "cluster.h"
#include "words.h"

#define MODE_RUN 0
#define MODE_CHECK 1
#define MODE_LIST 2
#define MODE_DESCRIBE 3
#define MODE_BATCH 4

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
    /* --batch */
    const char *batch; /* LIST or FOLDER */
    int32_t emg_too;   /* the config reads EMG */
    int32_t n_workers; /* 0: as many as there are processors */
    cluster_part shard;
    const char *engine; /* NULL: here */
    int32_t n_tasks;
    words_list option; /* of the engine, as they stand */
} arguments;

extern const words_program arguments_program;

#endif
