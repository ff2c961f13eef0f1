/* SPDX-License-Identifier: Apache-2.0 */
/* results.h: the files of a run, row by row. */
#ifndef RESULTS_H
#define RESULTS_H

#include "estimator/recording.h"
#include "io/sink.h"

#include <mhe/estimator.h>

typedef struct results results;

/* Opens estimates.sto, forces.sto, markers.trc, torques.sto and quality.sto in the outbox. */
mhe_status results_open(mhi_outbox *outbox, const mhe_estimator_info *info,
                        const mhi_recording *recording, results **result, mhe_error *err);
mhe_status results_write(results *result, const mhe_estimate *estimate, mhe_error *err);
void results_close(results *result);

#endif
