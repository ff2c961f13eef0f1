/* SPDX-License-Identifier: Apache-2.0 */
/* tableau.c: coefficients of the schemes. */
#include "rk.h"

#include <math.h>
#include <string.h>

#define RK_PI 3.14159265358979323846

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

/* Nodes and weights of the Gauss-Legendre rule on [0, 1]: roots z of P_n, by Newton, and
 * 2 / ((1 - z^2) P_n'(z)^2) halved. */
static void rk_gauss_rule(int32_t n, double *c, double *b) {
    for (int32_t i = 0; i < n; i++) {
        double z = -cos(RK_PI * (i + 0.75) / (n + 0.5)), slope = 0;
        for (int32_t iteration = 0; iteration < 8; iteration++) {
            double p = 1, previous = 0;
            for (int32_t d = 1; d <= n; d++) {
                double next = ((2 * d - 1) * z * p - (d - 1) * previous) / d;
                previous = p;
                p = next;
            }
            slope = n * (z * p - previous) / (z * z - 1);
            z -= p / slope;
        }
        c[i] = 0.5 + 0.5 * z;
        b[i] = 1 / ((1 - z * z) * slope * slope);
    }
}

void rk_tableau_gauss(int32_t stages, struct rk_tableau *out) {
    *out = (struct rk_tableau){.stages = stages, .terms = stages};
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

/* P_n(z), the Legendre polynomial. */
static double rk_legendre_at(int32_t n, double z) {
    double p = 1, previous = 0;
    for (int32_t d = 1; d <= n; d++) {
        double next = ((2 * d - 1) * z * p - (d - 1) * previous) / d;
        previous = p;
        p = next;
    }
    return p;
}

/* Radau IIA: nodes are the roots of P_(s-1) - P_s on [-1, 1], of which 1 is the last; collocation
 * (Hairer and Wanner, chapter IV.5). */
void rk_tableau_radau(int32_t stages, struct rk_tableau *out) {
    double rule_c[RK_MAX_STAGES], rule_b[RK_MAX_STAGES];
    const int32_t n = 512; /* far below the distance of two roots */
    int32_t found = 0;
    *out = (struct rk_tableau){.stages = stages, .terms = stages};
    for (int32_t i = 0; i < n && found < stages - 1; i++) {
        double lower = -1 + 2.0 * i / n, upper = -1 + 2.0 * (i + 1) / n;
        double sign = rk_legendre_at(stages - 1, lower) - rk_legendre_at(stages, lower);
        if (sign * (rk_legendre_at(stages - 1, upper) - rk_legendre_at(stages, upper)) > 0) {
            continue;
        }
        for (int32_t k = 0; k < 60; k++) {
            double z = 0.5 * (lower + upper);
            double off = rk_legendre_at(stages - 1, z) - rk_legendre_at(stages, z);
            *(off * sign > 0 ? &lower : &upper) = z;
        }
        out->c[found++] = 0.5 + 0.25 * (lower + upper);
    }
    out->c[stages - 1] = 1;
    rk_gauss_rule(stages, rule_c, rule_b);
    for (int32_t j = 0; j < stages; j++) {
        for (int32_t k = 0; k < stages; k++) {
            for (int32_t m = 0; m < stages; m++) {
                out->A[j * stages + k] +=
                    out->c[j] * rule_b[m] * rk_lagrange(out->c, stages, k, out->c[j] * rule_c[m]);
            }
        }
    }
    memcpy(out->b, out->A + (stages - 1) * stages, sizeof(double) * (size_t)stages);
    rk_tableau_finish(out);
}

void rk_tableau_probes(const struct rk_tableau *t, struct rk_probe out[RK_PROBES]) {
    int32_t s = t->stages;
    for (int32_t i = 0; i < RK_PROBES; i++) {
        struct rk_probe *probe = &out[i];
        static const double at[] = {0, 1, 0.2, 0.5, 0.8};
        *probe = (struct rk_probe){.t = at[i]};
        for (int32_t k = 0; k < s; k++) {
            probe->at[k] = rk_lagrange(t->c, s, k, probe->t);
            for (int32_t m = 0; m < s; m++) {
                double value = t->b[m] * rk_lagrange(t->c, s, k, probe->t * t->c[m]);
                probe->v[k] += probe->t * value;
                probe->q[k] += probe->t * probe->t * (1 - t->c[m]) * value;
            }
        }
    }
}

void rk_tableau_rk4(struct rk_tableau *out) {
    *out = (struct rk_tableau){.stages = 4,
                               .is_explicit = 1,
                               .terms = 3, /* integrated exactly by Simpson's rule */
                               .c = {0, 0.5, 0.5, 1},
                               .b = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6}};
    out->A[1 * 4 + 0] = 0.5;
    out->A[2 * 4 + 1] = 0.5;
    out->A[3 * 4 + 2] = 1;
    rk_tableau_finish(out);
}
