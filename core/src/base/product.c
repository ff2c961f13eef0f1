/* SPDX-License-Identifier: Apache-2.0 */
#include "base/product.h"

#include "base/clones.h"

/* Row i of the first factor is A + i row, its entries lie `step` apart. */
CLONES static void multiply(const double *A, int32_t rows, int32_t inner, int32_t row, int32_t step,
                            const double *restrict B, int32_t ld_b, int32_t columns,
                            double *restrict out, int32_t ld_out) {
    for (int32_t i = 0; i < rows; i++) {
        double *restrict to = out + i * ld_out;
        for (int32_t k = 0; k < inner; k++) {
            const double a = A[i * row + k * step];
            const double *restrict from = B + k * ld_b;
            if (a == 0) {
                continue;
            }
            for (int32_t j = 0; j < columns; j++) {
                to[j] += a * from[j];
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
