/* SPDX-License-Identifier: Apache-2.0 */
/* arguments.h: the command line of mhe-study. */
#ifndef ARGUMENTS_H
#define ARGUMENTS_H

#include "cluster.h"
#include "words.h"

/* Commands, in the order of the table. */
enum { COMMAND_RUN, COMMAND_REPORT, COMMAND_SUBMIT, COMMAND_MERGE };

typedef struct arguments {
    int32_t mode;      /* 0 */
    const char *file;  /* study file or results folder */
    words_list others; /* more folders */
    const char *out;   /* NULL: ./out/<study's name> */
    words_list set;
    int32_t n_workers;  /* 0: as many as there are processors */
    cluster_part shard; /* 0/1 unless given */
    const char *engine;
    int32_t n_tasks;
    words_list option; /* of the engine, lent as they stand */
    int32_t quiet, check, trust;
} arguments;

extern const words_program arguments_program;

#endif
