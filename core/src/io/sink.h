/* SPDX-License-Identifier: Apache-2.0 */
/* sink.h: result files, written row by row to temporary names and renamed when complete. */
#ifndef MHI_SINK_H
#define MHI_SINK_H

#include "base/text.h"

/* A folder of result files. Nothing with a final name appears before mhi_outbox_commit; until then
 * x.sto has a new, hidden name beside it that no other program can have known. */
typedef struct mhi_outbox mhi_outbox;
/* Makes the folder (and its parents). MHE_E_IO: cannot. [cold] */
mhe_status mhi_outbox_open(const char *dir, mhi_outbox **outbox, mhe_error *err);
/* The folder for this outbox alone until it is closed: another one's claim ends with MHE_E_IO.
 * Outboxes that claim nothing may still add files: whole ones, one by one. `names` [n_names], lent,
 * are all files that the folder may get, checked now rather than after hours of work. What a killed
 * run left half-written is removed. MHE_E_IO: claimed by another, or a folder has one of the names.
 * [cold] */
mhe_status mhi_outbox_claim(mhi_outbox *outbox, const char *const *names, int32_t n_names,
                            mhe_error *err);
/* MHE_E_ARGUMENT: one of the claim's names is the file `input` (NULL: none). [cold] */
mhe_status mhi_outbox_spare(const mhi_outbox *outbox, const char *input, mhe_error *err);
/* Appends "a, b" of the claim's names that were there before it and still are: of an earlier run.
 * -> their number. [cold] */
int32_t mhi_outbox_stale(const mhi_outbox *outbox, mhi_text *out);
/* Flushes, syncs and renames every file of the outbox. No name changes before all files are safely
 * on the disk and all targets are looked at; MHE_E_IO: they are not, or a name could not be
 * changed: then all old files are back (but on file systems that cannot exchange names). Sinks are
 * gone after it; the outbox may be filled again. */
mhe_status mhi_outbox_commit(mhi_outbox *outbox, mhe_error *err);
/* Frees; without a commit before, the temporary files are removed, and the folder if it was made
 * for them. */
void mhi_outbox_close(mhi_outbox *outbox);
/* Removes the temporary files of an outbox that will not be closed, because the program ends here
 * and now: all that a signal handler may do. NULL is fine. */
void mhi_outbox_abandon(const mhi_outbox *outbox);
/* A whole text file. */
mhe_status mhi_outbox_text(mhi_outbox *outbox, const char *name, const char *text, mhe_error *err);

typedef struct mhi_sink mhi_sink; /* freed by its outbox */
/* A .sto with `time` and these labels (nRows is filled in at commit). [cold] */
mhe_status mhi_sink_sto(mhi_outbox *outbox, const char *name, const char *title,
                        const char *const *labels, int32_t n_columns, mhi_sink **sink,
                        mhe_error *err);
/* A .trc; `markers` [n_markers] names; values of rows are metres, `unit` metres per file unit,
 * `unit_name` "mm". */
mhe_status mhi_sink_trc(mhi_outbox *outbox, const char *name, const char *const *markers,
                        int32_t n_markers, double rate, double unit, const char *unit_name,
                        mhi_sink **sink, mhe_error *err);
/* A .csv with `time` and these labels in its first line; NaN is NaN. [cold] */
mhe_status mhi_sink_csv(mhi_outbox *outbox, const char *name, const char *const *labels,
                        int32_t n_columns, mhi_sink **sink, mhe_error *err);
/* Appends a row: [n_columns] or [3 n_markers]; NaN is written as nan (.sto) or left empty (.trc).
 * Rows are buffered: MHE_E_IO may come some rows late, but never later than the commit. */
mhe_status mhi_sink_row(mhi_sink *sink, double time, const double *values, mhe_error *err);

#endif
