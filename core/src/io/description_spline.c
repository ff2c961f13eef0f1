/* SPDX-License-Identifier: Apache-2.0 */
/* description_spline.c: natural splines of any odd degree.
 *
 * Of all functions through the points, the natural spline of degree 2m - 1 has the least integral
 * of its m-th derivative squared. On each interval it is the polynomial given by value and m - 1
 * derivatives at both ends, so what is unknown are those derivatives: a positive definite banded
 * system, solved by Cholesky's method. Derivatives are taken in units of the mean interval, which
 * keeps the numbers alike. */
#include "io/description_builder.h"

#include <math.h>
#include <string.h>

#define MAX_M 4
#define MAX_P (2 * MAX_M)

/* Solves the n x n system a x = r for n_r right sides in place (rows of r), by elimination with row
 * exchanges; a is small and regular. */
static void solve_small(int n, double a[MAX_P][MAX_P], double r[MAX_P][MAX_P]) {
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++) {
            pivot = fabs(a[i][k]) > fabs(a[pivot][k]) ? i : pivot;
        }
        for (int j = 0; j < n; j++) {
            double swap = a[k][j];
            a[k][j] = a[pivot][j];
            a[pivot][j] = swap;
            swap = r[k][j];
            r[k][j] = r[pivot][j];
            r[pivot][j] = swap;
        }
        for (int i = 0; i < n; i++) {
            double factor = i == k ? 0 : a[i][k] / a[k][k];
            for (int j = 0; j < n; j++) {
                a[i][j] -= factor * a[k][j];
                r[i][j] -= factor * r[k][j];
            }
        }
    }
    for (int k = 0; k < n; k++) {
        for (int j = 0; j < n; j++) {
            r[k][j] /= a[k][k];
        }
    }
}

/* i (i - 1) .. (i - k + 1) */
static double falling(int i, int k) {
    double product = 1;
    for (int j = 0; j < k; j++) {
        product *= i - j;
    }
    return product;
}

/* hermite [2m][2m]: powers of s in [0, 1] of the polynomial with end derivatives 0 .. m - 1 at 0,
 * then at 1; energy [2m][2m]: the integral of the m-th derivatives' products for those. */
typedef struct element {
    int m;
    double hermite[MAX_P][MAX_P], energy[MAX_P][MAX_P];
} element;

static void make_element(int m, element *e) {
    double conditions[MAX_P][MAX_P] = {{0}}, gram[MAX_P][MAX_P] = {{0}};
    memset(e, 0, sizeof *e);
    e->m = m;
    for (int k = 0; k < m; k++) {
        conditions[k][k] = falling(k, k);
        for (int i = k; i < 2 * m; i++) {
            conditions[m + k][i] = falling(i, k);
        }
    }
    for (int i = 0; i < 2 * m; i++) {
        e->hermite[i][i] = 1;
    }
    solve_small(2 * m, conditions, e->hermite);
    for (int i = m; i < 2 * m; i++) {
        for (int j = m; j < 2 * m; j++) {
            gram[i][j] = falling(i, m) * falling(j, m) / (i + j - 2 * m + 1);
        }
    }
    for (int a = 0; a < 2 * m; a++) {
        for (int b = 0; b < 2 * m; b++) {
            for (int i = m; i < 2 * m; i++) {
                for (int j = m; j < 2 * m; j++) {
                    e->energy[a][b] += e->hermite[i][a] * gram[i][j] * e->hermite[j][b];
                }
            }
        }
    }
}

/* Scale of end derivative a (0 .. 2m - 1) on an interval of `ratio` mean lengths. */
static double scale_of(const element *e, int a, double ratio) {
    return pow(ratio, a % e->m);
}

/* Rows of the lower band: entry (i, j) at band[i * width + width - 1 - (i - j)]. Adds interval k
 * between points k and k + 1; unknowns of point k are (m - 1) k .. */
static void add_interval(const element *e, const double *y, int32_t k, double ratio, double *band,
                         double *right) {
    int m = e->m, u = m - 1, width = 2 * u;
    double weight = pow(ratio, 1 - 2 * m);
    for (int a = 0; a < 2 * m; a++) {
        int row = (k + a / m) * u + a % m - 1;
        if (a % m == 0) {
            continue; /* a value: given */
        }
        double scale = weight * scale_of(e, a, ratio);
        right[row] -= scale * (e->energy[a][0] * y[k] + e->energy[a][m] * y[k + 1]);
        for (int b = 0; b < 2 * m; b++) {
            int column = (k + b / m) * u + b % m - 1;
            if (b % m != 0 && column <= row) {
                band[(size_t)row * (size_t)width + (size_t)(width - 1 - (row - column))] +=
                    scale * e->energy[a][b] * scale_of(e, b, ratio);
            }
        }
    }
}

