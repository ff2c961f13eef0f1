/* SPDX-License-Identifier: Apache-2.0 */
/* clock.h: frames' times on the even grid of the window's nodes.
 *
 * The interval is the mean step of the first full window. From then on a frame belongs to the node
 * nearest to its time: nodes that no frame came for are put in without measurements, and the grid
 * follows the frames slowly, so that neither jitter nor a clock that drifts matters. Where more
 * than a window is missing, or the frames come faster than the interval, or their clock was set
 * back by more than a window, the window is emptied and begins anew; until it is full there is no
 * estimate, as at the start of a run. */
#ifndef MHI_CLOCK_H
#define MHI_CLOCK_H

#include "base/arena.h"

typedef struct mhi_frame_clock {
    int32_t n, ratio;  /* intervals of the window; every ratio-th frame is used */
    double last_time;  /* of the last frame */
    double interval;   /* s between nodes; 0: not known before the window is full */
    double span;       /* s of a window; a guess before the interval is known */
    double grid;       /* s, the newest node's */
    int32_t n_counted; /* frames since the window was emptied */
    double *steps;     /* [n], scratch */
} mhi_frame_clock;

/* What a frame's time means for the window, in this order. */
typedef struct mhi_tick {
    int32_t set_back; /* the clock was; what is known by the old one is worth nothing */
    int32_t emptied;  /* the window is to be */
    int32_t missing;  /* nodes before the frame's that no frame came for */
    double before;    /* s, the node before those */
    int32_t used;     /* the frame is a node */
} mhi_tick;

mhe_status mhi_frame_clock_create(mhi_frame_clock *clock, int32_t n, int32_t ratio, double interval,
                                  mhi_arena *arena, mhe_error *err);
/* MHE_E_ARGUMENT: the time does not follow the last one's. */
mhe_status mhi_frame_clock_take(mhi_frame_clock *clock, double time, mhi_tick *tick,
                                mhe_error *err);
/* Learns the interval from a full window's times [n+1]. `*gap`: there is one in it, and so many
 * nodes lie before its end; the interval is not known then. MHE_E_INPUT: the frames come too seldom
 * for seconds (MHI_SLOWEST). */
mhe_status mhi_frame_clock_measure(mhi_frame_clock *clock, const double *times, int32_t *gap,
                                   mhe_error *err);
/* The interval is not known; the frames are counted anew. */
void mhi_frame_clock_forget(mhi_frame_clock *clock);

#endif
