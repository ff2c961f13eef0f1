/* SPDX-License-Identifier: Apache-2.0 */
/* kernels_body.h: the kernels, compiled once for each instruction set; KERNELS_TABLE and
 * KERNELS_NAME say for which. */
#include "kernels.h"

#include <math.h>
#include <stddef.h>

/* Four doubles, wherever they lie; narrower machines take two instructions each. */
typedef double vec4 __attribute__((vector_size(32), aligned(8), may_alias));

#define AT(p) (*(const vec4 *)(p))
#define PUT(p) (*(vec4 *)(p))

/* `rows` rows of C from column j on, 8 columns; `rows` is a constant once inlined, and so is
 * whether A is transposed. */
__attribute__((always_inline)) static inline void block(int32_t rows, int32_t transposed, int32_t k,
                                                        double alpha, const double *A, int32_t ld_a,
                                                        const double *B, int32_t ld_b,
                                                        const double *D, double *C, int32_t ld_c) {
    vec4 sum[4][2] = {{{0}}};
    for (int32_t p = 0; p < k; p++) {
        const vec4 left = AT(B + p * ld_b), right = AT(B + p * ld_b + 4);
        const double *a = A + (transposed ? p * ld_a : p);
        for (int32_t r = 0; r < rows; r++) {
            sum[r][0] += a[transposed ? r : r * ld_a] * left;
            sum[r][1] += a[transposed ? r : r * ld_a] * right;
        }
    }
    for (int32_t r = 0; r < rows; r++) {
        double *c = C + r * ld_c;
        if (D != NULL) {
            PUT(c) = AT(D + r * ld_c) + alpha * sum[r][0];
            PUT(c + 4) = AT(D + r * ld_c + 4) + alpha * sum[r][1];
        } else {
            PUT(c) = alpha * sum[r][0];
            PUT(c + 4) = alpha * sum[r][1];
        }
    }
}

__attribute__((always_inline)) static inline void blocks(int32_t transposed, int32_t m, int32_t n,
                                                         int32_t k, double alpha, const double *A,
                                                         int32_t ld_a, const double *B,
                                                         int32_t ld_b, const double *D, double *C,
                                                         int32_t ld_c, int32_t upper) {
    for (int32_t i = 0; i < m; i += 4) {
        const int32_t rows = m - i;
        for (int32_t j = upper ? i : 0; j < n; j += 8) {
            const double *a = A + (transposed ? i : i * ld_a), *b = B + j;
            double *c = C + i * ld_c + j;
            const double *before = D != NULL ? D + i * ld_c + j : NULL;
            if (rows >= 4) {
                block(4, transposed, k, alpha, a, ld_a, b, ld_b, before, c, ld_c);
            } else if (rows == 3) {
                block(3, transposed, k, alpha, a, ld_a, b, ld_b, before, c, ld_c);
            } else if (rows == 2) {
                block(2, transposed, k, alpha, a, ld_a, b, ld_b, before, c, ld_c);
            } else {
                block(1, transposed, k, alpha, a, ld_a, b, ld_b, before, c, ld_c);
            }
        }
    }
}

static void product(int32_t m, int32_t n, int32_t k, double alpha, const double *A, int32_t ld_a,
                    const double *B, int32_t ld_b, const double *D, double *C, int32_t ld_c,
                    int32_t upper) {
    blocks(1, m, n, k, alpha, A, ld_a, B, ld_b, D, C, ld_c, upper);
}

static void product_rows(int32_t m, int32_t n, int32_t k, double alpha, const double *A,
                         int32_t ld_a, const double *B, int32_t ld_b, const double *D, double *C,
                         int32_t ld_c) {
    blocks(0, m, n, k, alpha, A, ld_a, B, ld_b, D, C, ld_c, 0);
}

static inline void subtract_row(int32_t from, int32_t n, double a, const double *x, double *y) {
    for (int32_t j = from; j < n; j += 4) {
        PUT(y + j) = AT(y + j) - a * AT(x + j);
    }
}

/* Left-looking by blocks of four rows. */
static int32_t factor(int32_t n, int32_t n_all, double *M, int32_t ld, double *inverse) {
    for (int32_t i = 0; i < n; i += 4) {
        const int32_t end = i + 4 < n ? i + 4 : n;
        double *corner = M + i * ld + i;
        product(end - i, n_all - i, i, -1, M + i, ld, M + i, ld, corner, corner, ld, 0);
        for (int32_t r = i; r < end; r++) {
            double *row = M + r * ld;
            for (int32_t p = i; p < r; p++) {
                subtract_row(r, n_all, M[p * ld + r], M + p * ld, row);
            }
            if (!(row[r] > 0) || !isfinite(row[r])) {
                return 0;
            }
            inverse[r] = 1 / sqrt(row[r]);
            for (int32_t j = r; j < n_all; j += 4) {
                PUT(row + j) = inverse[r] * AT(row + j);
            }
        }
    }
    return 1;
}

static void add_columns(int32_t m, int32_t n, const double *A, int32_t ld_a, const double *d,
                        double *C, int32_t ld_c) {
    for (int32_t i = 0; i < m; i++) {
        const double *a = A + i * ld_a;
        double *c = C + i * ld_c;
        for (int32_t j = 0; j < n; j += 4) {
            PUT(c + j) = AT(c + j) + AT(a + j) * AT(d + j);
        }
    }
}

