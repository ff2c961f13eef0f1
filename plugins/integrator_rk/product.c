/* SPDX-License-Identifier: Apache-2.0 */
/* product.c: C = A^T B or C += A^T B for the matrices of a step, whose rows both run along: blocks
 * of 4 rows and 8 columns of C stay in registers. */
#include "../clones.h"
#include "rk.h"

/* Four doubles, wherever they lie. */
typedef double lanes __attribute__((vector_size(32), aligned(8), may_alias));

/* `rows` rows of C, 4 `wide` columns, set or added to; all three are constants once inlined. */
__attribute__((always_inline)) static inline void rk_block(int32_t rows, int32_t wide, int set,
                                                           int32_t k, const double *A, int32_t ld_a,
                                                           const double *B, int32_t ld_b, double *C,
                                                           int32_t ld_c) {
    lanes sum[4][2] = {{{0}}};
    for (int32_t p = 0; p < k; p++) {
        for (int32_t r = 0; r < rows; r++) {
            for (int32_t c = 0; c < wide; c++) {
                sum[r][c] += A[p * ld_a + r] * *(const lanes *)(B + p * ld_b + 4 * c);
            }
        }
    }
    for (int32_t r = 0; r < rows; r++) {
        for (int32_t c = 0; c < wide; c++) {
            lanes *to = (lanes *)(C + r * ld_c + 4 * c);
            if (!set) {
                sum[r][c] += *to;
            }
            *to = sum[r][c];
        }
    }
}

__attribute__((always_inline)) static inline void rk_rows(int32_t rows, int32_t n, int set,
                                                          int32_t k, const double *A, int32_t ld_a,
                                                          const double *B, int32_t ld_b, double *C,
                                                          int32_t ld_c) {
    int32_t j = 0;
    for (; j + 8 <= n; j += 8) {
        rk_block(rows, 2, set, k, A, ld_a, B + j, ld_b, C + j, ld_c);
    }
    for (; j + 4 <= n; j += 4) {
        rk_block(rows, 1, set, k, A, ld_a, B + j, ld_b, C + j, ld_c);
    }
    for (int32_t r = 0; r < rows && j < n; r++) {
        for (int32_t i = j; i < n; i++) {
            double sum = 0;
            for (int32_t p = 0; p < k; p++) {
                sum += A[p * ld_a + r] * B[p * ld_b + i];
            }
            C[r * ld_c + i] = set ? sum : C[r * ld_c + i] + sum;
        }
    }
}

__attribute__((always_inline)) static inline void rk_all(int32_t m, int32_t n, int set, int32_t k,
                                                         const double *A, int32_t ld_a,
                                                         const double *B, int32_t ld_b, double *C,
                                                         int32_t ld_c) {
    int32_t i = 0;
    for (; i + 4 <= m; i += 4) {
        rk_rows(4, n, set, k, A + i, ld_a, B, ld_b, C + i * ld_c, ld_c);
    }
    for (; i < m; i++) {
        rk_rows(1, n, set, k, A + i, ld_a, B, ld_b, C + i * ld_c, ld_c);
    }
}

CLONES static void rk_multiply(int32_t m, int32_t n, int set, int32_t k, const double *A,
                               int32_t ld_a, const double *B, int32_t ld_b, double *C,
                               int32_t ld_c) {
    if (set) {
        rk_all(m, n, 1, k, A, ld_a, B, ld_b, C, ld_c);
    } else {
        rk_all(m, n, 0, k, A, ld_a, B, ld_b, C, ld_c);
    }
}

void rk_product(int32_t m, int32_t n, int set, int32_t k, const double *A, int32_t ld_a,
                const double *B, int32_t ld_b, double *C, int32_t ld_c) {
    rk_multiply(m, n, set, k, A, ld_a, B, ld_b, C, ld_c);
}
