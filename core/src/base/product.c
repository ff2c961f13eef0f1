/* SPDX-License-Identifier: Apache-2.0 */
#include "base/product.h"

#include "base/clones.h"

#define AT_ONCE 4 /* rows of B, so that a row of the result is touched less often */

/* Row i of the first factor is A + i row, its entries lie `step` apart. */
CLONES static void multiply(const double *A, int32_t rows, int32_t inner, int32_t row, int32_t step,
                            const double *restrict B, int32_t ld_b, int32_t columns,
                            double *restrict out, int32_t ld_out) {
    for (int32_t i = 0; i < rows; i++) {
        double *restrict to = out + i * ld_out;
        for (int32_t k = 0; k < inner;) {
            double a[AT_ONCE] = {0};
            const double *from[AT_ONCE] = {B, B, B, B};
            int32_t n = 0;
            for (; k < inner && n < AT_ONCE; k++) {
                if (A[i * row + k * step] != 0) {
                    a[n] = A[i * row + k * step];
                    from[n++] = B + k * ld_b;
                }
            }
            const double *restrict f0 = from[0], *restrict f1 = from[1];
            const double *restrict f2 = from[2], *restrict f3 = from[3];
            if (n == 1) {
                for (int32_t j = 0; j < columns; j++) {
                    to[j] += a[0] * f0[j];
                }
            } else if (n > 1) {
                for (int32_t j = 0; j < columns; j++) {
                    to[j] += (a[0] * f0[j] + a[1] * f1[j]) + (a[2] * f2[j] + a[3] * f3[j]);
                }
            }
        }
    }
}

void mhi_product_add(const mhi_matrix *A, const double *B, int32_t ld_b, int32_t columns,
                     double *out, int32_t ld_out) {
    multiply(A->at, A->rows, A->columns, A->ld, 1, B, ld_b, columns, out, ld_out);
}

void mhi_product_add_transposed(const mhi_matrix *A, const double *B, int32_t ld_b, int32_t columns,
                                double *out, int32_t ld_out) {
    multiply(A->at, A->columns, A->rows, 1, A->ld, B, ld_b, columns, out, ld_out);
}
