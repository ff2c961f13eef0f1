/* SPDX-License-Identifier: Apache-2.0 */
/* riccati.h: the Newton system of a staged quadratic program by a recursion over the stages.
 *
 *     minimise sum 1/2 w_k^T (H_k + diag d_k) w_k + g_k^T w_k,  x_{k+1} = F_k w_k + b_k
 *
 * The cost to go 1/2 x^T P_k x + p_k^T x follows backwards from a partial Cholesky factorisation of
 * M_k = H_k + diag d_k + F_k^T P_{k+1} F_k: its rows of u are [U L], and P_k = M_xx - L^T L. Cost
 * linear in N (Rao, Wright and Rawlings 1998, doi:10.1023/A:1021711402723; Frison and Diehl 2020,
 * HPIPM, doi:10.1016/j.ifacol.2020.12.073). Rows of F that hold a state and one control alone cost
 * n^2 instead of n^3. */
#ifndef RICCATI_H
#define RICCATI_H

#include "stage_qp.h"

typedef struct riccati {
    const qp_shape *shape;
    const uint8_t *fixed;   /* [size_z] 1: the variable is 0; of controls and of the first state */
    int32_t first_is_fixed; /* all of the first state */
    double *M;              /* [N][n_z x ld_z] */
    double *P;              /* [N+1][n_x x ld_x], symmetric, both triangles */
    double *inverse;        /* [N][ld_z] of the diagonal of U */
    double *first;          /* factor of P_0 [n_x x ld_x], and its inverse diagonal [ld_x] */
    double *first_inverse;
    double *T;         /* P F [n_x x ld_z] */
    double *p, *y, *v; /* [size_x], [size_z], [ld_x] */
} riccati;

size_t riccati_size(const qp_shape *s); /* doubles */
void riccati_place(riccati *r, const qp_shape *s, const uint8_t *fixed, double *memory);

/* Which variables are fixed has changed. */
void riccati_read_fixed(riccati *r);
/* Factorises with `diagonal` d [size_z]. 0: some M_uu or P_0 is not positive definite. */
int32_t riccati_factor(riccati *r, const qp_stage *stages, const double *diagonal);
/* Minimiser w [size_z] for g [size_z] and b [size_x], and the multipliers lambda [size_x] of
 * x_{k+1} - F_k w_k - b_k. */
void riccati_solve(riccati *r, const qp_stage *stages, const double *g, const double *b, double *w,
                   double *lambda);

/* ---- covariances, of what riccati_factor() factorised ----
 *
 * exp(-1/2 w^T H w) on the dynamics is a Gaussian, and leaving out what comes after a stage is
 * minimising over it. So the recursion backwards says what of u_k is left where x_k is known, u_k =
 * K_k x_k + noise of covariance M_uu^-1, and a second one forwards collects it from the first state
 * on, whose covariance is P_0^-1 (Rauch, Tung and Striebel 1965, doi:10.2514/3.3166, the other way
 * round). What is fixed has none. */

/* Is a pivot so small beside its diagonal element that it is rounding? */
int32_t riccati_is_singular(const riccati *r);
/* K [n_u x ld_x] and the symmetric M_uu^-1 [n_u x ld_z] of stage k. */
void riccati_gain(riccati *r, int32_t k, double *K, double *rest);
/* Covariance of the first state [n_x x ld_x]. */
void riccati_first(riccati *r, double *covariance);

#endif
