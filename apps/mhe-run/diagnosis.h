/* SPDX-License-Identifier: Apache-2.0 */
/* diagnosis.h: what of a run deserves a look, in plain language. */
#ifndef DIAGNOSIS_H
#define DIAGNOSIS_H

#include "base/text.h"
#include "estimator/recording.h"
#include "model/system.h"

#include <mhe/estimator.h>

typedef struct diagnosis diagnosis;

/* `info`, `run`, `recording` and `system` must outlive it. [cold] */
mhe_status diagnosis_create(const mhe_estimator_info *info, const mhi_run *run,
                            const mhi_recording *recording, const mhi_system *system,
                            diagnosis **result, mhe_error *err);
void diagnosis_free(diagnosis *d);

/* Compares an estimate with what was measured at its time. */
void diagnosis_add(diagnosis *d, const mhe_estimate *estimate);
/* Distances of measured and estimated markers [n_markers] of the last estimate, m; NaN: missing. */
const double *diagnosis_distances(const diagnosis *d);
/* EMG that the last estimate's controls were to follow [n_muscles]; NaN: none. */
const double *diagnosis_emg(const diagnosis *d);

/* One finding a line, the most important first; "try: " begins what may help. */
void diagnosis_lines(const diagnosis *d, mhi_text *out);

#endif
