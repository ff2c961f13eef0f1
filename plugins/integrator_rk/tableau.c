/* SPDX-License-Identifier: Apache-2.0 */
/* tableau.c: coefficients of the schemes. */
#include "rk.h"

#include <math.h>
#include <string.h>

static void rk_tableau_finish(struct rk_tableau *t) {
    int32_t s = t->stages;
    for (int32_t k = 0; k < s; k++) {
        t->bA[k] = 0;
        for (int32_t j = 0; j < s; j++) {
            t->bA[k] += t->b[j] * t->A[j * s + k];
            t->AA[j * s + k] = 0;
            for (int32_t i = 0; i < s; i++) {
                t->AA[j * s + k] += t->A[j * s + i] * t->A[i * s + k];
            }
        }
    }
}

/* The k-th Lagrange polynomial on the nodes c, at x. */
static double rk_lagrange(const double *c, int32_t n, int32_t k, double x) {
    double value = 1;
    for (int32_t i = 0; i < n; i++) {
        if (i != k) {
            value *= (x - c[i]) / (c[k] - c[i]);
        }
    }
    return value;
}

/* Upper halves of the Gauss-Legendre nodes and weights on [-1, 1]. */
static void rk_gauss_rule(int32_t n, double *c, double *b) {
    double x[RK_MAX_STAGES] = {0}, w[RK_MAX_STAGES] = {0};
    switch (n) {
    case 1:
        w[0] = 2;
        break;
    case 2:
        x[1] = sqrt(1.0 / 3), w[1] = 1;
        break;
    case 3:
        w[1] = 8.0 / 9;
        x[2] = sqrt(0.6), w[2] = 5.0 / 9;
        break;
    default:
        x[2] = sqrt(3.0 / 7 - 2.0 / 7 * sqrt(1.2)), w[2] = (18 + sqrt(30)) / 36;
        x[3] = sqrt(3.0 / 7 + 2.0 / 7 * sqrt(1.2)), w[3] = (18 - sqrt(30)) / 36;
        break;
    }
    for (int32_t i = 0; i < n; i++) {
        int32_t half = i >= n - 1 - i ? i : n - 1 - i;
        c[i] = 0.5 + 0.5 * (i == half ? x[half] : -x[half]);
        b[i] = 0.5 * w[half];
    }
}

void rk_tableau_gauss(int32_t stages, struct rk_tableau *out) {
    *out = (struct rk_tableau){.stages = stages};
    rk_gauss_rule(stages, out->c, out->b);
    /* A_jk is the integral of the k-th Lagrange polynomial from 0 to c_j; the rule itself is exact
     * for it. */
    for (int32_t j = 0; j < stages; j++) {
        for (int32_t k = 0; k < stages; k++) {
            double integral = 0;
            for (int32_t m = 0; m < stages; m++) {
                integral += out->b[m] * rk_lagrange(out->c, stages, k, out->c[j] * out->c[m]);
            }
            out->A[j * stages + k] = out->c[j] * integral;
        }
    }
    rk_tableau_finish(out);
}

void rk_tableau_rk4(struct rk_tableau *out) {
    *out = (struct rk_tableau){.stages = 4,
                               .is_explicit = 1,
                               .c = {0, 0.5, 0.5, 1},
                               .b = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6}};
    out->A[1 * 4 + 0] = 0.5;
    out->A[2 * 4 + 1] = 0.5;
    out->A[3 * 4 + 2] = 1;
    rk_tableau_finish(out);
}
