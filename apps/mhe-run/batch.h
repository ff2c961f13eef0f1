/* SPDX-License-Identifier: Apache-2.0 */
/* batch.h: mhe-run --batch: the trials of a session, over the processors. */
#ifndef BATCH_H
#define BATCH_H

#include "arguments.h"
#include "base/arena.h"

#include <mhe/config.h>

#define BATCH_WORKERS_MAX 256

/* One trial: a run of its own, in a folder of its name. */
typedef struct batch_trial {
    const char *name;
    const char *config;     /* file */
    const char *const *set; /* [n_set] assignments, the command line's first */
    int32_t n_set;
    int32_t line;    /* of the list; 0: of a folder */
    uint64_t digest; /* of all that its results depend on */
    int32_t known;   /* its results are there already */
} batch_trial;

typedef struct batch {
    const char *list; /* LIST or FOLDER as given */
    const char *dir;  /* of the results */
    batch_trial *trials;
    int32_t n;
    mhi_arena arena;
} batch;

/* How a trial ended, kept in its folder as batch.txt. */
typedef struct batch_end {
    uint64_t digest;
    int32_t status; /* exit status of its run; 128 + n: ended by signal n */
    double seconds;
    char message[1024]; /* what it said on stderr last; "" where it said nothing */
} batch_end;

/* The trials that LIST or FOLDER names (batch_list.c). MHE_E_INPUT: "list:line: what". */
mhe_status batch_read(const arguments *a, batch *b, mhe_error *err);

/* Reads each trial's config, without its data, and says by `digest` what its results depend on.
 * (batch_digest.c) */
mhe_status batch_check(const arguments *a, batch *b, const mhe_host *host, mhe_error *err);
/* How a trial ended; 0 where that is not known. (batch_end.c) */
int32_t batch_end_read(const batch *b, const batch_trial *t, batch_end *end);
mhe_status batch_end_write(const batch *b, const batch_trial *t, const batch_end *end,
                           mhe_error *err);

/* Runs trials [n] over processes; every end is on the disk when it returns. MHE_E_INTERRUPTED:
 * Ctrl-C or SIGTERM. (batch_pool.c) */
mhe_status batch_work(const arguments *a, const batch *b, const batch_trial *const *trials,
                      int32_t n, mhe_error *err);

/* batch.csv and batch.html in the folder of the results; *n_failed trials have no estimates.
 * (batch_page.c) */
mhe_status batch_write(const batch *b, int32_t *n_failed, mhe_error *err);

/* The whole of it. MHE_E_NUMERIC: trials failed; the others are there. */
mhe_status batch_run(const arguments *a, const mhe_host *host, mhe_error *err);
/* The same as a job array. */
mhe_status batch_submit(const arguments *a, const mhe_host *host, mhe_error *err);

#endif
