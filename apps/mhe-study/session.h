/* SPDX-License-Identifier: Apache-2.0 */
/* session.h: a study with all it needs, and its results folder. */
#ifndef SESSION_H
#define SESSION_H

#include "arguments.h"
#include "material.h"
#include "rows.h"
#include "study.h"

typedef struct session {
    const mhe_host *host;
    mhi_registry *registry;
    study study;
    material material;
    const char *dir; /* results folder */
    rows rows;
    int lock; /* open file that holds the lock of the shard; -1 */
    mhi_arena arena;
} session;

/* Zero it before; give it back with session_close, also after a failure. */

/* Reads and checks the study as far as that goes without a results folder. */
mhe_status session_read(session *s, const char *file, const char *const *set, int32_t n_set,
                        const mhe_host *host, mhe_error *err);
/* The same as the command line asks for it: a program of the study's must be trusted. */
mhe_status session_read_asked(session *s, const arguments *a, const mhe_host *host, mhe_error *err);
/* Everything else that can be told without one: models, motions that are there, every condition's
 * estimator. */
mhe_status session_check(session *s, mhe_error *err);
/* Opens the folder `out` (NULL: ./out/<study's name>): refuses another study's, makes motions that
 * are missing, checks every condition, writes what the folder is. */
mhe_status session_prepare(session *s, const char *out, int quiet, mhe_error *err);
/* The study that a results folder is of, with all its rows. */
mhe_status session_reopen(session *s, const char *dir, const mhe_host *host, mhe_error *err);
/* Makes the shard ours and reads all rows. MHE_E_IO: another process has it. */
mhe_status session_take_shard(session *s, const char *own, mhe_error *err);
/* The folder's own lock, for what only one process may do at a time: close() the file *lock. */
mhe_status session_lock(session *s, int *lock, mhe_error *err);
/* The folder's identity with motions. */
mhe_status session_identity(const session *s, mhi_text *text, mhe_error *err);
void session_close(session *s);

#endif
