/* SPDX-License-Identifier: Apache-2.0 */
#include "base/cholesky.h"

#include "base/clones.h"

#include <math.h>

/* Four doubles, wherever they lie. */
typedef double lanes __attribute__((vector_size(32), aligned(8), may_alias));

/* Sum of what rows[k] row[k] are over the first n, for each of four rows, off sum. */
__attribute__((always_inline)) static inline void
less_products(const double *rows, int32_t ld, const double *row, int32_t n, double *sum) {
    lanes products[4] = {{0}};
    int32_t k = 0;
    for (; k + 4 <= n; k += 4) {
        const lanes with = *(const lanes *)(row + k);
        for (int32_t r = 0; r < 4; r++) {
            products[r] += *(const lanes *)(rows + r * ld + k) * with;
        }
    }
    for (int32_t r = 0; r < 4; r++) {
        sum[r] -= (products[r][0] + products[r][1]) + (products[r][2] + products[r][3]);
        for (int32_t i = k; i < n; i++) {
            sum[r] -= rows[r * ld + i] * row[i];
        }
    }
}

#define WIDE 64 /* rows from which on vectors are worth what their sums cost at the end */

CLONES static int factor_wide(double *A, int32_t n) {
    for (int32_t j = 0; j < n; j++) {
        double *row_j = A + j * n;
        double pivot[4] = {row_j[j]};
        int32_t i = j + 1;
        less_products(row_j, 0, row_j, j, pivot);
        if (!(pivot[0] > 0)) {
            return -1;
        }
        row_j[j] = 1 / sqrt(pivot[0]);
        for (; i + 4 <= n; i += 4) {
            double *rows = A + i * n,
                   sum[4] = {rows[j], rows[n + j], rows[2 * n + j], rows[3 * n + j]};
            less_products(rows, n, row_j, j, sum);
            for (int32_t r = 0; r < 4; r++) {
                rows[r * n + j] = sum[r] * row_j[j];
            }
        }
        for (; i < n; i++) {
            double sum[4] = {A[i * n + j]};
            less_products(A + i * n, 0, row_j, j, sum);
            A[i * n + j] = sum[0] * row_j[j];
        }
    }
    return 0;
}

int mhi_cholesky_factor(double *A, int32_t n) {
    if (n > WIDE) {
        return factor_wide(A, n);
    }
    for (int32_t j = 0; j < n; j++) {
        double *row_j = A + j * n;
        double pivot = row_j[j];
        for (int32_t k = 0; k < j; k++) {
            pivot -= row_j[k] * row_j[k];
        }
        if (!(pivot > 0)) {
            return -1;
        }
        row_j[j] = 1 / sqrt(pivot);
        int32_t i = j + 1;
        for (; i + 4 <= n; i += 4) { /* four rows at a time: a sum has to wait for itself */
            double *rows = A + i * n,
                   sum[4] = {rows[j], rows[n + j], rows[2 * n + j], rows[3 * n + j]};
            for (int32_t k = 0; k < j; k++) {
                sum[0] -= rows[k] * row_j[k];
                sum[1] -= rows[n + k] * row_j[k];
                sum[2] -= rows[2 * n + k] * row_j[k];
                sum[3] -= rows[3 * n + k] * row_j[k];
            }
            for (int32_t r = 0; r < 4; r++) {
                rows[r * n + j] = sum[r] * row_j[j];
            }
        }
        for (; i < n; i++) {
            double *row_i = A + i * n;
            double sum = row_i[j];
            for (int32_t k = 0; k < j; k++) {
                sum -= row_i[k] * row_j[k];
            }
            row_i[j] = sum * row_j[j];
        }
    }
    return 0;
}

/* row -= factor * other, over one row of the right-hand sides */
static void subtract(double *restrict row, const double *restrict other, double factor, int32_t n) {
    for (int32_t c = 0; c < n; c++) {
        row[c] -= factor * other[c];
    }
}

static void scale(double *row, double factor, int32_t n) {
    for (int32_t c = 0; c < n; c++) {
        row[c] *= factor;
    }
}

