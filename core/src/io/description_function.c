/* SPDX-License-Identifier: Apache-2.0 */
/* description_function.c: scalar functions as rows of polynomial pieces, and rigid transforms. */
#include "io/description_builder.h"

#include <math.h>
#include <string.h>

/* Room for n pieces of n_coef coefficients; n_pieces 0 when memory is out (the builder then has
 * failed). */
static mhe_function pieces(mhi_builder *b, int32_t n, int32_t n_coef, double **origin,
                           double **coef) {
    mhe_function f = {0};
    *origin = MHI_TAKE(&b->arena, double, n);
    *coef = MHI_TAKE(&b->arena, double, n *n_coef);
    if (*origin == NULL || *coef == NULL) {
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
        return f;
    }
    f.origin = *origin;
    f.coef = *coef;
    f.n_pieces = n;
    f.n_coef = n_coef;
    return f;
}

mhe_function mhi_function_polynomial(mhi_builder *b, const double *coef, int32_t n) {
    double *origin, *c;
    mhe_function f = pieces(b, 1, n, &origin, &c);
    if (f.n_pieces > 0) {
        memcpy(c, coef, sizeof *coef * (size_t)n);
    }
    return f;
}

mhe_function mhi_function_constant(mhi_builder *b, double value) {
    return mhi_function_polynomial(b, &value, 1);
}

mhe_function mhi_function_identity(mhi_builder *b) {
    return mhi_function_polynomial(b, (const double[2]){0, 1}, 2);
}

mhe_function mhi_function_scaled(mhi_builder *b, double scale, mhe_function function) {
    double *origin, *coef;
    mhe_function f = pieces(b, function.n_pieces, function.n_coef, &origin, &coef);
    for (int32_t i = 0; i < f.n_pieces; i++) {
        origin[i] = function.origin[i];
    }
    for (int32_t i = 0; i < f.n_pieces * f.n_coef; i++) {
        coef[i] = scale * function.coef[i];
    }
    return f;
}

void mhi_function_derivatives(const mhe_function *function, double t, double out[3]) {
    int32_t i = 0;
    while (i + 1 < function->n_pieces && t >= function->origin[i + 1]) {
        i++;
    }
    const double *c = &function->coef[i * function->n_coef];
    double s = t - function->origin[i], value = 0, first = 0, half = 0;
    for (int32_t k = function->n_coef - 1; k >= 0; k--) {
        half = half * s + first;
        first = first * s + value;
        value = value * s + c[k];
    }
    out[0] = value;
    out[1] = first;
    out[2] = 2 * half;
}

double mhi_function_value(const mhe_function *function, double t) {
    double out[3];
    mhi_function_derivatives(function, t, out);
    return out[0];
}

int32_t mhi_function_is_constant(const mhe_function *function) {
    for (int32_t i = 0; i < function->n_pieces * function->n_coef; i++) {
        double same = i % function->n_coef == 0 ? function->coef[0] : 0;
        if (function->coef[i] != same) {
            return 0;
        }
    }
    return 1;
}

