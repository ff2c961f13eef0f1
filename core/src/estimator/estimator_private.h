/* SPDX-License-Identifier: Apache-2.0 */
/* estimator_private.h: the estimator's parts, shared by its files. */
#ifndef MHI_ESTIMATOR_PRIVATE_H
#define MHI_ESTIMATOR_PRIVATE_H

#include "base/arena.h"
#include "estimator/create.h"
#include "estimator/start.h"

#include <mhe/estimator.h>

struct mhe_estimator {
    const mhe_host *host;
    mhi_registry *registry; /* NULL where the run was lent */
    mhi_run *owned_run;
    const mhi_run *run;
    mhe_description *description;
    mhi_system *system;
    mhi_ocp *ocp;
    const mhe_solver_ops *solver;
    void *solver_self;
    mhi_start *start;

    int32_t n_q, n_m, n_k, n_r, n_x, n_u, n; /* n: intervals of the window */

    /* Measurements, one row a node, oldest first; `filled` rows are there. */
    int32_t filled;
    double *times;   /* [n+1] */
    double *markers; /* [(n+1) x 3 n_k] */
    double *emg;     /* [(n+1) x n_m] */
    /* EMG of the last frames, for the electromechanical delay. */
    double *delay_line; /* [(delay+1) x n_m] */
    int32_t delay;
    int64_t n_frames; /* pushed so far */
    double last_time;

    int32_t solved;       /* windows so far */
    int32_t failure_told; /* the host knows that the solver gave an error */
    mhe_solution solution;
    double *guess_x, *guess_u;           /* what the last solve started from */
    double *prior_centre, *prior_weight; /* [n_x], of the first window's proximal term */
    double *start_q, *start_v;           /* known first state [n_q], NaN where free */

    double *no_markers, *no_emg; /* all missing */

    /* The estimate handed out. */
    double *out_activation, *out_excitation, *out_force, *out_moment, *out_marker, *out_residual;
    double *out_q, *out_v;
    mhi_arena arena;
};

/* window.c */
void mhi_window_append(mhe_estimator *e, double time, const double *markers, const double *emg);
/* Bounds, targets and start of the next solve. */
mhe_status mhi_window_prepare(mhe_estimator *e, mhe_error *err);
/* Solves; the outcome as MHE_FRAME_*. */
void mhi_window_solve(mhe_estimator *e, mhe_solve_info *info, int32_t *frame_status);
/* Drops the oldest node and shifts the solution to start the next. */
void mhi_window_advance(mhe_estimator *e);

#endif
