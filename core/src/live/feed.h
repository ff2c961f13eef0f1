/* SPDX-License-Identifier: Apache-2.0 */
/* feed.h: packets become frames and measurements of the estimator.
 *
 * What comes out depends on the packets and on nothing else: no clock is looked at here, so that a
 * recording repeats a run. */
#ifndef MHI_FEED_H
#define MHI_FEED_H

#include "live/clocks.h"
#include "live/inlet.h"
#include "live/watch.h"

#define MHI_FEED_INLETS 64
#define MHI_FEED_MAXIMA 64 /* electrodes whose maximum can be looked for */

/* Told of every frame that was estimated. `host_time`: s of CLOCK_MONOTONIC of the estimate's node.
 */
typedef void (*mhi_feed_taker)(void *data, const mhe_estimate *estimate, double host_time);

/* Told of every frame that was pushed, estimated or not: what it was granted. */
typedef void (*mhi_feed_pusher)(void *data, const mhe_grant *grant, double host_time);

typedef struct mhi_feed {
    mhi_inlet_setup setup;
    mhe_estimator_info info;
    mhe_estimator *estimator;
    mhi_feed_taker taker;
    mhi_feed_pusher pusher;
    void *data;
    int32_t n_inlets;
    mhi_inlet inlets[MHI_FEED_INLETS];
    mhi_clock clocks[MHI_FEED_INLETS];
    mhi_watch watch;
    int32_t driver;  /* inlet whose samples are the frames; -1: none yet */
    int32_t running; /* 0: samples are passed over */
    double begun;    /* s of CLOCK_MONOTONIC, first sample of the driver; NaN: none */
    double start;    /* s of CLOCK_MONOTONIC, of the first frame */
    double last;     /* s since then, of the last frame */
    double *waiting; /* ring of frames without the electrodes' EMG */
    int32_t n_waiting, first_waiting;
    double maxima[MHI_FEED_MAXIMA]; /* of emg.channels, found while it runs; 0: the config's */
    int32_t repeats;         /* what comes is a recording that says what frames were granted */
    int32_t prepared;        /* since the last frame */
    int32_t behind;          /* frames are passed over: the run does not keep up */
    const double **channels; /* [info.n_channels] of a frame */
    int64_t n_frames, n_estimates, n_out_of_order, n_restarts, n_passed_over, n_clock_set;
    int64_t n_by_status[8];
} mhi_feed;

mhe_status mhi_feed_open(mhi_feed *feed, const mhe_host *host, const mhi_run *run,
                         const mhe_description *model, mhe_estimator *estimator, mhe_error *err);
void mhi_feed_close(mhi_feed *feed);

/* Takes a packet; it stays the caller's. MHE_E_INPUT and worse: the run cannot go on. */
mhe_status mhi_feed_take(mhi_feed *feed, const mhi_packet *packet, mhe_error *err);

/* From now on samples count. MHE_E_INPUT: no stream of markers or joint angles has anything of the
 * model. */
mhe_status mhi_feed_begin(mhi_feed *feed, mhe_error *err);

/* The EMG of a channel of the config is relative to this maximum from its next sample on. 0: it is
 * none. */
int32_t mhi_feed_set_maximum(mhi_feed *feed, int32_t channel, double value);

/* There is time before the next frame: its window is prepared, unless what comes is a repetition,
 * which says itself when. */
void mhi_feed_prepare(mhi_feed *feed);

/* The inlet of a stream; NULL: there is none. */
mhi_inlet *mhi_feed_inlet(mhi_feed *feed, int32_t source, int32_t stream);

#endif
