/* SPDX-License-Identifier: Apache-2.0 */
/* activation.c: the scalar equations adot_i = g_i(e_i, a_i), by 4-stage Gauss collocation.
 *
 * All muscles go through the same Newton iteration together; each has its own 4 x 4 system
 * M = I - h diag(g_a) A. As g_a < 0, M times a positive diagonal has a positive definite symmetric
 * part (Gauss schemes are algebraically stable), so it is eliminated without pivots. */
#include "rk.h"

#include <math.h>
#include <string.h>

#define STAGES RK_MAX_STAGES
/* Newton ends when the last correction of every activation is below this; the error left is of the
 * order of its square. */
#define RK_ACTIVATION_TOLERANCE 1e-9
#define RK_ACTIVATION_ITERATIONS 12

/* Overwrites m with its LU factors (unit lower). */
static void rk_small_factor(double m[STAGES][STAGES]) {
    for (int k = 0; k < STAGES; k++) {
        for (int i = k + 1; i < STAGES; i++) {
            m[i][k] /= m[k][k];
            for (int j = k + 1; j < STAGES; j++) {
                m[i][j] -= m[i][k] * m[k][j];
            }
        }
    }
}

static void rk_small_solve(const double m[STAGES][STAGES], double x[STAGES]) {
    for (int i = 1; i < STAGES; i++) {
        for (int j = 0; j < i; j++) {
            x[i] -= m[i][j] * x[j];
        }
    }
    for (int i = STAGES - 1; i >= 0; i--) {
        for (int j = i + 1; j < STAGES; j++) {
            x[i] -= m[i][j] * x[j];
        }
        x[i] /= m[i][i];
    }
}

static void rk_small_solve_transposed(const double m[STAGES][STAGES], double x[STAGES]) {
    for (int i = 0; i < STAGES; i++) {
        for (int j = 0; j < i; j++) {
            x[i] -= m[j][i] * x[j];
        }
        x[i] /= m[i][i];
    }
    for (int i = STAGES - 2; i >= 0; i--) {
        for (int j = i + 1; j < STAGES; j++) {
            x[i] -= m[j][i] * x[j];
        }
    }
}

/* LU of muscle i's system at its present stage values. */
static void rk_activation_matrix(const struct rk_context *c, int32_t i, double h,
                                 double m[STAGES][STAGES]) {
    const struct rk_tableau *t = &c->rk->activation;
    int32_t n_m = c->rk->system->n_m;
    for (int j = 0; j < STAGES; j++) {
        double g_a = c->slope_a[j * n_m + i];
        for (int k = 0; k < STAGES; k++) {
            m[j][k] = (j == k ? 1.0 : 0.0) - h * g_a * t->A[j * STAGES + k];
        }
    }
    rk_small_factor(m);
}

/* One Newton correction of all muscles; returns the largest, NaN if one is. About the stage values
 * y the slopes are k = g + g_a (a + h A k - y), so M k = g + g_a (a - y), and the new values a + h
 * A k. */
static double rk_activation_correct(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->activation;
    int32_t n_m = c->rk->system->n_m;
    double largest = 0;
    for (int32_t i = 0; i < n_m; i++) {
        double m[STAGES][STAGES], k_new[STAGES];
        rk_activation_matrix(c, i, h, m);
        for (int j = 0; j < STAGES; j++) {
            int32_t at = j * n_m + i;
            k_new[j] = c->slope[at] + c->slope_a[at] * (c->a[i] - c->guess[at]);
        }
        rk_small_solve((const double(*)[STAGES])m, k_new);
        for (int j = 0; j < STAGES; j++) {
            double y = c->a[i];
            for (int k = 0; k < STAGES; k++) {
                y += h * t->A[j * STAGES + k] * k_new[k];
            }
            if (isnan(y)) {
                return NAN;
            }
            largest = fmax(largest, fabs(y - c->guess[j * n_m + i]));
            c->guess[j * n_m + i] = y;
            c->slope[j * n_m + i] = k_new[j];
        }
    }
    return largest;
}

