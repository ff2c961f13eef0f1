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

#include "../clones.h"

#include <math.h>
#include <string.h>

#define STAGES RK_ACTIVATION_STAGES
#define LANES RK_LANES
/* Newton ends when the last correction of every activation is below this; the error left is of the
 * order of its square, and the derivatives belong to values that are off by no more. */
#define RK_ACTIVATION_TOLERANCE 1e-6
#define RK_ACTIVATION_ITERATIONS 12
/* More steps than this in a mechanical one mean a state far out. */
#define RK_ACTIVATION_STEPS 1000

/* LANES muscles; arithmetic on it is theirs, one by one. */
typedef double rk_lanes __attribute__((vector_size(LANES * sizeof(double))));

/* sum += weight * from [n]. */
static inline void rk_add(double *restrict sum, double weight, const double *restrict from,
                          int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        sum[i] += weight * from[i];
    }
}

#define RK_LOAD(lanes, from) memcpy(&(lanes), (from), sizeof(rk_lanes))
#define RK_STORE(to, lanes) memcpy((to), &(lanes), sizeof(rk_lanes))

/* m = LU (unit lower, reciprocals on the diagonal) of the systems at the slopes g_a [4], one a
 * stage. */
static inline __attribute__((always_inline)) void
rk_lanes_factor(const double *A, double h, const rk_lanes *g_a, rk_lanes m[STAGES][STAGES]) {
    for (int j = 0; j < STAGES; j++) {
        for (int k = 0; k < STAGES; k++) {
            m[j][k] = (j == k ? 1.0 : 0.0) - (h * A[j * STAGES + k]) * g_a[j];
        }
    }
    for (int k = 0; k < STAGES; k++) {
        m[k][k] = 1.0 / m[k][k];
        for (int j = k + 1; j < STAGES; j++) {
            m[j][k] *= m[k][k];
            for (int n = k + 1; n < STAGES; n++) {
                m[j][n] -= m[j][k] * m[k][n];
            }
        }
    }
}

