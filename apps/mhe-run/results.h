/* SPDX-License-Identifier: Apache-2.0 */
/* results.h: the files of a run, row by row. */
#ifndef RESULTS_H
#define RESULTS_H

#include <mhe/outbox.h>
#include <mhe/recording.h>

typedef struct results results;

/* Every file that a run may leave in its folder. */
extern const char *const results_names[];
extern const int32_t results_n_names;

/* Opens estimates, forces, torques, marker_residuals, emg and quality (.sto), markers.trc and
 * motion.sto in the outbox; with "csv" in `formats` ("[csv, mat]") the same as .csv, with "mat" in
 * results.mat. Markers there are in m.
 */
mhe_status results_open(mhe_outbox *outbox, const mhe_estimator_info *info,
                        const mhe_recording_info *recording, const char *formats, results **result,
                        mhe_error *err);
/* `distance` [n_markers] m of measured and estimated markers, `emg` [n_muscles] that was tracked.
 */
mhe_status results_write(results *result, const mhe_estimate *estimate, const double *distance,
                         const double *emg, mhe_error *err);
void results_close(results *result);

#endif
