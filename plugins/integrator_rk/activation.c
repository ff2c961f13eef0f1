/* SPDX-License-Identifier: Apache-2.0 */
/* activation.c: the scalar equations adot_i = g_i(e_i, a_i), by 4-stage Gauss collocation.
 *
 * All muscles go through the same Newton iteration together; each has its own 4 x 4 system
 * M = I - h diag(g_a) A. As g_a < 0, M times a positive diagonal has a positive definite symmetric
 * part (Gauss schemes are algebraically stable), so it is eliminated without pivots.
 *
 * Activations change in 9 to 20 ms, faster than the mechanical steps need to be. Taken at the stage
 * times, such a transient would spoil their quadrature; so the stages see its best polynomial
 * instead (least squares over the step, of as many terms as the scheme integrates). Forces being
 * nearly linear in activation, the impulses of the transient are then right. */
#include "rk.h"

#include <math.h>
#include <string.h>

#define STAGES RK_ACTIVATION_STAGES
/* Newton ends when the last correction of every activation is below this; the error left is of the
 * order of its square. */
#define RK_ACTIVATION_TOLERANCE 1e-6
#define RK_ACTIVATION_ITERATIONS 12

/* sum += weight * from [n]. */
static void rk_add(double *sum, double weight, const double *from, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        sum[i] += weight * from[i];
    }
}