static inline __attribute__((always_inline)) void rk_lanes_solve(rk_lanes m[STAGES][STAGES],
                                                                 rk_lanes *x) {
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

/* One Newton correction of all muscles; returns its norm, NaN if one is. About the stage values
 * y the slopes are k = g + g_a (a + h A k - y), so M k = g + g_a (a - y), and the new values a + h
 * A k. */
CLONES static double rk_activation_correct(struct rk_context *c, double h) {
    const double *A = c->rk->activation.A;
    int32_t pad = c->rk->pad;
    rk_lanes squares = {0};
    double sum_of_squares = 0;
    for (int32_t i = 0; i < pad; i += LANES) {
        rk_lanes m[STAGES][STAGES], g_a[STAGES], k_new[STAGES], y[STAGES], a;
        RK_LOAD(a, c->a + i);
        for (int j = 0; j < STAGES; j++) {
            RK_LOAD(g_a[j], c->slope_a + j * pad + i);
            RK_LOAD(k_new[j], c->slope + j * pad + i);
            RK_LOAD(y[j], c->guess + j * pad + i);
            k_new[j] += g_a[j] * (a - y[j]);
        }
        rk_lanes_factor(A, h, g_a, m);
        rk_lanes_solve(m, k_new);
        for (int j = 0; j < STAGES; j++) {
            rk_lanes sum = A[j * STAGES] * k_new[0];
            for (int k = 1; k < STAGES; k++) {
                sum += A[j * STAGES + k] * k_new[k];
            }
            sum = a + h * sum;
            squares += (sum - y[j]) * (sum - y[j]);
            RK_STORE(c->guess + j * pad + i, sum);
            RK_STORE(c->slope + j * pad + i, k_new[j]);
        }
    }
    for (int l = 0; l < LANES; l++) {
        sum_of_squares += squares[l];
    }
    return sqrt(sum_of_squares);
}

/* Derivatives of the stage slopes k by the start of the step and by e, M^-1 g_a and M^-1 g_e: those
 * of the stage values go to `trace`; chained onto those of the start, the stage values' are guess_a
 * and guess_e, the end's a_a and a_e. */
CLONES static void rk_activation_chain(struct rk_context *c, double h,
                                       const struct rk_trace *trace) {
    const struct rk_tableau *t = &c->rk->activation;
    int32_t pad = c->rk->pad;
    for (int32_t i = 0; i < pad; i += LANES) {
        rk_lanes m[STAGES][STAGES], g_a[STAGES], k_a[STAGES], k_e[STAGES], a_a, a_e, by_a, by_e;
        RK_LOAD(a_a, c->a_a + i);
        RK_LOAD(a_e, c->a_e + i);
        for (int j = 0; j < STAGES; j++) {
            RK_LOAD(g_a[j], c->slope_a + j * pad + i);
            RK_LOAD(k_e[j], c->slope_e + j * pad + i);
            k_a[j] = h * g_a[j];
            k_e[j] *= h;
        }
        rk_lanes_factor(t->A, h, g_a, m);
        rk_lanes_solve(m, k_a);
        rk_lanes_solve(m, k_e);
        for (int j = 0; j <= STAGES; j++) { /* the last: the end of the step */
            const double *weight = j < STAGES ? t->A + j * STAGES : t->b;
            by_a = 1.0 + weight[0] * k_a[0];
            by_e = weight[0] * k_e[0];
            for (int k = 1; k < STAGES; k++) {
                by_a += weight[k] * k_a[k];
                by_e += weight[k] * k_e[k];
            }
            rk_lanes chained_a = by_a * a_a, chained_e = by_a * a_e + by_e;
            if (j < STAGES) {
                RK_STORE(trace->by_a + j * pad + i, by_a);
                RK_STORE(trace->by_e + j * pad + i, by_e);
            }
            RK_STORE(j < STAGES ? c->guess_a + j * pad + i : c->a_a + i, chained_a);
            RK_STORE(j < STAGES ? c->guess_e + j * pad + i : c->a_e + i, chained_e);
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

/* Where there are states z, the activations at the stages themselves: z follows them within the
 * step, and what the last stage sees is what it ends with. The polynomial through start, stages and
 * end of the k-th of n steps, at the mechanical stages that fall into it; start and its derivatives
 * are in c->before. */
static void rk_activation_sample(struct rk_context *c, int32_t k, int32_t n, int32_t derivatives) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_m = c->rk->system->n_m, pad = c->rk->pad;
    double node[STAGES + 2] = {0}, *to[3], *const end[] = {c->a, c->a_a, c->a_e};
    const double *const stage[] = {c->guess, c->guess_a, c->guess_e};
    memcpy(node + 1, c->rk->activation.c, sizeof(double) * STAGES);
    node[STAGES + 1] = 1;
    for (int32_t j = 0; j < t->stages; j++) {
        double x = t->c[j] * n - k;
        if (!(x > 1e-12 && x <= 1 + 1e-12)) {
            continue;
        }
        to[0] = c->stage_a + j * n_m;
        to[1] = c->stage_a_a + j * n_m;
        to[2] = c->stage_a_e + j * n_m;
        for (int32_t i = 0; i < STAGES + 2; i++) {
            double weight = 1;
            for (int32_t l = 0; l < STAGES + 2; l++) {
                weight *= l != i ? (x - node[l]) / (node[i] - node[l]) : 1;
            }
            for (int32_t d = 0; d < (derivatives ? 3 : 1); d++) {
                const double *from = i == 0            ? c->before + d * pad
                                     : i == STAGES + 1 ? end[d]
                                                       : stage[d] + (i - 1) * pad;
                rk_add(to[d], weight, from, n_m);
            }
        }
    }
}

/* Steps that the activations need over h: as their time constants at its start say. */
static mhe_status rk_activation_count(struct rk_context *c, const double *e, double h, int32_t *n,
                                      mhe_error *err) {
    const mhe_system *system = c->rk->system;
    double fastest = 0, sum = 0;
    mhe_status status =
        system->activation_rate(system, e, c->a, c->slope, c->slope_e, c->slope_a, err);
    if (status != MHE_OK) {
        return status;
    }
    for (int32_t i = 0; i < system->n_m; i++) {
        double rate = fabs(c->slope_a[i]);
        fastest = rate > fastest ? rate : fastest;
        sum += rate; /* NaN if one is */
    }
    double steps = ceil(h * fastest / c->rk->config.activation_step - 1e-9);
    if (!(sum + steps < INFINITY) || steps > RK_ACTIVATION_STEPS) {
        return mhe_fail(err, MHE_RETRY, "activations: no solution over %g s", h);
    }
    *n = steps > 1 ? (int32_t)steps : 1;
    return MHE_OK;
}

mhe_status rk_activations(struct rk_context *c, const double *e, double h, int32_t derivatives,
                          mhe_error *err) {
    int32_t n_m = c->rk->system->n_m, n = 0;
    mhe_status status = rk_activation_count(c, e, h, &n, err);
    size_t bytes = sizeof(double) * (size_t)(c->rk->mechanics.stages * n_m);
    memcpy(c->a_start, c->a, sizeof(double) * (size_t)n_m);
    memset(c->stage_a, 0, bytes);
    memset(c->stage_a_a, 0, bytes);
    memset(c->stage_a_e, 0, bytes);
    for (int32_t k = 0; k < n && status == MHE_OK; k++) {
        if (c->rk->system->n_z > 0) {
            size_t pad = (size_t)c->rk->pad;
            memcpy(c->before, c->a, sizeof(double) * pad);
            memcpy(c->before + pad, c->a_a, sizeof(double) * pad);
            memcpy(c->before + 2 * pad, c->a_e, sizeof(double) * pad);
        }
        status = rk_activation_step(c, e, k, h / n, derivatives, err);
        if (status == MHE_OK && c->rk->system->n_z > 0) {
            rk_activation_sample(c, k, n, derivatives);
        } else if (status == MHE_OK) {
            rk_activation_project(c, k, n, derivatives);
        }
    }
    return status;
}
