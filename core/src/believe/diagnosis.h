/* SPDX-License-Identifier: Apache-2.0 */
/* diagnosis.h: what of a run deserves a look, in plain language. */
#ifndef MHI_DIAGNOSIS_H
#define MHI_DIAGNOSIS_H

#include "base/text.h"
#include "believe/findings.h"
#include "estimator/recording.h"
#include "model/system.h"

#include <mhe/estimator.h>

typedef struct mhi_diagnosis mhi_diagnosis;

/* `info`, `run`, `recording` and `system` must outlive it. [cold] */
mhe_status mhi_diagnosis_create(const mhe_estimator_info *info, const mhi_run *run,
                                const mhi_recording *recording, const mhi_system *system,
                                mhi_diagnosis **result, mhe_error *err);
void mhi_diagnosis_free(mhi_diagnosis *d);

/* Compares an estimate with what was measured at its time. */
void mhi_diagnosis_add(mhi_diagnosis *d, const mhe_estimate *estimate);
/* Distances of measured and estimated markers [n_markers] of the last estimate, m; NaN: missing. */
const double *mhi_diagnosis_distances(const mhi_diagnosis *d);
/* EMG that the last estimate's controls were to follow [n_muscles]; NaN: none. */
const double *mhi_diagnosis_emg(const mhi_diagnosis *d);

/* What of the run makes it doubtful, added to `findings`; `unmet`: why windows failed, "" where it
 * is not known. [cold] */
void mhi_diagnosis_judge(const mhi_diagnosis *d, const char *unmet, mhi_findings *findings);
/* Of marker or muscle i: samples that were there, RMS distance (m, or of 1), samples not believed.
 */
typedef struct mhi_channel_tally {
    int32_t present, left_out;
    double rms;
} mhi_channel_tally;
mhi_channel_tally mhi_diagnosis_marker(const mhi_diagnosis *d, int32_t i);
mhi_channel_tally mhi_diagnosis_muscle(const mhi_diagnosis *d, int32_t i);

/* One finding a line, the most important first; "try: " begins what may help. */
void mhi_diagnosis_lines(const mhi_diagnosis *d, mhi_text *out);

#endif
