/* SPDX-License-Identifier: Apache-2.0 */
/* workers.h: trials on many processes. */
#ifndef WORKERS_H
#define WORKERS_H

#include "study.h"

#define WORKERS_MAX 256

typedef struct workers_setup {
    const study *study;
    const task *tasks; /* [n_tasks], in the order they are begun */
    int32_t n_tasks;
    int32_t n_before, n_failed_before; /* done earlier, for the bar */
    const char *dir, *own;             /* results folder, name of the shard */
    const mhe_host *host;
    int32_t n_workers;
    int quiet;
} workers_setup;

typedef struct workers_report {
    int32_t n_done, n_failed;
    double seconds;
} workers_report;

/* Runs all tasks; every result is on the disk when it returns. A trial that crashes its worker is
 * a failed trial and the others go on; one whose worker somebody kills is run again, three times
 * at most. MHE_E_INTERRUPTED: Ctrl-C or SIGTERM; what was begun is dropped. MHE_E_IO, MHE_E_MEMORY:
 * a worker could not go on. */
mhe_status workers_run(const workers_setup *setup, workers_report *report, mhe_error *err);

#endif
