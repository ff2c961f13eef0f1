/* SPDX-License-Identifier: Apache-2.0 */
/* jet.c: arithmetic on values with two derivatives. */
#include "jet.h"

#include <math.h>

void jet_apply(const jet *x, double value, double first, double second, jet *out) {
    jet made = {.value = value};
    for (int i = 0; i < JET_N; i++) {
        made.slope[i] = first * x->slope[i];
        for (int j = 0; j < JET_N; j++) {
            made.curve[i][j] = first * x->curve[i][j] + second * x->slope[i] * x->slope[j];
        }
    }
    *out = made;
}

void jet_add(const jet *a, double scale, const jet *b, jet *out) {
    out->value = a->value + scale * b->value;
    for (int i = 0; i < JET_N; i++) {
        out->slope[i] = a->slope[i] + scale * b->slope[i];
        for (int j = 0; j < JET_N; j++) {
            out->curve[i][j] = a->curve[i][j] + scale * b->curve[i][j];
        }
    }
}

void jet_multiply(const jet *a, const jet *b, jet *out) {
    jet made = {.value = a->value * b->value};
    for (int i = 0; i < JET_N; i++) {
        made.slope[i] = a->value * b->slope[i] + b->value * a->slope[i];
        for (int j = 0; j < JET_N; j++) {
            made.curve[i][j] = a->value * b->curve[i][j] + b->value * a->curve[i][j] +
                               a->slope[i] * b->slope[j] + b->slope[i] * a->slope[j];
        }
    }
    *out = made;
}

void jet_divide(const jet *a, const jet *b, jet *out) {
    double inverse = 1 / b->value;
    jet by;
    jet_apply(b, inverse, -inverse * inverse, 2 * inverse * inverse * inverse, &by);
    jet_multiply(a, &by, out);
}

void jet_root(const jet *a, jet *out) {
    double root = sqrt(a->value);
    jet_apply(a, root, 0.5 / root, -0.25 / (root * a->value), out);
}

void jet_rise(const jet *x, jet *out) {
    double v = fmax(0, fmin(1, x->value));
    jet_apply(x, v * v * v * (10 + v * (6 * v - 15)), 30 * v * v * (1 - v) * (1 - v),
              60 * v * (1 - v) * (1 - 2 * v), out);
}

void jet_coordinate(const double *p, const double *s, int i, jet *out) {
    *out = (jet){.value = i < 3 ? p[i] : s[i - 3]};
    out->slope[i] = 1;
}
