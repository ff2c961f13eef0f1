/* SPDX-License-Identifier: Apache-2.0 */
/* mix.c: functions of lengths of whole courses, with their derivatives by the own coordinates. */
#include "mix.h"

#include <string.h>

static double *kept(const mix_case *c, int k) {
    size_t n = (size_t)c->route->n_own;
    return c->work->kept + (size_t)(MIX_VARIABLES * c->level + k) * n * (n + 1);
}

void mix_variable(const mix_case *c, int k, double value, jet *out) {
    int32_t n = c->route->n_own;
    double *to = kept(c, k);
    *out = (jet){.value = value};
    out->slope[k] = 1;
    if (c->gradient != NULL) {
        memcpy(to, c->gradient, sizeof *to * (size_t)n);
    }
    for (int32_t i = 0; i < n && c->hessian != NULL; i++) {
        memcpy(to + n * (i + 1), c->hessian + i * c->stride, sizeof *to * (size_t)n);
    }
}

void mix_course(mix_case *c, int k, jet *out) {
    double value =
        strand_length(c->t, c->route, c->pose, c->work, &c->stride, c->gradient, c->hessian);
    mix_variable(c, k, value, out);
}

double mix_result(mix_case *c, const jet *x) {
    int32_t n = c->route->n_own;
    c->stride = n;
    if (c->gradient == NULL) {
        return x->value;
    }
    memset(c->gradient, 0, sizeof *c->gradient * (size_t)n);
    for (int k = 0; k < MIX_VARIABLES; k++) {
        for (int32_t i = 0; i < n && x->slope[k] != 0; i++) {
            c->gradient[i] += x->slope[k] * kept(c, k)[i];
        }
    }
    if (c->hessian == NULL) {
        return x->value;
    }
    memset(c->hessian, 0, sizeof *c->hessian * (size_t)(n * n));
    for (int k = 0; k < MIX_VARIABLES; k++) {
        const double *own = kept(c, k), *curve = own + n;
        for (int32_t i = 0; i < n * n && x->slope[k] != 0; i++) {
            c->hessian[i] += x->slope[k] * curve[i];
        }
        for (int l = 0; l < MIX_VARIABLES; l++) {
            const double *other = kept(c, l);
            for (int32_t i = 0; i < n && x->curve[k][l] != 0; i++) {
                for (int32_t j = 0; j < n; j++) {
                    c->hessian[i * n + j] += x->curve[k][l] * own[i] * other[j];
                }
            }
        }
    }
    return x->value;
}
