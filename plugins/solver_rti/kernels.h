/* SPDX-License-Identifier: Apache-2.0 */
/* kernels.h: the dense linear algebra of small matrices that the recursion lives on.
 *
 * Matrices are row-major with rows of `ld` doubles, ld a multiple of 8 that leaves at least 8
 * doubles behind the last column (KERNEL_LD); what lies there is zero and may be read and written,
 * so that no loop needs a remainder. The products have the form A^T B, whose inner loop runs along
 * rows of both (Goto and van de Geijn 2008, doi:10.1145/1356052.1356053, in registers only: at 8 to
 * 120 rows all lies in the cache). */
#ifndef KERNELS_H
#define KERNELS_H

#include <stdint.h>

#define KERNEL_LD(n) (((n) + 15) / 8 * 8)

typedef struct kernels {
    const char *name; /* of the instruction set */
    /* C [m x n] = D + alpha A^T B with A [k x m], B [k x n]; D has the rows of C, may be C itself,
     * and is zero where NULL. `upper`: only what lies on or above the diagonal is needed. */
    void (*product)(int32_t m, int32_t n, int32_t k, double alpha, const double *A, int32_t ld_a,
                    const double *B, int32_t ld_b, const double *D, double *C, int32_t ld_c,
                    int32_t upper);
    /* C [m x n] = D + alpha A B with A [m x k]; n is a multiple of 8, and nothing lies behind it.
     */
    void (*product_rows)(int32_t m, int32_t n, int32_t k, double alpha, const double *A,
                         int32_t ld_a, const double *B, int32_t ld_b, const double *D, double *C,
                         int32_t ld_c);
    /* C [m x n] += A diag(d); d has zeros behind n. */
    void (*add_columns)(int32_t m, int32_t n, const double *A, int32_t ld_a, const double *d,
                        double *C, int32_t ld_c);
    /* C [m x n] += diag(d) A from column first + i on in row i. */
    void (*add_rows)(int32_t m, int32_t n, int32_t first, const double *d, const double *A,
                     int32_t ld_a, double *C, int32_t ld_c);
    /* First n rows of the upper triangle of the symmetric M [n_all x n_all]: M = U^T U there, so
     * that U is the Cholesky factor in the first n columns and U^-T M in the others. Each U_ii^-1
     * goes to `inverse` [n]. 0: not positive definite. */
    int32_t (*factor)(int32_t n, int32_t n_all, double *M, int32_t ld, double *inverse);
    /* U^T y = m in the first n entries of m [n_all], which become y; what lies behind them loses
     * L^T y. [U L] and `inverse` are what factor() made. */
    void (*substitute)(int32_t n, int32_t n_all, const double *U, int32_t ld, const double *inverse,
                       double *m);
    /* U w = -y */
    void (*substitute_back)(int32_t n, const double *U, int32_t ld, const double *inverse,
                            const double *y, double *w);
    /* B [n x m] = A^T, A [m x n]; nothing beside them is touched. */
    void (*transpose)(int32_t m, int32_t n, const double *A, int32_t ld_a, double *B, int32_t ld_b);
    /* Below the diagonal what stands above it, M [n x n]. */
    void (*mirror)(int32_t n, double *M, int32_t ld);
    /* y [n] += alpha A^T x, A [m x n]; y has KERNEL_LD(n) doubles. */
    void (*add_transposed)(int32_t m, int32_t n, double alpha, const double *A, int32_t ld,
                           const double *x, double *y);
    /* y [m] += alpha A x, A [m x n]; x is zero behind n. */
    void (*add)(int32_t m, int32_t n, double alpha, const double *A, int32_t ld, const double *x,
                double *y);
} kernels;

extern const kernels kernels_generic;
extern const kernels kernels_avx2; /* where the compiler can make it (KERNELS_AVX2) */

/* The fastest set that this processor runs. */
const kernels *kernels_best(void);

#endif
