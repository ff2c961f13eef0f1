/* SPDX-License-Identifier: Apache-2.0 */
/* cholesky.h: A = L L^T for the small symmetric positive definite matrices of the hot path (n about
 * 4 to 30, where a library's call costs more than the arithmetic). Row-major. [hot] */
#ifndef MHI_CHOLESKY_H
#define MHI_CHOLESKY_H

#include <stdint.h>

/* Replaces the lower triangle of A [n x n] by L, with the reciprocals of L's diagonal on the
 * diagonal. Returns 0, or -1 where A is not positive definite. */
int mhi_cholesky_factor(double *A, int32_t n);

/* Replaces the n_columns columns of B [n x n_columns, row-major] by A^-1 B. */
void mhi_cholesky_solve(const double *L, int32_t n, double *B, int32_t n_columns);

/* The same of a positive semidefinite A whose rows may repeat each other: those that add nothing
 * (pivots of at most 1e-11 of the largest) are passed over, order [n] holds the others first.
 * Replaces the columns of B by a solution of A X = B, 0 in the rows passed over; B has to be in the
 * range of A. Returns the rank, -1 where A is not finite. */
int mhi_semidefinite_factor(double *A, int32_t n, int32_t *order);
void mhi_semidefinite_solve(const double *L, int32_t n, const int32_t *order, int32_t rank,
                            double *B, int32_t n_columns);

#endif