static void solve_band(double *band, int n, int width, double *right) {
    for (int i = 0; i < n; i++) { /* band := Cholesky factor L */
        double *row = band + (size_t)i * (size_t)width;
        for (int j = i - width + 1 < 0 ? 0 : i - width + 1; j <= i; j++) {
            const double *other = band + (size_t)j * (size_t)width;
            double sum = row[width - 1 - (i - j)];
            for (int k = i - width + 1 < 0 ? 0 : i - width + 1; k < j; k++) {
                if (j - k < width) {
                    sum -= row[width - 1 - (i - k)] * other[width - 1 - (j - k)];
                }
            }
            row[width - 1 - (i - j)] = i == j ? sqrt(sum) : sum / other[width - 1];
        }
    }
    for (int i = 0; i < n; i++) {
        const double *row = band + (size_t)i * (size_t)width;
        for (int k = i - width + 1 < 0 ? 0 : i - width + 1; k < i; k++) {
            right[i] -= row[width - 1 - (i - k)] * right[k];
        }
        right[i] /= row[width - 1];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n && k - i < width; k++) {
            right[i] -= band[(size_t)k * (size_t)width + (size_t)(width - 1 - (k - i))] * right[k];
        }
        right[i] /= band[(size_t)i * (size_t)width + (size_t)(width - 1)];
    }
}

/* Powers of (t - x[k]) on the interval after point k, from the solved end derivatives. */
static void interval_powers(const element *e, const double *y, const double *unknown, int32_t k,
                            double h, double ratio, double *coef) {
    int m = e->m, u = m - 1;
    for (int i = 0; i < 2 * m; i++) {
        double sum = 0;
        for (int a = 0; a < 2 * m; a++) {
            int32_t at = k + a / m;
            double end = a % m == 0 ? y[at] : unknown[at * u + a % m - 1] * scale_of(e, a, ratio);
            sum += e->hermite[i][a] * end;
        }
        coef[i] = sum / pow(h, i);
    }
}

/* The polynomial of degree m - 1 with a point's derivatives. */
static void end_powers(const element *e, double value, const double *unknown, double mean,
                       double *coef) {
    coef[0] = value;
    for (int i = 1; i < e->m; i++) {
        coef[i] = unknown[i - 1] / pow(mean, i) / falling(i, i);
    }
}

mhe_function mhi_function_natural_spline(mhi_builder *b, const double *x, const double *y,
                                         int32_t n, int32_t half_order) {
    int m = half_order, u = m - 1, width = u > 0 ? 2 * u : 1, p = 2 * m;
    double *band = mhi_build_take(b, n * (u > 0 ? u : 1), sizeof *band * (size_t)width);
    double *unknown = mhi_build_take(b, n * u + 1, sizeof *unknown);
    double *origin = mhi_build_take(b, n + 1, sizeof *origin);
    double *coef = mhi_build_take(b, (n + 1) * p, sizeof *coef);
    if (band == NULL || unknown == NULL || origin == NULL || coef == NULL) {
        return (mhe_function){0};
    }
    element e;
    make_element(m, &e);
    double mean = (x[n - 1] - x[0]) / (n - 1);
    for (int32_t k = 0; k + 1 < n && u > 0; k++) {
        add_interval(&e, y, k, (x[k + 1] - x[k]) / mean, band, unknown);
    }
    solve_band(band, n * u, width, unknown);
    for (int32_t k = 0; k + 1 < n; k++) {
        double h = x[k + 1] - x[k];
        origin[k + 1] = x[k];
        interval_powers(&e, y, unknown, k, h, h / mean, coef + (ptrdiff_t)(k + 1) * p);
    }
    origin[0] = x[0];
    origin[n] = x[n - 1];
    end_powers(&e, y[0], unknown, mean, coef);
    end_powers(&e, y[n - 1], unknown + (ptrdiff_t)(n - 1) * u, mean, coef + (ptrdiff_t)n * p);
    return (mhe_function){.origin = origin, .coef = coef, .n_pieces = n + 1, .n_coef = p};
}
