/* SPDX-License-Identifier: Apache-2.0 */
/* product.h: products of small dense matrices, the first of which is often half zeros. Row-major,
 * ld: doubles from row to row. [hot] */
#ifndef MHI_PRODUCT_H
#define MHI_PRODUCT_H

#include <stdint.h>

typedef struct mhi_matrix {
    double *at;
    int32_t rows, columns, ld;
} mhi_matrix;

/* out += A B and out += A^T B, over the first `columns` of B and out. Zeros of A cost nothing. */
void mhi_product_add(const mhi_matrix *A, const double *B, int32_t ld_b, int32_t columns,
                     double *out, int32_t ld_out);
void mhi_product_add_transposed(const mhi_matrix *A, const double *B, int32_t ld_b, int32_t columns,
                                double *out, int32_t ld_out);

#endif
