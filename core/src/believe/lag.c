/* SPDX-License-Identifier: Apache-2.0 */
/* lag.c: EMG and motion on different clocks, or EMG without its electromechanical delay. */
#include "believe/diagnosis_private.h"

void mhi_lag_begin(mhi_lag *lag, int32_t n_muscles) {
    for (int32_t i = 0; i < n_muscles; i++) {
        lag->emg[i] = NAN;
    }
}

void mhi_lag_add(mhi_lag *lag, int32_t n_muscles, double time, const double *emg,
                 const double *control) {
    const double step = time - lag->time;
    for (int32_t i = 0; i < n_muscles; i++) {
        const double residual = control[i] - emg[i];
        const double slope = (emg[i] - lag->emg[i]) / step;
        if (step > 0 && !isnan(slope)) { /* both at the middle of the two */
            const double mean = 0.5 * (residual + lag->residual[i]);
            lag->residuals += mean * mean;
            lag->slopes += slope * slope;
            lag->products += mean * slope;
            lag->n++;
        }
        lag->emg[i] = emg[i];
        lag->residual[i] = residual;
    }
    lag->time = time;
}

double mhi_lag_seconds(const mhi_lag *lag, double *share) {
    const double of = lag->residuals * lag->slopes;
    *share = of > 0 ? lag->products * lag->products / of : 0;
    return lag->slopes > 0 ? lag->products / lag->slopes : 0;
}
