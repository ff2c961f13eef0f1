/* SPDX-License-Identifier: Apache-2.0 */
/* activation.c: the scalar equations adot_i = g_i(e_i, a_i), by 4-stage Gauss collocation.
 *
 * All muscles go through the same Newton iteration together; each has its own 4 x 4 system
 * M = I - h diag(g_a) A. As g_a < 0, M times a positive diagonal has a positive definite symmetric
 * part (Gauss schemes are algebraically stable), so it is eliminated without pivots, LANES muscles
 * side by side. Arrays of the muscles are padded to whole lanes with zeros, which stay zero.
 *
 * With a memory the iteration starts from the stage values of the last call, moved to first order
 * by what start and control have changed.
 *
 * Activations change in 9 to 20 ms, faster than the mechanical steps need to be. Taken at the stage
 * times, such a transient would spoil their quadrature; so the stages see its best polynomial
 * instead (least squares over the step, of as many terms as the scheme integrates). Forces being
 * nearly linear in activation, the impulses of the transient are then right. */
#include "rk.h"

#include <math.h>
#include <string.h>

#define STAGES RK_ACTIVATION_STAGES
#define LANES RK_LANES
/* Newton ends when the last correction of every activation is below this; the error left is of the
 * order of its square, and the derivatives belong to values that are off by no more. */
#define RK_ACTIVATION_TOLERANCE 1e-6
#define RK_ACTIVATION_ITERATIONS 12

typedef double rk_matrix[STAGES][STAGES][LANES];
typedef double rk_vector[STAGES][LANES];

/* sum += weight * from [n]. */
static inline void rk_add(double *restrict sum, double weight, const double *restrict from,
                          int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        sum[i] += weight * from[i];
    }
}

/* out -= a * b, lane by lane. */
static inline void rk_lanes_subtract(double out[LANES], const double a[LANES],
                                     const double b[LANES]) {
    for (int l = 0; l < LANES; l++) {
        out[l] -= a[l] * b[l];
    }
}

/* LU (unit lower, reciprocals on the diagonal) of the systems of the muscles i .. i + LANES - 1 at
 * their present stage values. */
static inline void rk_lanes_factor(const struct rk_context *c, int32_t i, double h, rk_matrix m) {
    const double *A = c->rk->activation.A;
    for (int j = 0; j < STAGES; j++) {
        const double *g_a = c->slope_a + j * c->rk->pad + i;
        for (int k = 0; k < STAGES; k++) {
            double one = j == k ? 1.0 : 0.0, by = h * A[j * STAGES + k];
            for (int l = 0; l < LANES; l++) {
                m[j][k][l] = one - by * g_a[l];
            }
        }
    }
    for (int k = 0; k < STAGES; k++) {
        for (int l = 0; l < LANES; l++) {
            m[k][k][l] = 1 / m[k][k][l];
        }
        for (int j = k + 1; j < STAGES; j++) {
            for (int l = 0; l < LANES; l++) {
                m[j][k][l] *= m[k][k][l];
            }
            for (int n = k + 1; n < STAGES; n++) {
                rk_lanes_subtract(m[j][n], m[j][k], m[k][n]);
            }
        }
    }
}

static inline void rk_lanes_solve(rk_matrix m, rk_vector x) {
    for (int i = 1; i < STAGES; i++) {
        for (int j = 0; j < i; j++) {
            rk_lanes_subtract(x[i], m[i][j], x[j]);
        }
    }
    for (int i = STAGES - 1; i >= 0; i--) {
        for (int j = i + 1; j < STAGES; j++) {
            rk_lanes_subtract(x[i], m[i][j], x[j]);
        }
        for (int l = 0; l < LANES; l++) {
            x[i][l] *= m[i][i][l];
        }
    }
}

/* One Newton correction of all muscles; returns the largest, NaN if one is. About the stage values
 * y the slopes are k = g + g_a (a + h A k - y), so M k = g + g_a (a - y), and the new values a + h
 * A k. */
