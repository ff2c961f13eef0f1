/* SPDX-License-Identifier: Apache-2.0 */
/* statics.h: muscle activations and residual torques that make a motion, at one instant: static
 * optimisation, for a window to start from. */
#ifndef MHI_STATICS_H
#define MHI_STATICS_H

#include "base/arena.h"
#include "model/system.h"

typedef struct mhi_statics {
    const mhi_system *system;
    int32_t n_q, n_m, n_r;
    int32_t residual;           /* place in r of the residual torques; -1: none */
    double *vdot, *by_a, *by_r; /* [n_q], [n_q x n_m], [n_q x n_r] */
    double *moments, *weight;   /* [n_q x (n_m + 1)], [n_q] */
} mhi_statics;

/* `s` can solve nothing where muscles have states beside their activation. [cold] */
mhe_status mhi_statics_create(mhi_statics *s, const mhi_system *system, mhi_arena *arena,
                              mhe_error *err);

/* Activations a [n_m] (in: where to begin) within lower .. upper and torques r [n_r] with which
 * (q, v) accelerates by `wanted` [n_q] under the inputs w, as nearly as the least sum of squares of
 * activations allows; the residual torques take what is left. 0: done; else a is left
 * alone. [hot] */
int mhi_statics_solve(mhi_statics *s, mhi_system_context *context, const double *q, const double *v,
                      const double *w, const double *wanted, const double *lower,
                      const double *upper, double *a, double *r);

#endif
