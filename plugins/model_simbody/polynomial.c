/* SPDX-License-Identifier: Apache-2.0 */
/* polynomial.c: lengths that are polynomials of coordinates. */
#include "route.h"

#include <math.h>
#include <string.h>

/* Row e: x^e, or the Chebyshev polynomial T_e(x), with two derivatives. */
static void factors_of(int chebyshev, double x, int32_t degree, double *row) {
    const double first[6] = {1, 0, 0, x, 1, 0};
    memcpy(row, first, sizeof first);
    for (int32_t e = 2; e <= degree; e++) {
        const double *a = row + 3 * (e - 1), *b = row + 3 * (e - 2);
        double *f = row + 3 * e;
        if (chebyshev) { /* T_e = 2 x T_e-1 - T_e-2 */
            f[0] = 2 * x * a[0] - b[0];
            f[1] = 2 * (a[0] + x * a[1]) - b[1];
            f[2] = 2 * (2 * a[1] + x * a[2]) - b[2];
        } else {
            f[0] = x * a[0];
            f[1] = a[0] + x * a[1];
            f[2] = 2 * a[1] + x * a[2];
        }
    }
}

/* Value, gradient and hessian by x; row k of `powers`: of factor k. */
static double polynomial_by_x(const mhe_polynomial *p, const double *const *powers, double *g,
                              double *h) {
    int32_t n = p->n;
    double length = 0;
    for (int32_t term = 0; term < p->n_terms; term++) {
        const uint8_t *exponent = p->exponent + (size_t)term * (size_t)n;
        int32_t used = 0, at[POLYNOMIAL_FACTORS];
        const double *f[POLYNOMIAL_FACTORS];
        double value = p->coef[term];
        for (int32_t k = 0; k < n; k++) {
            if (exponent[k] > 0) {
                at[used] = k;
                f[used] = powers[k] + 3 * exponent[k];
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

/* The same for one to three coordinates, by sums within sums: terms that share their first
 * exponents and stand together share those factors. A fit's terms are in that order (fit.c); any
 * other gives the same, with more multiplications. */

static double line_by_x(const mhe_polynomial *p, const double *row, double *g, double *h) {
    double s = 0, s_x = 0, s_xx = 0;
    for (int32_t term = 0; term < p->n_terms; term++) {
        const double c = p->coef[term], *f = row + 3 * p->exponent[term];
        s += c * f[0];
        s_x += c * f[1];
        s_xx += c * f[2];
    }
    g[0] = s_x;
    h[0] = s_xx;
    return s;
}

static double plane_by_x(const mhe_polynomial *p, const double *const *powers, double *g,
                         double *h) {
    const uint8_t *e = p->exponent, *end = e + 2 * (ptrdiff_t)p->n_terms;
    const double *c = p->coef;
    double s = 0, s_x = 0, s_y = 0, s_xx = 0, s_yx = 0, s_yy = 0;
    while (e < end) {
        const uint8_t first = e[0];
        double r = 0, r_y = 0, r_yy = 0;
        for (; e < end && e[0] == first; e += 2, c++) {
            const double *f = powers[1] + 3 * e[1];
            r += *c * f[0];
            r_y += *c * f[1];
            r_yy += *c * f[2];
        }
        const double *f = powers[0] + 3 * first;
        s += f[0] * r;
        s_x += f[1] * r;
        s_xx += f[2] * r;
        s_y += f[0] * r_y;
        s_yx += f[1] * r_y;
        s_yy += f[0] * r_yy;
    }
    g[0] = s_x, g[1] = s_y;
    h[0] = s_xx, h[2] = s_yx, h[3] = s_yy;
    return s;
}

static double space_by_x(const mhe_polynomial *p, const double *const *powers, double *g,
                         double *h) {
    const uint8_t *e = p->exponent, *end = e + 3 * (ptrdiff_t)p->n_terms;
    const double *c = p->coef;
    double s = 0;
    while (e < end) {
        const uint8_t first = e[0];
        double a = 0, a_y = 0, a_z = 0, a_yy = 0, a_yz = 0, a_zz = 0;
        while (e < end && e[0] == first) {
            const uint8_t second = e[1];
            double r = 0, r_z = 0, r_zz = 0;
            for (; e < end && e[0] == first && e[1] == second; e += 3, c++) {
                const double *f = powers[2] + 3 * e[2];
                r += *c * f[0];
                r_z += *c * f[1];
                r_zz += *c * f[2];
            }
            const double *f = powers[1] + 3 * second;
            a += f[0] * r;
            a_y += f[1] * r;
            a_yy += f[2] * r;
            a_z += f[0] * r_z;
            a_yz += f[1] * r_z;
            a_zz += f[0] * r_zz;
        }
        const double *f = powers[0] + 3 * first;
        s += f[0] * a;
        g[0] += f[1] * a;
        g[1] += f[0] * a_y;
        g[2] += f[0] * a_z;
        h[0] += f[2] * a;
        h[3] += f[1] * a_y;
        h[4] += f[0] * a_yy;
        h[6] += f[1] * a_z;
        h[7] += f[0] * a_yz;
        h[8] += f[0] * a_zz;
    }
    return s;
}

/* g and h are 0 before. */
static double derivatives_by_x(const mhe_polynomial *p, const double *const *powers, double *g,
                               double *h) {
    return p->n == 1   ? line_by_x(p, powers[0], g, h)
           : p->n == 2 ? plane_by_x(p, powers, g, h)
           : p->n == 3 ? space_by_x(p, powers, g, h)
                       : polynomial_by_x(p, powers, g, h);
}

int polynomial_is_left(const path_route *route, const double *numbers) {
    const mhe_polynomial *p = route->length;
    for (int32_t k = 0; k < p->n; k++) {
        if (!(fabs(numbers[4 * p->coordinate[k]] - p->centre[k]) <= p->scale[k])) {
            return 1;
        }
    }
    return 0;
}

/* Chebyshev's of a coordinate: fitted paths have them in common, as they have its range. */
static const double *factors_shared(const path_route *route, int32_t k, double value,
                                    route_work *work) {
    const mhe_polynomial *p = route->length;
    shared_factors *shared = &work->shared[p->coordinate[k]];
    if (shared->degree < route->degree || shared->centre != p->centre[k] ||
        shared->scale != p->scale[k]) {
        factors_of(1, (value - p->centre[k]) / p->scale[k], route->degree, shared->row);
        shared->degree = route->degree;
        shared->centre = p->centre[k];
        shared->scale = p->scale[k];
    }
    return shared->row;
}

double polynomial_length(const path_route *route, const double *numbers, route_work *work,
                         double *gradient, double *hessian) {
    const mhe_polynomial *p = route->length;
    int32_t n = p->n, rows = route->n_own;
    double *own = work->polynomial, *g = own + 3 * (size_t)n * POLYNOMIAL_POWERS, *h = g + n;
    const double **powers = work->factors;
    for (int32_t k = 0; k < n; k++, own += 3 * POLYNOMIAL_POWERS) {
        double value = numbers[4 * p->coordinate[k]];
        if (route->exact != NULL) {
            powers[k] = factors_shared(route, k, value, work);
        } else {
            factors_of(0, (value - p->centre[k]) / p->scale[k], route->degree, own);
            powers[k] = own;
        }
    }
    if (gradient == NULL) {
        return polynomial_by_x(p, powers, NULL, NULL);
    }
    memset(g, 0, sizeof *g * (size_t)(n + n * n));
    double length = derivatives_by_x(p, powers, g, h);
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
