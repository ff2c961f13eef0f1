/* SPDX-License-Identifier: Apache-2.0 */
/* lu.c: LU factors with partial pivoting, for the 8 to 24 unknowns of a step: at this size a call
 * into LAPACK costs as much as the arithmetic. */
#include "rk.h"

#include "../clones.h"

#include <math.h>

CLONES static int rk_factor_rows(double *a, int32_t n, int32_t *pivots) {
    for (int32_t k = 0; k < n; k++) {
        double *row_k = a + k * n;
        int32_t p = k;
        for (int32_t i = k + 1; i < n; i++) {
            if (fabs(a[i * n + k]) > fabs(a[p * n + k])) {
                p = i;
            }
        }
        pivots[k] = p;
        for (int32_t j = 0; p != k && j < n; j++) {
            double swap = row_k[j];
            row_k[j] = a[p * n + j];
            a[p * n + j] = swap;
        }
        if (row_k[k] == 0) {
            return 0;
        }
        row_k[k] = 1 / row_k[k];
        for (int32_t i = k + 1; i < n; i++) {
            double *row_i = a + i * n, factor = row_i[k] * row_k[k];
            row_i[k] = factor;
            for (int32_t j = k + 1; j < n; j++) {
                row_i[j] -= factor * row_k[j];
            }
        }
    }
    return 1;
}

void rk_lu_solve(const double *lu, int32_t n, const int32_t *pivots, double *x) {
    for (int32_t k = 0; k < n; k++) {
        double swap = x[pivots[k]];
        x[pivots[k]] = x[k];
        x[k] = swap;
    }
    for (int32_t i = 1; i < n; i++) {
        double sum = x[i];
        for (int32_t j = 0; j < i; j++) {
            sum -= lu[i * n + j] * x[j];
        }
        x[i] = sum;
    }
    for (int32_t i = n - 1; i >= 0; i--) {
        double sum = x[i];
        for (int32_t j = i + 1; j < n; j++) {
            sum -= lu[i * n + j] * x[j];
        }
        x[i] = sum * lu[i * n + i];
    }
}

/* to [m] -= factor * from [m] */
static inline void rk_subtract(double *restrict to, double factor, const double *restrict from,
                               int32_t m) {
    for (int32_t i = 0; i < m; i++) {
        to[i] -= factor * from[i];
    }
}

CLONES static void rk_solve_rows(const double *lu, int32_t n, const int32_t *pivots, double *x,
                                 int32_t m) {
    for (int32_t k = 0; k < n; k++) { /* U' y = x */
        double *row = x + k * m;
        for (int32_t i = 0; i < m; i++) {
            row[i] *= lu[k * n + k];
        }
        for (int32_t j = k + 1; j < n; j++) {
            rk_subtract(x + j * m, lu[k * n + j], row, m);
        }
    }
    for (int32_t k = n - 1; k > 0; k--) { /* L' z = y */
        for (int32_t j = 0; j < k; j++) {
            rk_subtract(x + j * m, lu[k * n + j], x + k * m, m);
        }
    }
    for (int32_t k = n - 1; k >= 0; k--) {
        for (int32_t i = 0; pivots[k] != k && i < m; i++) {
            double swap = x[k * m + i];
            x[k * m + i] = x[pivots[k] * m + i];
            x[pivots[k] * m + i] = swap;
        }
    }
}

CLONES static void rk_solve_columns(const double *lu, int32_t n, const int32_t *pivots, double *x,
                                    int32_t m) {
    for (int32_t k = 0; k < n; k++) {
        for (int32_t i = 0; pivots[k] != k && i < m; i++) {
            double swap = x[k * m + i];
            x[k * m + i] = x[pivots[k] * m + i];
            x[pivots[k] * m + i] = swap;
        }
    }
    for (int32_t k = 1; k < n; k++) {
        for (int32_t j = 0; j < k; j++) {
            rk_subtract(x + k * m, lu[k * n + j], x + j * m, m);
        }
    }
    for (int32_t k = n - 1; k >= 0; k--) {
        for (int32_t j = k + 1; j < n; j++) {
            rk_subtract(x + k * m, lu[k * n + j], x + j * m, m);
        }
        for (int32_t i = 0; i < m; i++) {
            x[k * m + i] *= lu[k * n + k];
        }
    }
}

int rk_lu_factor(double *a, int32_t n, int32_t *pivots) {
    return rk_factor_rows(a, n, pivots);
}

void rk_lu_solve_columns(const double *lu, int32_t n, const int32_t *pivots, double *x, int32_t m) {
    rk_solve_columns(lu, n, pivots, x, m);
}

void rk_lu_solve_transposed(const double *lu, int32_t n, const int32_t *pivots, double *x,
                            int32_t m) {
    rk_solve_rows(lu, n, pivots, x, m);
}
