/* SPDX-License-Identifier: Apache-2.0 */
/* begin.h: a full window from its measurements alone: at the start of a run, and where the motion
 * was lost. */
#ifndef MHI_BEGIN_H
#define MHI_BEGIN_H

#include "estimator/start.h"
#include "estimator/statics.h"

#include <mhe/estimator.h>

typedef struct mhi_begin {
    mhi_start *start; /* postures from markers */
    double *q, *v;    /* known first state [n_q], NaN where free */
    double *closed;   /* [n_q] scratch */
    mhi_statics statics;
    double *activation; /* [n_m] of a node, guessed */
    double *range[2];   /* [n_m] of the activations, scratch */
    double *mean;       /* [n_m] of the activations over the window */
    double *torque;     /* [n_r] of a node, guessed */
    double *input;      /* [n_w] scratch */
    double *near;       /* [n_q] scratch */
    double *distance;   /* [n+1] of the markers at each node */
    int32_t n_q;
    int32_t has_posture; /* a channel that tells the posture came, be its values missing */
    int32_t waited;      /* used frames before the first window for want of a posture */
    int32_t rounds;      /* proximal solves since the window was begun */
    int32_t steps;       /* iterations of these */
    int32_t restarted;   /* begun again and no solve has succeeded since */
    int32_t stuck;       /* so many frames' time or work was not enough for one step of it */
    int32_t by_steps;    /* from then on, one step a frame, prepared ahead of it */
} mhi_begin;

mhe_status mhi_begin_create(mhi_begin *begin, const mhi_system *system, mhi_system_context *context,
                            int32_t nodes, mhi_arena *arena, mhe_error *err);
void mhi_begin_free(mhi_begin *begin);
void mhi_begin_forget(mhi_begin *begin); /* nothing is known of the first state */
/* Is there something to begin the full window from? A posture that is known or measured, or where
 * none ever is the EMG alone: a window whose markers are still hidden would wander anywhere, and
 * take long for it. */
int32_t mhi_begin_can(const mhe_estimator *e);
/* The start of a full window. MHE_E_INPUT: the markers do not fit the model at all; nothing is
 * changed. */
mhe_status mhi_window_begin(mhe_estimator *e, mhe_error *err);

#endif
