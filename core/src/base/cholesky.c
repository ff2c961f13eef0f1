/* SPDX-License-Identifier: Apache-2.0 */
#include "base/cholesky.h"

#include <math.h>

int mhi_cholesky_factor(double *A, int32_t n) {
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
        for (int32_t i = j + 1; i < n; i++) {
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

void mhi_cholesky_solve(const double *L, int32_t n, double *B, int32_t n_columns) {
    for (int32_t i = 0; i < n; i++) {
        for (int32_t k = 0; k < i; k++) {
            subtract(B + i * n_columns, B + k * n_columns, L[i * n + k], n_columns);
        }
        scale(B + i * n_columns, L[i * n + i], n_columns);
    }
    for (int32_t i = n - 1; i >= 0; i--) {
        for (int32_t k = i + 1; k < n; k++) {
            subtract(B + i * n_columns, B + k * n_columns, L[k * n + i], n_columns);
        }
        scale(B + i * n_columns, L[i * n + i], n_columns);
    }
}