/* Derivatives of the step by its start and by e: with w = M^-T b, 1 + h w.g_a and h w.g_e. */
static void rk_activation_chain(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->activation;
    int32_t n_m = c->rk->system->n_m;
    for (int32_t i = 0; i < n_m; i++) {
        double m[STAGES][STAGES], w[STAGES], by_a = 1, by_e = 0;
        rk_activation_matrix(c, i, h, m);
        memcpy(w, t->b, sizeof w);
        rk_small_solve_transposed((const double(*)[STAGES])m, w);
        for (int j = 0; j < STAGES; j++) {
            by_a += h * w[j] * c->slope_a[j * n_m + i];
            by_e += h * w[j] * c->slope_e[j * n_m + i];
        }
        c->a_a[i] *= by_a;
        c->a_e[i] = by_a * c->a_e[i] + by_e;
    }
}

static mhe_status rk_activation_step(struct rk_context *c, const double *e, double h,
                                     int32_t derivatives, mhe_error *err) {
    const struct rk_tableau *t = &c->rk->activation;
    const mhe_system *system = c->rk->system;
    int32_t n_m = system->n_m;
    for (int j = 0; j < STAGES; j++) {
        memcpy(c->guess + j * n_m, c->a, sizeof(double) * (size_t)n_m);
    }
    double change = INFINITY;
    for (int iteration = 0; !(change < RK_ACTIVATION_TOLERANCE); iteration++) {
        if (iteration == RK_ACTIVATION_ITERATIONS || isnan(change)) {
            return mhe_fail(err, MHE_RETRY, "activations: no solution over %g s", h);
        }
        /* from equal stage values one evaluation serves all */
        int fresh = iteration == 0 ? 1 : STAGES;
        for (int j = 0; j < STAGES; j++) {
            int32_t at = j * n_m;
            if (j < fresh) {
                mhe_status status = system->activation_rate(system, e, c->guess + at, c->slope + at,
                                                            c->slope_e + at, c->slope_a + at, err);
                if (status != MHE_OK) {
                    return status;
                }
            } else {
                memcpy(c->slope + at, c->slope, sizeof(double) * (size_t)n_m);
                memcpy(c->slope_a + at, c->slope_a, sizeof(double) * (size_t)n_m);
            }
        }
        change = rk_activation_correct(c, h);
    }
    if (derivatives) {
        rk_activation_chain(c, h);
    }
    for (int32_t i = 0; i < n_m; i++) {
        for (int j = 0; j < STAGES; j++) {
            c->a[i] += h * t->b[j] * c->slope[j * n_m + i];
        }
    }
    return MHE_OK;
}

/* Carries the activations over `length` seconds in as many steps as that takes. */
static mhe_status rk_activation_advance(struct rk_context *c, const double *e, double length,
                                        int32_t derivatives, mhe_error *err) {
    int32_t n = (int32_t)ceil(length / c->rk->activation_step - 1e-9);
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k < n && status == MHE_OK; k++) {
        status = rk_activation_step(c, e, length / n, derivatives, err);
    }
    return status;
}

mhe_status rk_activations(struct rk_context *c, const double *e, double h, int32_t derivatives,
                          mhe_error *err) {
    const struct rk_tableau *t = &c->rk->mechanics;
    size_t bytes = sizeof(double) * (size_t)c->rk->system->n_m;
    double time = 0; /* in steps */
    memcpy(c->a_start, c->a, bytes);
    for (int32_t j = 0; j < t->stages; j++) {
        mhe_status status = rk_activation_advance(c, e, (t->c[j] - time) * h, derivatives, err);
        if (status != MHE_OK) {
            return status;
        }
        time = t->c[j];
        size_t at = (size_t)j * (size_t)c->rk->system->n_m;
        memcpy(c->stage_a + at, c->a, bytes);
        memcpy(c->stage_a_a + at, c->a_a, bytes);
        memcpy(c->stage_a_e + at, c->a_e, bytes);
    }
    return rk_activation_advance(c, e, (1 - time) * h, derivatives, err);
}
