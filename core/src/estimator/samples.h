/* SPDX-License-Identifier: Apache-2.0 */
/* samples.h: the newest samples of a channel that come on their own, in the order of their times
 * whatever the order in which they came, and what the channel was worth at a node's time. */
#ifndef MHI_SAMPLES_H
#define MHI_SAMPLES_H

#include <mhe/abi.h>

typedef struct mhi_samples {
    int32_t width;
    int32_t capacity;      /* 0: none came yet */
    int32_t n, first;      /* in the ring, place of the oldest */
    double *time, *values; /* [capacity], [capacity x width] */
    double changed;        /* what was found at times after this may be another by now; +infinity:
                            * nothing came since */
} mhi_samples;

void mhi_samples_free(mhi_samples *samples);
void mhi_samples_clear(mhi_samples *samples);
/* A sample; one of the same time is replaced. The oldest goes where there is no room. Allocates at
 * the first one. */
mhe_status mhi_samples_put(mhi_samples *samples, double time, const double *values, mhe_error *err);
/* Values [width] at a time by a rule MHE_GAP_* over gaps of at most `gap` s, the mean over `span`
 * s; NaN: none. [hot] */
void mhi_samples_at(const mhi_samples *samples, int32_t rule, double gap, double span, double time,
                    double *values);

#endif
