/* SPDX-License-Identifier: Apache-2.0 */
/* channel.h: the table of measured quantities, each with its measurements at the window's nodes.
 *
 * A row of the table is all that the estimator knows of a quantity: what it is compared with, how
 * late it is, what fills its gaps, what makes it unbelievable. Whatever is done to measurements is
 * done to all rows. */
#ifndef MHI_CHANNEL_H
#define MHI_CHANNEL_H

#include "base/arena.h"
#include "config/run.h"
#include "estimator/samples.h"
#include "ocp/ocp.h"

#include <mhe/estimator.h>

/* What makes a measurement unbelievable (trust.c). */
#define MHI_TRUST_ALL 0      /* nothing */
#define MHI_TRUST_POSITION 1 /* points too far from where they are expected */
#define MHI_TRUST_RAILS 2    /* most of it at the ends of its range for long */

typedef struct mhi_channel {
    mhe_channel face;
    int32_t signal;    /* MHI_SIGNAL_* that it is the target of; -1: an input of a force */
    int32_t input;     /* place in the system's inputs */
    int32_t posture;   /* it tells how the body stands */
    int32_t trust;     /* MHI_TRUST_* */
    int32_t read;      /* a cost reads the signal */
    int32_t frames;    /* by which what a node tracks lags behind */
    int32_t gap_nodes; /* the longest gap, in intervals */
    int32_t seen;      /* how much it varies is what was seen so far, however little */
    double unseen;     /* else: how much it may vary of which little was seen */
    double interval;   /* s from node to node */
    double span;       /* s that a node's mean is over; 0: not known, or no mean */

    /* Rows of the window's nodes, oldest first. */
    double *measured;        /* [nodes x width] */
    double *believed;        /* the same, NaN where trust.c does not believe it: the targets */
    double misfit, n_misfit; /* sum of squares of how far estimates were from it; of how many */
    int32_t *why;            /* [nodes x width] MHE_TRACK_* */
    double *sums;  /* [6 x width] over nodes that have left the window; and with those in it */
    uint8_t *late; /* [nodes x width] 0: it came with the frame, which nothing later changes */

    int32_t *n_in_mean;     /* [width] frames in the newest node's mean */
    double *line;           /* [(frames+1) x width] of the last frames */
    double *absent, *found; /* [width] all missing; scratch */
    double *varied;         /* [width] standard deviation so far */
    mhi_samples samples;
    mhe_channel_counts counts;
} mhi_channel;

typedef struct mhi_channels {
    int32_t n, nodes;
    int64_t n_frames; /* pushed so far */
    mhi_channel *rows;
    mhe_channel *faces; /* [n] what is told of them */
} mhi_channels;

/* The table of a problem, for a window of `nodes`. [cold] */
mhe_status mhi_channels_create(const mhi_run *run, const mhi_ocp *ocp,
                               const mhe_description *description, int32_t nodes, mhi_arena *arena,
                               mhi_channels *channels, mhe_error *err);
void mhi_channels_free(mhi_channels *channels);
/* Delay and gap in s follow the interval between nodes. */
void mhi_channels_set_interval(mhi_channels *channels, double interval, int32_t ratio);

/* The target of a signal; NULL: none is. */
mhi_channel *mhi_channels_find(const mhi_channels *channels, int32_t signal);
/* What a frame says of channel i; its `absent` where nothing. */
const double *mhi_channels_of_frame(const mhi_channels *channels, int32_t i,
                                    const mhe_frame *frame);
/* What a node at this frame tracks: what the channel was `frames` ago, before that the first. Once
 * a frame and channel; n_frames is counted by the caller. */
const double *mhi_channel_delayed(const mhi_channels *channels, int32_t i, const double *values);

/* Node k becomes `values` [width]. */
void mhi_channel_set(mhi_channel *channel, int32_t k, const double *values);
/* Node k, which a frame began, goes on: the next frame's `values`, in a channel of means. */
void mhi_channel_add(mhi_channel *channel, int32_t k, const double *values);
/* All nodes are believed again. */
void mhi_channel_believe(mhi_channel *channel, int32_t nodes);
/* How much the channel varies [width], NaN: nothing was measured: the standard deviation of all so
 * far, with the `filled` nodes of the window, which is kept as `varied`, and while little was seen
 * what it may vary by. Else a silent channel would be believed to the last at the start. */
void mhi_channel_spread(mhi_channel *channel, int32_t filled, double *spread);
/* Counts how far an estimate [width] is from what was believed; missing entries do not count. */
void mhi_channel_compare(mhi_channel *channel, const double *estimated, const double *believed);
/* The oldest of the nodes is dropped; the newest stands twice. */
void mhi_channels_shift(mhi_channels *channels, int32_t filled);
int32_t mhi_channel_any(const double *values, int32_t n); /* one of them is not NaN */

/* late.c: looks again what the samples say of nodes at times [filled], which but the newest were in
 * a solve where `solved`; `changed` (k) is called for each node and channel that says something
 * else now. */
typedef void mhi_late_changed(void *data, mhi_channel *channel, int32_t k);
void mhi_channels_look(mhi_channels *channels, const double *times, int32_t filled, int32_t solved,
                       mhi_late_changed *changed, void *data);

#endif
