/* SPDX-License-Identifier: Apache-2.0 */
/* recording_private.h: what the readers of the recording's files share (recording_table.c). */
#ifndef MHI_RECORDING_PRIVATE_H
#define MHI_RECORDING_PRIVATE_H

#include "estimator/columns.h"
#include "estimator/recording.h"

/* Passes the reader's warnings on. MHE_E_INPUT: the rows come so seldom that their times must be in
 * ms; taken as seconds, a window would last minutes. [cold] */
mhe_status mhi_recording_check_table(const mhi_table *table, const mhe_host *host, mhe_error *err);

/* recording_labels.c: data.subject and data.labels on a table of `width` columns a label.
 * MHE_E_CONFIG: there is no such subject. [cold] */
mhe_status mhi_recording_name(mhi_recording *r, const mhi_run *run, mhi_table *table, int32_t width,
                              mhe_error *err);
/* Names of data.labels that no file had. [cold] */
void mhi_recording_warn_labels(const mhi_recording *r, const mhi_run *run, const mhe_host *host);

/* The model's names of coordinates ('q'), muscles ('m') or markers ('k') [n] in one list; freed by
 * the caller, NULL without memory. [cold] */
const char **mhi_recording_names(const mhe_description *d, int kind, int32_t n);

/* The rows' times become the frames'. [cold] */
mhe_status mhi_recording_set_times(mhi_recording *r, const mhi_table *table, mhe_error *err);
/* Says where frames are missing, and what a window (s) makes of that; and where the steps differ,
 * of which the estimator takes the first window's mean. [cold] */
void mhi_recording_warn_uneven(const mhi_recording *r, const char *path, double window,
                               const mhe_host *host);

/* What a frame takes of a table's rows. */
#define MHI_ROWS_LINEAR 0 /* between those beside it */
#define MHI_ROWS_HOLD 1   /* the last one */
#define MHI_ROWS_MEAN 2   /* the mean of those before the next frame */

/* One quantity of `n` names, `width` columns each, from a table onto the recording's times by
 * MHI_ROWS_*: out [n_frames x n width], taken here. [cold] */
mhe_status mhi_recording_columns(const mhi_recording *r, const mhi_table *table,
                                 const mhi_naming *naming, const char *const *names, int32_t n,
                                 int32_t width, int32_t rows, double **out, int32_t *n_found,
                                 const mhe_host *host, mhe_error *err);

/* recording_emg.c: run->data.emg onto the frames' times; without any, its own become the frames',
 * or of electrodes a grid at emg.rate. [cold] */
mhe_status mhi_recording_read_emg(mhi_recording *r, const mhi_run *run, const mhe_description *d,
                                  const mhe_host *host, mhe_error *err);

#endif
