/* SPDX-License-Identifier: Apache-2.0 */
/* feedback.h: a feedback that keeps a motion on its track: time-varying linear-quadratic regulator.
 *
 *     minimise  sum_k  dx_k^T Q dx_k + du_k^T R_k du_k  +  dx_N^T Q dx_N,   dx_{k+1} = A_k dx_k +
 * B_k du_k,   du_k = -K_k dx_k, Q, R_k diagonal. Source: Riccati recursion, Anderson & Moore
 * (1990), Optimal Control: Linear Quadratic Methods, ch. 2. */
#ifndef MHI_FEEDBACK_H
#define MHI_FEEDBACK_H

#include "base/arena.h"

typedef struct mhi_feedback_setup {
    int32_t n, n_x, n_u;    /* intervals, states, controls */
    const double *A, *B;    /* [n x n_x x n_x], [n x n_x x n_u], row-major */
    const double *q_weight; /* [n_x] diagonal of Q, >= 0 */
    const double *r_weight; /* [n x n_u] diagonals of R_k, > 0 */
} mhi_feedback_setup;

/* gain [n x n_u x n_x]: the K_k. MHE_E_NUMERIC: not finite. [cold] */
mhe_status mhi_feedback_gains(const mhi_feedback_setup *setup, double *gain, mhe_error *err);

/* u [n_u] -= K_k (x - x_track). [hot] */
void mhi_feedback_apply(const double *gain, int32_t n_x, int32_t n_u, const double *x,
                        const double *x_track, double *u);

#endif