static void add_rows(int32_t m, int32_t n, int32_t first, const double *d, const double *A,
                     int32_t ld_a, double *C, int32_t ld_c) {
    for (int32_t i = 0; i < m; i++) {
        subtract_row(first + i, n, -d[i], A + i * ld_a, C + i * ld_c);
    }
}

static void substitute(int32_t n, int32_t n_all, const double *U, int32_t ld, const double *inverse,
                       double *m) {
    for (int32_t i = 0; i < n; i++) {
        m[i] *= inverse[i];
        subtract_row(i + 1, n_all, m[i], U + i * ld, m);
    }
}

static void substitute_back(int32_t n, const double *U, int32_t ld, const double *inverse,
                            const double *y, double *w) {
    for (int32_t i = n - 1; i >= 0; i--) {
        const double *row = U + i * ld;
        double sum[4] = {y[i]}; /* four at a time: a sum has to wait for itself */
        int32_t j = i + 1;
        for (; j + 4 <= n; j += 4) {
            for (int32_t l = 0; l < 4; l++) {
                sum[l] += row[j + l] * w[j + l];
            }
        }
        for (; j < n; j++) {
            sum[0] += row[j] * w[j];
        }
        w[i] = -((sum[0] + sum[1]) + (sum[2] + sum[3])) * inverse[i];
    }
}

static void add_transposed(int32_t m, int32_t n, double alpha, const double *A, int32_t ld,
                           const double *x, double *y) {
    int32_t i = 0;
    for (; i + 4 <= m; i += 4) {
        const double *a = A + i * ld;
        const double x0 = alpha * x[i], x1 = alpha * x[i + 1], x2 = alpha * x[i + 2],
                     x3 = alpha * x[i + 3];
        for (int32_t j = 0; j < n; j += 4) {
            PUT(y + j) = AT(y + j) + (x0 * AT(a + j) + x1 * AT(a + ld + j)) +
                         (x2 * AT(a + 2 * ld + j) + x3 * AT(a + 3 * ld + j));
        }
    }
    for (; i < m; i++) {
        subtract_row(0, n, -alpha * x[i], A + i * ld, y);
    }
}

static void add(int32_t m, int32_t n, double alpha, const double *A, int32_t ld, const double *x,
                double *y) {
    for (int32_t i = 0; i < m; i++) {
        vec4 sum = {0};
        for (int32_t j = 0; j < n; j += 4) {
            sum += AT(A + i * ld + j) * AT(x + j);
        }
        y[i] += alpha * ((sum[0] + sum[1]) + (sum[2] + sum[3]));
    }
}

/* A block of four rows and columns. */
static inline void transpose_four(const double *A, int32_t ld_a, double *B, int32_t ld_b) {
    const vec4 a = AT(A), b = AT(A + ld_a), c = AT(A + 2 * ld_a), d = AT(A + 3 * ld_a);
    const vec4 ab = __builtin_shufflevector(a, b, 0, 4, 2, 6),
               ba = __builtin_shufflevector(a, b, 1, 5, 3, 7),
               cd = __builtin_shufflevector(c, d, 0, 4, 2, 6),
               dc = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    PUT(B) = __builtin_shufflevector(ab, cd, 0, 1, 4, 5);
    PUT(B + ld_b) = __builtin_shufflevector(ba, dc, 0, 1, 4, 5);
    PUT(B + 2 * ld_b) = __builtin_shufflevector(ab, cd, 2, 3, 6, 7);
    PUT(B + 3 * ld_b) = __builtin_shufflevector(ba, dc, 2, 3, 6, 7);
}

/* Rows [from, m) of A, columns [first, n). */
static inline void transpose_rest(int32_t from, int32_t m, int32_t first, int32_t n,
                                  const double *A, int32_t ld_a, double *B, int32_t ld_b) {
    for (int32_t i = from; i < m; i++) {
        for (int32_t j = first; j < n; j++) {
            B[j * ld_b + i] = A[i * ld_a + j];
        }
    }
}

static void transpose(int32_t m, int32_t n, const double *A, int32_t ld_a, double *B,
                      int32_t ld_b) {
    const int32_t rows = m / 4 * 4, columns = n / 4 * 4;
    for (int32_t i = 0; i < rows; i += 4) {
        for (int32_t j = 0; j < columns; j += 4) {
            transpose_four(A + i * ld_a + j, ld_a, B + j * ld_b + i, ld_b);
        }
    }
    transpose_rest(0, rows, columns, n, A, ld_a, B, ld_b);
    transpose_rest(rows, m, 0, n, A, ld_a, B, ld_b);
}

static void mirror(int32_t n, double *M, int32_t ld) {
    for (int32_t i = 0; i < n; i += 4) {
        const int32_t end = i + 4 < n ? i + 4 : n;
        for (int32_t r = i; r < end; r++) {
            for (int32_t j = r + 1; j < end; j++) {
                M[j * ld + r] = M[r * ld + j];
            }
        }
        if (end < n) {
            transpose(end - i, n - end, M + i * ld + end, ld, M + end * ld + i, ld);
        }
    }
}

const kernels KERNELS_TABLE = {.name = KERNELS_NAME,
                               .product = product,
                               .product_rows = product_rows,
                               .add_columns = add_columns,
                               .add_rows = add_rows,
                               .factor = factor,
                               .substitute = substitute,
                               .substitute_back = substitute_back,
                               .transpose = transpose,
                               .mirror = mirror,
                               .add_transposed = add_transposed,
                               .add = add};
