/* SPDX-License-Identifier: Apache-2.0 */
/* errors.h: how far estimates are from the truth: RMSE over time per channel, then the mean over
 * channels. */
#ifndef MHI_ERRORS_H
#define MHI_ERRORS_H

#include "estimator/recording.h"
#include "model/system.h"

#include <mhe/estimator.h>

typedef struct mhi_errors mhi_errors;

/* Collects against recording->reference, which must be present; muscle forces and markers that the
 * file does not hold are computed by the model from the reference states. [cold] */
mhe_status mhi_errors_create(const mhi_system *system, const mhi_recording *recording,
                             mhi_errors **errors, mhe_error *err);
void mhi_errors_free(mhi_errors *errors);
mhe_status mhi_errors_add(mhi_errors *errors, const mhe_estimate *estimate, mhe_error *err);

/* NaN where nothing could be compared. */
typedef struct mhi_rmse {
    double q, qdot; /* rad (m), rad/s */
    double activation, excitation;
    double force;  /* N */
    double marker; /* m */
} mhi_rmse;

/* Over all estimates but the first `skip_first` and the last `skip_last`. */
void mhi_errors_rmse(const mhi_errors *errors, int32_t skip_first, int32_t skip_last,
                     mhi_rmse *rmse);

#endif
