/* SPDX-License-Identifier: Apache-2.0 */
/* numbers.c: functions of coordinates. */
#include "numbers.h"

#include <string.h>

int32_t number_root(const mhe_description *d, int32_t number) {
    while (number >= d->n_coordinates) {
        number = d->dependents[number - d->n_coordinates].independent;
    }
    return number;
}

void numbers_evaluate(const mhe_description *d, const double *q, double *values) {
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        const double own[4] = {q[i], 1, 0, 0};
        memcpy(values + 4 * i, own, sizeof own);
    }
    for (int32_t i = 0; i < d->n_dependents; i++) {
        const mhe_dependent *dependent = &d->dependents[i];
        function_compose(&dependent->function, values + 4 * dependent->independent,
                         values + 4 * (d->n_coordinates + i));
    }
}

void function_evaluate(const mhe_function *function, double t, double *out) {
    int32_t piece = 0;
    for (int32_t above = function->n_pieces; above - piece > 1;) {
        int32_t middle = (piece + above) / 2;
        if (t >= function->origin[middle]) {
            piece = middle;
        } else {
            above = middle;
        }
    }
    const double *c = function->coef + piece * function->n_coef;
    double s = t - function->origin[piece];
    double value = 0, slope = 0, half = 0, sixth = 0; /* f, f', f'' / 2, f''' / 6 by Horner */
    for (int32_t k = function->n_coef - 1; k >= 0; k--) {
        sixth = sixth * s + half;
        half = half * s + slope;
        slope = slope * s + value;
        value = value * s + c[k];
    }
    out[0] = value;
    out[1] = slope;
    out[2] = 2 * half;
    out[3] = 6 * sixth;
}

void function_compose(const mhe_function *function, const double *x, double *out) {
    double f[4];
    function_evaluate(function, x[0], f);
    out[0] = f[0];
    out[1] = f[1] * x[1];
    out[2] = f[2] * x[1] * x[1] + f[1] * x[2];
    out[3] = f[3] * x[1] * x[1] * x[1] + 3 * f[2] * x[1] * x[2] + f[1] * x[3];
}
