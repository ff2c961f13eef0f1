/* SPDX-License-Identifier: Apache-2.0 */
/* cluster.h: work in equal parts, in processes of their own or as the job array of an engine that
 * shares out machines. */
#ifndef CLUSTER_H
#define CLUSTER_H

#include "base/arena.h"

#define CLUSTER_TASKS_MAX 100000

/* --shard 2/8: the third of eight parts. */
typedef struct cluster_part {
    int32_t i, n;
} cluster_part;

/* Reads "2/8" into the cluster_part at `target`; a words_take. */
mhe_status cluster_take_part(const char *word, const char *value, void *target, mhe_error *err);

/* Processors that this process may use, at most `most`. */
int32_t cluster_processors(int32_t most);

typedef struct cluster_job {
    const char *name;
    const char *dir;            /* of the results, absolute */
    const char *const *command; /* [n_command] program and its words; each task adds --workers N
                                 * --quiet --shard I/N */
    int32_t n_command;
    int32_t n_tasks, n_workers;
    const char *const *options; /* [n_options] of the engine, as they stand */
    int32_t n_options;
} cluster_job;

/* MHE_E_ARGUMENT: NULL, or an engine that is not known; the text names the nearest. */
mhe_status cluster_check_engine(const char *engine, mhe_error *err);

/* Writes dir/slurm/job.sh and hands it to sbatch; *job: what Slurm calls it, the arena's. A task
 * that dies with its machine is requeued. Programs and files must be at the same paths everywhere.
 * MHE_E_ARGUMENT: a folder that Slurm's file names cannot hold; MHE_E_IO: it was not taken. */
mhe_status cluster_submit(const cluster_job *what, mhi_arena *arena, const char **job,
                          mhe_error *err);

#endif
