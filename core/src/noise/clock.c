/* SPDX-License-Identifier: Apache-2.0 */
/* clock.c: when samples are taken, and where that lies in the reference. */
#include "noise/parts.h"

#include <math.h>
#include <stdlib.h>

#define SAMPLES_MAX 50000000
#define SAME_TIME 5e-7 /* s: files print times with six digits */

void mhi_record_free(mhi_record *record) {
    free(record->time);
    free(record->values);
    *record = (mhi_record){0};
}

mhe_status mhi_record_open(mhi_record *record, const mhi_clock *clock,
                           const mhi_recording *reference, int32_t n_channels, const char *what,
                           mhe_error *err) {
    const double first = reference->time[0];
    const double span = reference->time[reference->n_frames - 1] - first;
    const double n = clock->rate > 0 ? floor(span * clock->rate + 1e-6) + 1 : reference->n_frames;
    if (n > SAMPLES_MAX) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "%s: %g s at %g Hz are more than %d samples; lower the rate", what, span,
                        clock->rate, SAMPLES_MAX);
    }
    *record = (mhi_record){.n_samples = (int32_t)n,
                           .n_channels = n_channels,
                           .rate = clock->rate > 0 ? clock->rate : reference->rate};
    record->time = calloc((size_t)n, sizeof(double));
    record->values = calloc((size_t)n * (size_t)n_channels + 1, sizeof(double));
    if (record->time == NULL || record->values == NULL) {
        mhi_record_free(record);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t k = 0; k < record->n_samples; k++) {
        record->time[k] = clock->rate > 0 ? first + k / clock->rate : reference->time[k];
    }
    return MHE_OK;
}

mhi_moment mhi_clock_moment(const mhi_clock *clock, const mhi_recording *reference, double label) {
    const double *time = reference->time;
    const double taken = label + (label - time[0]) * clock->clock_error - clock->latency;
    int32_t low = 0, high = reference->n_frames; /* last row that is not after `taken` */
    while (high - low > 1) {
        const int32_t middle = low + (high - low) / 2;
        if (time[middle] <= taken + SAME_TIME) {
            low = middle;
        } else {
            high = middle;
        }
    }
    mhi_moment at = {.row = low};
    if (low + 1 < reference->n_frames) {
        at.step = time[low + 1] - time[low];
        const double since = taken - time[low];
        at.fraction = since > SAME_TIME ? since / at.step : 0;
    }
    return at;
}
