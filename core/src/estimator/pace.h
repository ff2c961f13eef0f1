/* SPDX-License-Identifier: Apache-2.0 */
/* pace.h: what a frame may take. With realtime.deadline_ms the clock says it; without, a multiple
 * of the work that frames usually take (counted as in model/work.h), so that data which do not fit
 * cost no more than data which do, and the same input gives the same output on any machine. */
#ifndef MHI_PACE_H
#define MHI_PACE_H

#include "estimator/looks.h"

#include <mhe/estimator.h>

#define MHI_PACE_FRAMES 15 /* whose median is usual */

typedef struct mhi_pace {
    double budget;                  /* s from a frame's arrival to its estimate; 0: no limit */
    double arrival;                 /* of the frame in work, s of CLOCK_MONOTONIC */
    double part;                    /* of the budget, that what is done now may take */
    double ahead;                   /* s spent by mhe_estimator_prepare on the next estimate */
    int64_t kept;                   /* from the search of postures */
    double prepared;                /* work of the same */
    double frames[MHI_PACE_FRAMES]; /* work of the last that ended as they should, a ring */
    int32_t n_frames, next;         /* in it, and the place of the next */
    int32_t has_converged;          /* one of them at least */
    double usual;                   /* 0: not known yet */
    double least;                   /* that usual was */
    double first, later, all_first; /* left for the frames until then, see pace.c; first at first */
    int32_t rests, woken;           /* no window is begun until there is enough of it again */
    int32_t first_told;
    int32_t settled; /* the frame in work is no beginning */
    int32_t over;    /* its time or work was over when it was solved */
    int32_t is_granted;
    mhe_grant granted; /* of the next frame, where is_granted */
    mhi_looks looks;
} mhi_pace;

void mhi_pace_create(mhe_estimator *e);
/* 1: it is time to begin the window anew, after a rest. */
int32_t mhi_pace_wakes(mhe_estimator *e);
/* The first window has its guess: what an interval takes. Overwrites the solution. */
void mhi_pace_measure(mhe_estimator *e);
/* The frame in work begins; and its solve, with what is left; and the prediction that stands in for
 * it. */
void mhi_pace_begin(mhe_estimator *e);
void mhi_pace_predict(mhe_estimator *e);
/* The search of postures of a window that begins has begun (1) or ended (0): a part of the frame's
 * work is kept for the solve. */
void mhi_pace_postures(mhe_estimator *e, int32_t begun);
/* By the clock: what is done from now on may take until this part of the frame's time is over; 1 at
 * its begin. */
void mhi_pace_part(mhe_estimator *e, double part);
/* 1: its time or work is over. The others: mhe_solve_control.spent and late. */
int32_t mhi_pace_over(mhe_estimator *e);
int32_t mhi_pace_spent(void *estimator, int32_t solutions);
int32_t mhi_pace_late(void *estimator, double seconds);
int32_t mhi_pace_by_clock(const mhe_estimator *e); /* the frame in work has a deadline */
/* Before an evaluation that no look precedes. */
void mhi_pace_tick(mhe_estimator *e);
/* The frame in work is solved: what is left to say of it takes no time, and none is looked at. */
void mhi_pace_solved(mhe_estimator *e);
/* Ahead of a frame. */
void mhi_pace_prepare(mhe_estimator *e);
void mhi_pace_prepared(mhe_estimator *e, double seconds);
/* The frame ended with MHE_FRAME_*. */
void mhi_pace_end(mhe_estimator *e, int32_t frame_status);

#endif