static double rk_activation_correct(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->activation;
    int32_t pad = c->rk->pad;
    double largest[LANES] = {0}, finite = 0, most = 0;
    for (int32_t i = 0; i < pad; i += LANES) {
        rk_matrix m;
        rk_vector k_new;
        rk_lanes_factor(c, i, h, m);
        for (int j = 0; j < STAGES; j++) {
            for (int l = 0; l < LANES; l++) {
                int32_t at = j * pad + i + l;
                k_new[j][l] = c->slope[at] + c->slope_a[at] * (c->a[i + l] - c->guess[at]);
            }
        }
        rk_lanes_solve(m, k_new);
        for (int j = 0; j < STAGES; j++) {
            double y[LANES];
            memcpy(y, c->a + i, sizeof y);
            for (int k = 0; k < STAGES; k++) {
                rk_add(y, h * t->A[j * STAGES + k], k_new[k], LANES);
            }
            for (int l = 0; l < LANES; l++) {
                double move = fabs(y[l] - c->guess[j * pad + i + l]);
                largest[l] = move > largest[l] ? move : largest[l];
                finite += move - move;
            }
            memcpy(c->guess + j * pad + i, y, sizeof y);
            memcpy(c->slope + j * pad + i, k_new[j], sizeof k_new[j]);
        }
    }
    for (int l = 0; l < LANES; l++) {
        most = fmax(most, largest[l]);
    }
    return finite == 0 ? most : NAN;
}

/* Derivatives of the stage slopes k by the start of the step and by e, M^-1 g_a and M^-1 g_e: those
 * of the stage values go to `trace`; chained onto those of the start, the stage values' are guess_a
 * and guess_e, the end's a_a and a_e. */
static void rk_activation_chain(struct rk_context *c, double h, const struct rk_trace *trace) {
    const struct rk_tableau *t = &c->rk->activation;
    int32_t pad = c->rk->pad;
    for (int32_t i = 0; i < pad; i += LANES) {
        rk_matrix m;
        rk_vector k_a, k_e;
        double *a_a = c->a_a + i, *a_e = c->a_e + i, by_a[LANES], by_e[LANES];
        rk_lanes_factor(c, i, h, m);
        for (int j = 0; j < STAGES; j++) {
            for (int l = 0; l < LANES; l++) {
                k_a[j][l] = h * c->slope_a[j * pad + i + l];
                k_e[j][l] = h * c->slope_e[j * pad + i + l];
            }
        }
        rk_lanes_solve(m, k_a);
        rk_lanes_solve(m, k_e);
        for (int j = 0; j <= STAGES; j++) { /* the last: the end of the step */
            const double *weight = j < STAGES ? t->A + j * STAGES : t->b;
            for (int l = 0; l < LANES; l++) {
                by_a[l] = 1;
                by_e[l] = 0;
            }
            for (int k = 0; k < STAGES; k++) {
                rk_add(by_a, weight[k], k_a[k], LANES);
                rk_add(by_e, weight[k], k_e[k], LANES);
            }
            if (j == STAGES) {
                break;
            }
            int32_t at = j * pad + i;
            memcpy(trace->by_a + at, by_a, sizeof by_a);
            memcpy(trace->by_e + at, by_e, sizeof by_e);
            for (int l = 0; l < LANES; l++) {
                c->guess_a[at + l] = by_a[l] * a_a[l];
                c->guess_e[at + l] = by_a[l] * a_e[l] + by_e[l];
            }
        }
        for (int l = 0; l < LANES; l++) {
            a_a[l] *= by_a[l];
            a_e[l] = by_a[l] * a_e[l] + by_e[l];
        }
    }
}

/* Rates and their derivatives at the first n of the stage values, the first standing for the rest.
 */
