/* SPDX-License-Identifier: Apache-2.0 */
/* outbox.h: result files, written row by row under temporary names and renamed all together when
 * they are complete: a folder holds the results of a whole run, or those it held before.
 *
 *     mhe_outbox_open("out", &outbox, &err);
 *     mhe_sink_sto(outbox, "forces.sto", "muscle forces (N)", names, n, &forces, &err);
 *     mhe_sink_row(forces, time, values, &err);        as often as there is something
 *     mhe_outbox_commit(outbox, &err);
 *     mhe_outbox_close(outbox);
 *
 * Threads: an outbox and its sinks belong to one thread at a time. */
#ifndef MHE_OUTBOX_H
#define MHE_OUTBOX_H

#include <mhe/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A folder of result files. Nothing with a final name appears before mhe_outbox_commit; until then
 * x.sto has a new, hidden name beside it that no other program can have known. */
typedef struct mhe_outbox mhe_outbox;

/* Makes the folder (and its parents). MHE_E_IO: cannot. [cold] */
MHE_API mhe_status mhe_outbox_open(const char *dir, mhe_outbox **outbox, mhe_error *err);
/* The folder for this outbox alone until it is closed: another one's claim ends with MHE_E_IO.
 * Outboxes that claim nothing may still add files: whole ones, one by one. `names` [n_names], lent,
 * are all files that the folder may get, checked now rather than after hours of work. What a killed
 * run left half-written is removed. MHE_E_IO: claimed by another, or a folder has one of the names.
 * [cold] */
MHE_API mhe_status mhe_outbox_claim(mhe_outbox *outbox, const char *const *names, int32_t n_names,
                                    mhe_error *err);
/* MHE_E_ARGUMENT: one of the claim's names is the file `input` (NULL: none). [cold] */
MHE_API mhe_status mhe_outbox_spare(const mhe_outbox *outbox, const char *input, mhe_error *err);
/* Names "a, b" of the claim's that were there before it and still are: of an earlier run. `*n` is
 * their number, `*names` the caller's: mhe_free() (library.h). [cold] */
MHE_API mhe_status mhe_outbox_stale(const mhe_outbox *outbox, char **names, int32_t *n,
                                    mhe_error *err);
/* Flushes, syncs and renames every file of the outbox. No name changes before all files are safely
 * on the disk and all targets are looked at; MHE_E_IO: they are not, or a name could not be
 * changed: then all old files are back (but on file systems that cannot exchange names). Sinks are
 * gone after it; the outbox may be filled again. */
MHE_API mhe_status mhe_outbox_commit(mhe_outbox *outbox, mhe_error *err);
/* Frees; without a commit before, the temporary files are removed, and the folder if it was made
 * for them. */
MHE_API void mhe_outbox_close(mhe_outbox *outbox);
/* Removes the temporary files of an outbox that will not be closed, because the program ends here
 * and now: all that a signal handler may do. NULL is fine. */
MHE_API void mhe_outbox_abandon(const mhe_outbox *outbox);
/* A whole text file. [cold] */
MHE_API mhe_status mhe_outbox_text(mhe_outbox *outbox, const char *name, const char *text,
                                   mhe_error *err);
/* A file that the caller writes to; the outbox closes it. [cold] */
MHE_API mhe_status mhe_outbox_stream(mhe_outbox *outbox, const char *name, FILE **stream,
                                     mhe_error *err);
/* A file that `write` makes at the commit, for libraries that write by name: `path` opens it, and
 * only while `write` runs. Where it returns no MHE_OK nothing is committed. `release` (NULL: none)
 * is called once with `data`, whether or not there was a commit, unless this call fails. [cold] */
MHE_API mhe_status mhe_outbox_later(mhe_outbox *outbox, const char *name,
                                    mhe_status (*write)(void *data, const char *path,
                                                        mhe_error *err),
                                    void (*release)(void *data), void *data, mhe_error *err);

typedef struct mhe_sink mhe_sink; /* freed by its outbox */
/* A .sto with `time` and these labels (nRows is filled in at commit). [cold] */
MHE_API mhe_status mhe_sink_sto(mhe_outbox *outbox, const char *name, const char *title,
                                const char *const *labels, int32_t n_columns, mhe_sink **sink,
                                mhe_error *err);
/* A .trc; `markers` [n_markers] names; values of rows are metres, `unit` metres per file unit,
 * `unit_name` "mm". */
MHE_API mhe_status mhe_sink_trc(mhe_outbox *outbox, const char *name, const char *const *markers,
                                int32_t n_markers, double rate, double unit, const char *unit_name,
                                mhe_sink **sink, mhe_error *err);
/* A .csv with `time` and these labels in its first line; NaN is NaN. [cold] */
MHE_API mhe_status mhe_sink_csv(mhe_outbox *outbox, const char *name, const char *const *labels,
                                int32_t n_columns, mhe_sink **sink, mhe_error *err);
/* Appends a row: [n_columns] or [3 n_markers]; NaN is written as nan (.sto) or left empty (.trc).
 * Rows are buffered: MHE_E_IO may come some rows late, but never later than the commit. */
MHE_API mhe_status mhe_sink_row(mhe_sink *sink, double time, const double *values, mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif
