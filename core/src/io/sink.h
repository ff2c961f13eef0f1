/* SPDX-License-Identifier: Apache-2.0 */
/* sink.h: result files, written row by row to temporary names and renamed when complete. */
#ifndef MHI_SINK_H
#define MHI_SINK_H

#include <mhe/abi.h>

/* A folder of result files. Nothing with a final name appears before mhi_outbox_commit; until then
 * x.sto is .x.sto.tmp beside it. */
typedef struct mhi_outbox mhi_outbox;
/* Makes the folder (and its parents). MHE_E_IO: cannot. [cold] */
mhe_status mhi_outbox_open(const char *dir, mhi_outbox **outbox, mhe_error *err);
/* Flushes, syncs and renames every file of the outbox. No name changes before all files are safely
 * on the disk; MHE_E_IO: they are not, or a name could not be changed. Sinks are gone after it. */
mhe_status mhi_outbox_commit(mhi_outbox *outbox, mhe_error *err);
/* Frees; without a commit before, the temporary files are removed. */
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
