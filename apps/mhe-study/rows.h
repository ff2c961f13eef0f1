/* SPDX-License-Identifier: Apache-2.0 */
/* rows.h: results as they come: one append-only file per worker in dir/rows, one line per trial.
 *
 *     <digest>\t<condition>\t<trial>\t<cells>\t<timing>\t<reason>\n
 *
 * The digest (FNV-1a, 16 hex digits) is of everything behind it. Lines are written whole, with one
 * write() to a file opened with O_APPEND, and synced to the disk once a second and at the end.
 * After a power cut a file may end in half a line, or in blocks that were never written (NUL
 * bytes): such lines are dropped and their trials run again. Any other line that does not fit its
 * digest was damaged later, and is refused. */
#ifndef ROWS_H
#define ROWS_H

#include "study.h"

typedef struct row {
    task task;
    const char *cells, *timing, *reason;
    const char *file; /* for messages */
    int32_t line;
} row;

typedef struct rows {
    row *list; /* [n], by trial and condition, each once */
    int32_t n, capacity;
    int32_t n_differing; /* trials that were run twice, with different results */
    mhi_arena arena;
} rows;

/* All rows in dir/rows. Files of the shard `own` ("0of1", nobody else writes to them now) are cut
 * behind their last whole line; NULL: none. MHE_E_INPUT: "file:line: ..." a damaged line.
 * Give back with rows_free, also after a failure. */
mhe_status rows_read(const study *s, const char *dir, const char *own, rows *r, mhe_error *err);
void rows_free(rows *r);

typedef struct row_writer {
    int fd;
    double synced;
    char path[4200];
} row_writer;

/* dir/rows/<own>-<worker>.rows */
mhe_status rows_open(const char *dir, const char *own, int32_t worker, row_writer *w,
                     mhe_error *err);
mhe_status rows_append(row_writer *w, const row *r, mhe_error *err);
mhe_status rows_close(row_writer *w, mhe_error *err);

#endif
