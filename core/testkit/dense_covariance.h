/* SPDX-License-Identifier: Apache-2.0 */
/* dense_covariance.h: what the covariances of a solution must be: the inverse of its whole
 * optimality system, written down densely. For tests; cubic in the size of the problem. */
#ifndef MHI_DENSE_COVARIANCE_H
#define MHI_DENSE_COVARIANCE_H

#include <mhe/solver.h>

/* Variables w stage by stage (u_k, x_k), parameters, then multipliers of the dynamics. */
typedef struct mhi_dense {
    int32_t n_x, n_u, n_p, n_z, N, n_w, n; /* n = n_w + n_p + N n_x */
    double *K, *inverse;                   /* [n x n]; K is used up */
    uint8_t *gone;                         /* [n_w + n_p] at a bound, or fixed: no variable */
    int32_t n_gone_x, n_gone_u, n_gone_p; /* states of later nodes, controls, parameters that are */
} mhi_dense;

/* Of the problem at `at`, with its multipliers. 0: no memory, a stage without values, or a singular
 * system. */
int32_t mhi_dense_make(const mhe_stage_problem *problem, const mhe_solution *at, mhi_dense *dense);
void mhi_dense_free(mhi_dense *dense);
/* Largest difference of all blocks that a solver's covariance() gives at all nodes, beside
 * sqrt(variance x variance); of what hardly varies, beside a millionth of the largest variance,
 * which is what the dense inverse is good for. NaN: it failed. */
double mhi_dense_compare(const mhi_dense *dense, const mhe_solver_ops *ops, void *solver,
                         mhe_error *err);

#endif