/* Overwrites m with its LU factors (unit lower, reciprocals on the diagonal). */
static void rk_small_factor(double m[STAGES][STAGES]) {
    for (int k = 0; k < STAGES; k++) {
        m[k][k] = 1 / m[k][k];
        for (int i = k + 1; i < STAGES; i++) {
            m[i][k] *= m[k][k];
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
        x[i] *= m[i][i];
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

/* Derivatives of the stage slopes k by the start of the step and by e, M^-1 g_a and M^-1 g_e,
 * chained onto those of the start: guess_a and guess_e are the stage values' and a_a, a_e the
 * end's. */
static void rk_activation_chain(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->activation;
    int32_t n_m = c->rk->system->n_m;
    for (int32_t i = 0; i < n_m; i++) {
        double m[STAGES][STAGES], k_a[STAGES], k_e[STAGES], by_a = 1, by_e = 0;
        rk_activation_matrix(c, i, h, m);
        for (int j = 0; j < STAGES; j++) {
            k_a[j] = h * c->slope_a[j * n_m + i];
            k_e[j] = h * c->slope_e[j * n_m + i];
        }
        rk_small_solve((const double(*)[STAGES])m, k_a);
        rk_small_solve((const double(*)[STAGES])m, k_e);
        for (int j = 0; j < STAGES; j++) {
            double y_a = 1, y_e = 0;
            for (int k = 0; k < STAGES; k++) {
                y_a += t->A[j * STAGES + k] * k_a[k];
                y_e += t->A[j * STAGES + k] * k_e[k];
            }
            c->guess_a[j * n_m + i] = y_a * c->a_a[i];
            c->guess_e[j * n_m + i] = y_a * c->a_e[i] + y_e;
            by_a += t->b[j] * k_a[j];
            by_e += t->b[j] * k_e[j];
        }
        c->a_a[i] *= by_a;
        c->a_e[i] = by_a * c->a_e[i] + by_e;
    }
}

/* Rates and their derivatives at the first n of the stage values, the first standing for the rest.
 */
static mhe_status rk_activation_evaluate(struct rk_context *c, const double *e, int n,
                                         mhe_error *err) {
    const mhe_system *system = c->rk->system;
    size_t bytes = sizeof(double) * (size_t)system->n_m;
    for (int j = 0; j < STAGES; j++) {
        int32_t at = j * system->n_m;
        if (j < n) {
            mhe_status status = system->activation_rate(system, e, c->guess + at, c->slope + at,
                                                        c->slope_e + at, c->slope_a + at, err);
            if (status != MHE_OK) {
                return status;
            }
        } else {
            memcpy(c->slope + at, c->slope, bytes);
            memcpy(c->slope_a + at, c->slope_a, bytes);
        }
    }
    return MHE_OK;
}

static mhe_status rk_activation_step(struct rk_context *c, const double *e, double h,
                                     int32_t derivatives, mhe_error *err) {
    const struct rk_tableau *t = &c->rk->activation;
    int32_t n_m = c->rk->system->n_m;
    double change = INFINITY;
    mhe_status status = MHE_OK;
    for (int j = 0; j < STAGES; j++) {
        memcpy(c->guess + j * n_m, c->a, sizeof(double) * (size_t)n_m);
    }
    for (int iteration = 0; !(change < RK_ACTIVATION_TOLERANCE); iteration++) {
        if (iteration == RK_ACTIVATION_ITERATIONS || isnan(change)) {
            return mhe_fail(err, MHE_RETRY, "activations: no solution over %g s", h);
        }
        status = rk_activation_evaluate(c, e, iteration == 0 ? 1 : STAGES, err);
        if (status != MHE_OK) {
            return status;
        }
        change = rk_activation_correct(c, h);
    }
    for (int j = 0; j < STAGES; j++) {
        rk_add(c->a, h * t->b[j], c->slope + j * n_m, n_m);
    }
    if (derivatives) {
        status = rk_activation_evaluate(c, e, STAGES, err);
        rk_activation_chain(c, h);
    }
    return status;
}

/* out [n] = P_d(2 x - 1), the Legendre polynomials on [0, 1]. */
static void rk_legendre(double x, int32_t n, double *out) {
    double z = 2 * x - 1;
    out[0] = 1;
    out[1] = z;
    for (int32_t d = 2; d < n; d++) {
        out[d] = ((2 * d - 1) * z * out[d - 1] - (d - 1) * out[d - 2]) / d;
    }
}

/* Adds to the stage activations what the k-th of n activation steps holds of their polynomial. */
static void rk_activation_project(struct rk_context *c, int32_t k, int32_t n, int32_t derivatives) {
    const struct rk_tableau *t = &c->rk->mechanics, *own = &c->rk->activation;
    int32_t n_m = c->rk->system->n_m;
    double at_node[RK_MAX_STAGES], at_stage[RK_MAX_STAGES];
    for (int32_t i = 0; i < STAGES; i++) {
        rk_legendre((k + own->c[i]) / n, RK_MAX_STAGES, at_node);
        for (int32_t j = 0; j < t->stages; j++) {
            double weight = 0;
            rk_legendre(t->c[j], RK_MAX_STAGES, at_stage);
            for (int32_t d = 0; d < t->terms; d++) {
                weight += (2 * d + 1) * at_stage[d] * at_node[d];
            }
            weight *= own->b[i] / n;
            rk_add(c->stage_a + j * n_m, weight, c->guess + i * n_m, n_m);
            if (derivatives) {
                rk_add(c->stage_a_a + j * n_m, weight, c->guess_a + i * n_m, n_m);
                rk_add(c->stage_a_e + j * n_m, weight, c->guess_e + i * n_m, n_m);
            }
        }
    }
}

mhe_status rk_activations(struct rk_context *c, const double *e, double h, int32_t derivatives,
                          mhe_error *err) {
    int32_t n_m = c->rk->system->n_m;
    int32_t n = (int32_t)ceil(h / c->rk->activation_step - 1e-9);
    size_t bytes = sizeof(double) * (size_t)(c->rk->mechanics.stages * n_m);
    memcpy(c->a_start, c->a, sizeof(double) * (size_t)n_m);
    memset(c->stage_a, 0, bytes);
    memset(c->stage_a_a, 0, bytes);
    memset(c->stage_a_e, 0, bytes);
    for (int32_t k = 0; k < n; k++) {
        mhe_status status = rk_activation_step(c, e, h / n, derivatives, err);
        if (status != MHE_OK) {
            return status;
        }
        rk_activation_project(c, k, n, derivatives);
    }
    return MHE_OK;
}
