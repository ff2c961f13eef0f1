/* SPDX-License-Identifier: Apache-2.0 */
/* watch.h: streams that are not what they say, told once each. Nothing here changes an estimate. */
#ifndef MHI_WATCH_H
#define MHI_WATCH_H

#include "live/inlet.h"

/* How far markers are from the model's. */
typedef struct mhi_watch {
    double sum; /* m */
    int64_t n;
    int32_t n_estimates;
} mhi_watch;

/* After a sample of a stream was taken: does it come at the rate that it says, and is its EMG of
 * the size of its MVC? Judged after some seconds. */
void mhi_watch_stream(mhi_inlet *inlet, const mhi_inlet_setup *setup);

/* After an estimate: are the markers where the model's are? */
void mhi_watch_markers(const mhi_inlet_setup *setup, const char *stream,
                       const mhe_estimate *estimate, mhi_watch *watch);

#endif
