/* SPDX-License-Identifier: Apache-2.0 */
/* lapack.h: the two LAPACK routines in use (column-major, 32-bit integers). */
#ifndef INTEGRATOR_RK_LAPACK_H
#define INTEGRATOR_RK_LAPACK_H

#include <stdint.h>

void dgetrf_(const int32_t *m, const int32_t *n, double *a, const int32_t *lda, int32_t *pivots,
             int32_t *info);
void dgetrs_(const char *trans, const int32_t *n, const int32_t *n_rhs, const double *a,
             const int32_t *lda, const int32_t *pivots, double *b, const int32_t *ldb,
             int32_t *info);

#endif