/* Slope of segment i. */
static double chord(const double *x, const double *y, int32_t i) {
    return (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
}

mhe_function mhi_function_broken_line(mhi_builder *b, const double *x, const double *y, int32_t n) {
    double *origin, *coef;
    mhe_function f = pieces(b, n - 1, 2, &origin, &coef);
    for (int32_t i = 0; i < f.n_pieces; i++) {
        origin[i] = x[i];
        coef[2 * i] = y[i];
        coef[2 * i + 1] = chord(x, y, i);
    }
    return f;
}

mhe_function mhi_function_step(mhi_builder *b, double t0, double t1, double y0, double y1) {
    static const double quintic[] = {10, -15, 6};
    double *origin, *coef, h = t1 - t0;
    mhe_function f = pieces(b, 3, 6, &origin, &coef);
    if (f.n_pieces > 0) {
        origin[0] = origin[1] = t0;
        origin[2] = t1;
        coef[0] = coef[6] = y0;
        coef[12] = y1;
        for (int k = 0; k < 3; k++) {
            coef[6 + 3 + k] = (y1 - y0) * quintic[k] / pow(h, 3 + k);
        }
    }
    return f;
}

/* Third derivative over 6 of the cubic through points i .. i + 3. */
static double third_difference(const double *x, const double *y, int32_t i) {
    double left = (chord(x, y, i + 1) - chord(x, y, i)) / (x[i + 2] - x[i]);
    double right = (chord(x, y, i + 2) - chord(x, y, i + 1)) / (x[i + 3] - x[i + 1]);
    return (right - left) / (x[i + 3] - x[i]);
}

/* Curvatures sigma_i = f''(x_i) / 6 from continuity of the slope inside and given third derivatives
 * at the ends; a tridiagonal system, solved in place (`diagonal` [n] is scratch). */
static void spline_curvatures(const double *x, const double *y, int32_t n, double *diagonal,
                              double *sigma) {
    double first = n > 3 ? third_difference(x, y, 0) : 0.0;
    double last = n > 3 ? third_difference(x, y, n - 4) : 0.0;
    double h0 = x[1] - x[0], hn = x[n - 1] - x[n - 2];
    diagonal[0] = -h0;
    sigma[0] = first * h0 * h0;
    diagonal[n - 1] = -hn;
    sigma[n - 1] = -last * hn * hn;
    for (int32_t i = 1; i < n - 1; i++) {
        diagonal[i] = 2 * (x[i + 1] - x[i - 1]);
        sigma[i] = chord(x, y, i) - chord(x, y, i - 1);
    }
    for (int32_t i = 1; i < n; i++) {
        double h = x[i] - x[i - 1], factor = h / diagonal[i - 1];
        diagonal[i] -= factor * h;
        sigma[i] -= factor * sigma[i - 1];
    }
    sigma[n - 1] /= diagonal[n - 1];
    for (int32_t i = n - 2; i >= 0; i--) {
        sigma[i] = (sigma[i] - (x[i + 1] - x[i]) * sigma[i + 1]) / diagonal[i];
    }
}

mhe_function mhi_function_spline(mhi_builder *b, const double *x, const double *y, int32_t n) {
    if (n == 2) {
        return mhi_function_broken_line(b, x, y, n);
    }
    double *origin, *coef;
    double *diagonal = MHI_TAKE(&b->arena, double, n), *sigma = MHI_TAKE(&b->arena, double, n);
    mhe_function f = pieces(b, n + 1, 4, &origin, &coef);
    if (diagonal == NULL || sigma == NULL || f.n_pieces == 0) {
        b->status = mhe_fail(b->err, MHE_E_MEMORY, "out of memory");
        return (mhe_function){0};
    }
    spline_curvatures(x, y, n, diagonal, sigma);
    for (int32_t i = 0; i < n - 1; i++) {
        double h = x[i + 1] - x[i];
        double *c = &coef[(size_t)(i + 1) * 4];
        origin[i + 1] = x[i];
        c[0] = y[i];
        c[1] = chord(x, y, i) - h * (sigma[i + 1] + 2 * sigma[i]);
        c[2] = 3 * sigma[i];
        c[3] = (sigma[i + 1] - sigma[i]) / h;
    }
    double h = x[n - 1] - x[n - 2];
    origin[0] = x[0];
    coef[0] = y[0];
    coef[1] = coef[5];
    origin[n] = x[n - 1];
    coef[4 * n] = y[n - 1];
    coef[4 * n + 1] = chord(x, y, n - 2) + h * (sigma[n - 2] + 2 * sigma[n - 1]);
    return f;
}

mhi_transform mhi_transform_identity(void) {
    return (mhi_transform){.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
}

void mhi_transform_point(const mhi_transform *a, const double point[3], double out[3]) {
    double result[3];
    for (int i = 0; i < 3; i++) {
        const double *row = &a->r[3 * i];
        result[i] = a->p[i] + row[0] * point[0] + row[1] * point[1] + row[2] * point[2];
    }
    memcpy(out, result, sizeof result);
}

static void matrix_times(const double a[9], const double b[9], double out[9]) {
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
        }
    }
}

mhi_transform mhi_transform_times(const mhi_transform *a, const mhi_transform *b) {
    mhi_transform out;
    matrix_times(a->r, b->r, out.r);
    mhi_transform_point(a, b->p, out.p);
    return out;
}

mhi_transform mhi_transform_inverse(const mhi_transform *a) {
    mhi_transform out = {0};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            out.r[3 * i + j] = a->r[3 * j + i];
            out.p[i] -= a->r[3 * j + i] * a->p[j];
        }
    }
    return out;
}

void mhi_rotation_sequence(const char *sequence, const double angles[3], double r[9]) {
    double product[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    for (int k = 0; k < 3; k++) {
        int axis = sequence[k] - 'x', next = (axis + 1) % 3, last = (axis + 2) % 3;
        double turn[9] = {0}, before[9];
        turn[4 * axis] = 1;
        turn[4 * next] = turn[4 * last] = cos(angles[k]);
        turn[3 * next + last] = -sin(angles[k]);
        turn[3 * last + next] = sin(angles[k]);
        memcpy(before, product, sizeof before);
        matrix_times(before, turn, product);
    }
    memcpy(r, product, sizeof product);
}