static mhe_status rk_activation_evaluate(struct rk_context *c, const double *e, int n,
                                         mhe_error *err) {
    const mhe_system *system = c->rk->system;
    int32_t pad = c->rk->pad;
    size_t bytes = sizeof(double) * (size_t)pad;
    for (int j = 0; j < STAGES; j++) {
        int32_t at = j * pad;
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

/* Newton's iteration from the trace of the last call, or (NULL) from the start's values. */
static mhe_status rk_activation_solve(struct rk_context *c, const double *e, double h,
                                      const struct rk_trace *trace, mhe_error *err) {
    int32_t n_m = c->rk->system->n_m, pad = c->rk->pad;
    double change = INFINITY;
    for (int j = 0; j < STAGES; j++) {
        double *guess = c->guess + j * pad;
        memcpy(guess, c->a, sizeof(double) * (size_t)pad);
        for (int32_t i = 0; trace != NULL && i < n_m; i++) {
            int32_t at = j * pad + i;
            guess[i] = trace->value[at] + trace->by_a[at] * (c->a[i] - trace->a[i]) +
                       trace->by_e[at] * (e[i] - trace->e[i]);
        }
    }
    for (int iteration = 0; !(change < RK_ACTIVATION_TOLERANCE); iteration++) {
        if (iteration == RK_ACTIVATION_ITERATIONS || isnan(change)) {
            return mhe_fail(err, MHE_RETRY, "activations: no solution over %g s", h);
        }
        int known = iteration > 0 || trace != NULL;
        mhe_status status = rk_activation_evaluate(c, e, known ? STAGES : 1, err);
        if (status != MHE_OK) {
            return status;
        }
        change = rk_activation_correct(c, h);
        if (!known) {
            change = INFINITY;
        }
    }
    return MHE_OK;
}

/* The k-th step of the activations in the present mechanical one. */
static mhe_status rk_activation_step(struct rk_context *c, const double *e, int32_t k, double h,
                                     int32_t derivatives, mhe_error *err) {
    const struct rk_tableau *t = &c->rk->activation;
    size_t bytes = sizeof(double) * (size_t)c->rk->system->n_m;
    int32_t pad = c->rk->pad;
    struct rk_trace kept;
    int keeps = rk_memory_trace(c, k, &kept);
    mhe_status status = MHE_RETRY;
    if (keeps && *kept.step == h) {
        status = rk_activation_solve(c, e, h, &kept, err);
    }
    if (status > MHE_OK) {
        status = rk_activation_solve(c, e, h, NULL, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    if (derivatives) {
        rk_activation_chain(c, h, keeps ? &kept : &c->trace);
    }
    if (derivatives && keeps) {
        memcpy(kept.a, c->a, bytes);
        memcpy(kept.e, e, bytes);
        memcpy(kept.value, c->guess, sizeof(double) * (size_t)(STAGES * pad));
        *kept.step = h;
    }
    for (int j = 0; j < STAGES; j++) {
        rk_add(c->a, h * t->b[j], c->slope + j * pad, pad);
    }
    return MHE_OK;
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

/* out [s x 4]: what the stage values of the k-th of n activation steps are worth in the polynomial
 * at the mechanical stages. */
static void rk_activation_weigh(const struct rk *rk, int32_t k, int32_t n, double *out) {
    const struct rk_tableau *t = &rk->mechanics, *own = &rk->activation;
    double at_node[RK_MAX_STAGES], at_stage[RK_MAX_STAGES];
    for (int32_t i = 0; i < STAGES; i++) {
        rk_legendre((k + own->c[i]) / n, RK_MAX_STAGES, at_node);
        for (int32_t j = 0; j < t->stages; j++) {
            double weight = 0;
            rk_legendre(t->c[j], RK_MAX_STAGES, at_stage);
            for (int32_t d = 0; d < t->terms; d++) {
                weight += (2 * d + 1) * at_stage[d] * at_node[d];
            }
            out[j * STAGES + i] = weight * own->b[i] / n;
        }
    }
}

/* Place of the weights of the k-th of n steps, n <= RK_WEIGHED. */
static double *rk_activation_weights_of(const struct rk_context *c, int32_t k, int32_t n) {
    return c->weights + (n * (n - 1) / 2 + k) * c->rk->mechanics.stages * STAGES;
}

void rk_activation_weights(struct rk_context *c) {
    for (int32_t n = 1; n <= RK_WEIGHED; n++) {
        for (int32_t k = 0; k < n; k++) {
            rk_activation_weigh(c->rk, k, n, rk_activation_weights_of(c, k, n));
        }
    }
}

/* Adds to the stage activations what the k-th of n activation steps holds of their polynomial. */
static void rk_activation_project(struct rk_context *c, int32_t k, int32_t n, int32_t derivatives) {
    int32_t n_m = c->rk->system->n_m, pad = c->rk->pad, s = c->rk->mechanics.stages;
    double computed[RK_MAX_STAGES * STAGES];
    const double *weights = computed;
    if (n <= RK_WEIGHED) {
        weights = rk_activation_weights_of(c, k, n);
    } else {
        rk_activation_weigh(c->rk, k, n, computed);
    }
    for (int32_t j = 0; j < s; j++) {
        for (int32_t i = 0; i < STAGES; i++) {
            double weight = weights[j * STAGES + i];
            rk_add(c->stage_a + j * n_m, weight, c->guess + i * pad, n_m);
            if (derivatives) {
                rk_add(c->stage_a_a + j * n_m, weight, c->guess_a + i * pad, n_m);
                rk_add(c->stage_a_e + j * n_m, weight, c->guess_e + i * pad, n_m);
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
        mhe_status status = rk_activation_step(c, e, k, h / n, derivatives, err);
        if (status != MHE_OK) {
            return status;
        }
        rk_activation_project(c, k, n, derivatives);
    }
    return MHE_OK;
}
