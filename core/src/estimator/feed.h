/* SPDX-License-Identifier: Apache-2.0 */
/* feed.h: an estimator's own electrodes: raw samples in, the channel "emg" out.
 *
 * A frame whose EMG is complete takes it along, as one of a recording does, to the bit. One that
 * comes before its EMG waits: as soon as a sample at or after its time is there, its EMG is
 * measured at that time (mhe_estimator_measure). Where a node wants the mean of its interval, no
 * frame's EMG is complete when it comes: it is measured with what there is as soon as there is
 * some, and again once the samples up to the next frame are there. */
#ifndef MHI_FEED_H
#define MHI_FEED_H

#include "emg/electrodes.h"

#define MHI_FEED_WAITING 512 /* frames; beyond them the oldest goes without */

typedef struct mhi_feed {
    mhi_electrodes *electrodes;       /* NULL: EMG comes with frames or not at all */
    int32_t channel;                  /* "emg" of the table */
    int32_t mean;                     /* until the next frame */
    double newest;                    /* s, of the samples */
    double step;                      /* s between the last two frames; 0: not known */
    double *values;                   /* [n_muscles] */
    double waiting[MHI_FEED_WAITING]; /* s, ring of frames whose EMG is not complete */
    int32_t first, n;
} mhi_feed;

/* The EMG [n_muscles] that the frame at `time` takes along; NULL: it waits for it. */
const double *mhi_feed_of_frame(mhi_feed *raw, double time);

#endif
