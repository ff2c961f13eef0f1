/* SPDX-License-Identifier: Apache-2.0 */
/* polynomial.c: lengths that are polynomials of coordinates. */
#include "route.h"

#include <string.h>

/* x^e and its derivatives by x. */
static void power(const double *powers, int32_t e, double *out) {
    out[0] = powers[e];
    out[1] = e > 0 ? e * powers[e - 1] : 0;
    out[2] = e > 1 ? e * (e - 1) * powers[e - 2] : 0;
}

/* Value, gradient and hessian by x; `powers` as polynomial_length() lays them out. */
static double polynomial_by_x(const mhe_polynomial *p, const double *powers, double *g, double *h) {
    int32_t n = p->n;
    double length = 0;
    for (int32_t term = 0; term < p->n_terms; term++) {
        const uint8_t *exponent = p->exponent + (size_t)term * (size_t)n;
        int32_t used = 0, at[POLYNOMIAL_FACTORS];
        double f[POLYNOMIAL_FACTORS][3], value = p->coef[term];
        for (int32_t k = 0; k < n; k++) {
            if (exponent[k] > 0) {
                at[used] = k;
                power(powers + (size_t)k * POLYNOMIAL_POWERS, exponent[k], f[used]);
                value *= f[used++][0];
            }
        }
        length += value;
        for (int32_t i = 0; i < used && g != NULL; i++) {
            double others = p->coef[term];
            for (int32_t k = 0; k < used; k++) {
                others *= k == i ? 1 : f[k][0];
            }
            g[at[i]] += others * f[i][1];
            h[at[i] * n + at[i]] += others * f[i][2];
            for (int32_t j = 0; j < i; j++) { /* the lower triangle */
                double rest = p->coef[term] * f[i][1] * f[j][1];
                for (int32_t k = 0; k < used; k++) {
                    rest *= k == i || k == j ? 1 : f[k][0];
                }
                h[at[i] * n + at[j]] += rest;
            }
        }
    }
    return length;
}

double polynomial_length(const path_route *route, const double *numbers, double *scratch,
                         double *gradient, double *hessian) {
    const mhe_polynomial *p = route->length;
    int32_t n = p->n, rows = route->n_own;
    double *powers = scratch, *g = powers + (size_t)n * POLYNOMIAL_POWERS, *h = g + n;
    for (int32_t k = 0; k < n; k++) {
        double x = (numbers[4 * p->coordinate[k]] - p->centre[k]) / p->scale[k];
        double *row = powers + (size_t)k * POLYNOMIAL_POWERS;
        row[0] = 1;
        for (int32_t e = 1; e <= route->degree; e++) {
            row[e] = row[e - 1] * x;
        }
    }
    if (gradient == NULL) {
        return polynomial_by_x(p, powers, NULL, NULL);
    }
    memset(g, 0, sizeof *g * (size_t)(n + n * n));
    double length = polynomial_by_x(p, powers, g, h);
    memset(gradient, 0, sizeof *gradient * (size_t)rows);
    memset(hessian, 0, sizeof *hessian * (size_t)(rows * rows));
    for (int32_t k = 0; k < n; k++) {
        const double *x = numbers + 4 * p->coordinate[k];
        int32_t row = route->length_local[k];
        double slope = x[1] / p->scale[k];
        gradient[row] += g[k] * slope;
        hessian[row * rows + row] += g[k] * x[2] / p->scale[k] + h[k * n + k] * slope * slope;
        for (int32_t j = 0; j < k; j++) {
            const double *other = numbers + 4 * p->coordinate[j];
            int32_t column = route->length_local[j];
            double entry = h[k * n + j] * slope * other[1] / p->scale[j];
            hessian[row * rows + column] += entry;
            hessian[column * rows + row] += entry;
        }
    }
    return length;
}
