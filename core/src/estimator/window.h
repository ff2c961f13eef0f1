/* SPDX-License-Identifier: Apache-2.0 */
/* window.h: the moving window: its nodes' times, its solution, and the shift that starts the next
 * solve (Algorithm 1 of Bailly et al. 2021). Measurements stand in the channels. */
#ifndef MHI_WINDOW_H
#define MHI_WINDOW_H

#include "base/arena.h"

#include <mhe/estimator.h>
#include <mhe/solver.h>

typedef struct mhi_window {
    int32_t n, n_x, n_u; /* intervals, states with what costs carry along, controls */
    int32_t filled;      /* nodes that are there, of n+1, oldest first */
    int32_t prepared;    /* the start of the next solve is made */
    int32_t solved;      /* windows so far */
    double *times;       /* [n+1] */
    mhe_solution solution;
    double *left_u;                      /* [n_u] of the interval that was dropped last */
    int32_t has_left;                    /* it leads to node 0 */
    double *guess_x, *guess_u;           /* what the last solve started from */
    double *prior_centre, *prior_weight; /* [n_x], of an unsettled window's proximal term */
} mhi_window;

mhe_status mhi_window_create(mhi_window *window, int32_t n, int32_t n_x, int32_t n_u,
                             mhi_arena *arena, mhe_error *err);
/* The next node, with the channels' measurements [channels]; NULL: none. */
void mhi_window_append(mhe_estimator *e, double time, const double *const *values);
void mhi_window_skip(mhe_estimator *e, double time); /* a node without a measurement */
void mhi_window_clear(mhe_estimator *e);             /* as if no frame had come yet */
/* What can be done for the next solve before its newest frame is there: start, bounds, the solver's
 * part. Once between two frames of a window that was begun. */
void mhi_window_follow(mhe_estimator *e);
void mhi_window_set_targets(mhe_estimator *e);
/* Bounds of every node, the first state fixed where it is settled. */
void mhi_window_set_bounds(mhe_estimator *e);
/* Drops the oldest node and shifts the solution to start the next. */
void mhi_window_advance(mhe_estimator *e);

#endif