/* 4 `wide` columns of B, whose sums stay in registers; `wide` is a constant once inlined. */
__attribute__((always_inline)) static inline void solve_strip(int32_t wide, const double *L,
                                                              int32_t n, double *B, int32_t ld) {
    for (int32_t i = 0; i < n; i++) {
        lanes sum[8];
        for (int32_t c = 0; c < wide; c++) {
            sum[c] = *(lanes *)(B + i * ld + 4 * c);
        }
        for (int32_t k = 0; k < i; k++) {
            for (int32_t c = 0; c < wide; c++) {
                sum[c] -= L[i * n + k] * *(lanes *)(B + k * ld + 4 * c);
            }
        }
        for (int32_t c = 0; c < wide; c++) {
            *(lanes *)(B + i * ld + 4 * c) = L[i * n + i] * sum[c];
        }
    }
    for (int32_t i = n - 1; i >= 0; i--) {
        lanes sum[8];
        for (int32_t c = 0; c < wide; c++) {
            sum[c] = *(lanes *)(B + i * ld + 4 * c);
        }
        for (int32_t k = i + 1; k < n; k++) {
            for (int32_t c = 0; c < wide; c++) {
                sum[c] -= L[k * n + i] * *(lanes *)(B + k * ld + 4 * c);
            }
        }
        for (int32_t c = 0; c < wide; c++) {
            *(lanes *)(B + i * ld + 4 * c) = L[i * n + i] * sum[c];
        }
    }
}

static void solve_column(const double *L, int32_t n, double *B, int32_t ld) {
    for (int32_t i = 0; i < n; i++) {
        double sum = B[i * ld];
        for (int32_t k = 0; k < i; k++) {
            sum -= L[i * n + k] * B[k * ld];
        }
        B[i * ld] = sum * L[i * n + i];
    }
    for (int32_t i = n - 1; i >= 0; i--) {
        double sum = B[i * ld];
        for (int32_t k = i + 1; k < n; k++) {
            sum -= L[k * n + i] * B[k * ld];
        }
        B[i * ld] = sum * L[i * n + i];
    }
}

CLONES static void solve_columns(const double *L, int32_t n, double *B, int32_t n_columns) {
    int32_t c = 0;
    for (; c + 32 <= n_columns; c += 32) {
        solve_strip(8, L, n, B + c, n_columns);
    }
    for (; c + 16 <= n_columns; c += 16) {
        solve_strip(4, L, n, B + c, n_columns);
    }
    for (; c + 4 <= n_columns; c += 4) {
        solve_strip(1, L, n, B + c, n_columns);
    }
    for (; c < n_columns; c++) {
        solve_column(L, n, B + c, n_columns);
    }
}

void mhi_cholesky_solve(const double *L, int32_t n, double *B, int32_t n_columns) {
    solve_columns(L, n, B, n_columns);
}

#define REPEATED 1e-11

/* Row i of L stands in row i of A, in the columns of `order`'s places: entry (i, k) belongs to the
 * k-th chosen row. */
int mhi_semidefinite_factor(double *A, int32_t n, int32_t *order) {
    double largest = 0;
    int32_t rank = 0;
    for (int32_t i = 0; i < n; i++) {
        order[i] = i;
        largest = fmax(largest, A[i * n + i]);
        if (!isfinite(A[i * n + i])) {
            return -1;
        }
    }
    for (; rank < n; rank++) {
        int32_t best = rank; /* the remaining diagonal stands up to date in A */
        for (int32_t k = rank + 1; k < n; k++) {
            best = A[order[k] * n + order[k]] > A[order[best] * n + order[best]] ? k : best;
        }
        const int32_t chosen = order[best];
        const double pivot = A[chosen * n + chosen];
        if (!(pivot > REPEATED * largest)) {
            break;
        }
        order[best] = order[rank];
        order[rank] = chosen;
        A[chosen * n + chosen] = 1 / sqrt(pivot);
        for (int32_t k = rank + 1; k < n; k++) {
            A[order[k] * n + chosen] *= A[chosen * n + chosen];
        }
        for (int32_t k = rank + 1; k < n; k++) {
            for (int32_t j = rank + 1; j < n; j++) {
                A[order[k] * n + order[j]] -= A[order[k] * n + chosen] * A[order[j] * n + chosen];
            }
        }
    }
    return rank;
}

void mhi_semidefinite_solve(const double *L, int32_t n, const int32_t *order, int32_t rank,
                            double *B, int32_t n_columns) {
    for (int32_t i = 0; i < rank; i++) {
        double *row = B + order[i] * n_columns;
        for (int32_t k = 0; k < i; k++) {
            subtract(row, B + order[k] * n_columns, L[order[i] * n + order[k]], n_columns);
        }
        scale(row, L[order[i] * n + order[i]], n_columns);
    }
    for (int32_t i = rank - 1; i >= 0; i--) {
        double *row = B + order[i] * n_columns;
        for (int32_t k = i + 1; k < rank; k++) {
            subtract(row, B + order[k] * n_columns, L[order[k] * n + order[i]], n_columns);
        }
        scale(row, L[order[i] * n + order[i]], n_columns);
    }
    for (int32_t i = rank; i < n; i++) {
        scale(B + order[i] * n_columns, 0, n_columns);
    }
}
