/* SPDX-License-Identifier: Apache-2.0 */
#include "toy.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* out[n_x x n] += scale * (fx [n_x x n_x] S [n_x x n] + fu placed at column `at`) */
static void apply(int n_x, int n, int n_u, const double *fx, const double *fu, const double *S,
                  double *out) {
    memset(out, 0, sizeof(double) * (size_t)(n_x * n));
    for (int i = 0; i < n_x; i++) {
        for (int l = 0; l < n_x; l++) {
            double a = fx[i * n_x + l];
            for (int j = 0; a != 0 && j < n; j++) {
                out[i * n + j] += a * S[l * n + j];
            }
        }
        for (int j = 0; j < n_u; j++) {
            out[i * n + n_x + j] += fu[i * n_u + j];
        }
    }
}

void toy_step(const toy *t, const double *x, const double *u, double *x_next, double *A,
              double *B) {
    enum { MAX_S = TOY_MAX_X * (TOY_MAX_X + TOY_MAX_U) };
    static const double node[4] = {0, 0.5, 0.5, 1}, weight[4] = {1, 2, 2, 1};
    int n_x = t->problem.n_x, n_u = t->problem.n_u, n = n_x + n_u;
    double h = t->dt / t->substeps;
    double S[MAX_S] = {0}, point_S[MAX_S], slope_S[MAX_S], sum_S[MAX_S];
    double fx[TOY_MAX_X * TOY_MAX_X], fu[TOY_MAX_X * TOY_MAX_U];
    double now[TOY_MAX_X], point[TOY_MAX_X], slope[TOY_MAX_X], sum[TOY_MAX_X];
    memcpy(now, x, sizeof(double) * (size_t)n_x);
    for (int i = 0; i < n_x; i++) {
        S[i * n + i] = 1;
    }
    for (int step = 0; step < t->substeps; step++) {
        memset(slope, 0, sizeof slope);
        memset(sum, 0, sizeof sum);
        memset(slope_S, 0, sizeof slope_S);
        memset(sum_S, 0, sizeof sum_S);
        for (int stage = 0; stage < 4; stage++) {
            for (int i = 0; i < n_x; i++) {
                point[i] = now[i] + node[stage] * h * slope[i];
            }
            memset(fx, 0, sizeof fx);
            memset(fu, 0, sizeof fu);
            if (A != NULL) {
                for (int i = 0; i < n_x * n; i++) {
                    point_S[i] = S[i] + node[stage] * h * slope_S[i];
                }
            }
            t->rate(t, point, u, slope, fx, fu);
            for (int i = 0; i < n_x; i++) {
                sum[i] += weight[stage] * h / 6 * slope[i];
            }
            if (A != NULL) {
                apply(n_x, n, n_u, fx, fu, point_S, slope_S);
                for (int i = 0; i < n_x * n; i++) {
                    sum_S[i] += weight[stage] * h / 6 * slope_S[i];
                }
            }
        }
        for (int i = 0; i < n_x; i++) {
            now[i] += sum[i];
        }
        for (int i = 0; A != NULL && i < n_x * n; i++) {
            S[i] += sum_S[i];
        }
    }
    memcpy(x_next, now, sizeof(double) * (size_t)n_x);
    for (int i = 0; A != NULL && i < n_x; i++) {
        memcpy(A + i * n_x, S + i * n, sizeof(double) * (size_t)n_x);
        memcpy(B + i * n_u, S + i * n + n_x, sizeof(double) * (size_t)n_u);
    }
}

/* out [n_a x n_b] = a^T diag(w) b */
static void weighted_product(int n_r, int n_a, int n_b, const double *a, const double *b,
                             const double *w, double *out) {
    memset(out, 0, sizeof(double) * (size_t)(n_a * n_b));
    for (int r = 0; r < n_r; r++) {
        for (int i = 0; i < n_a; i++) {
            double scaled = w[r] * a[r * n_a + i];
            for (int j = 0; scaled != 0 && j < n_b; j++) {
                out[i * n_b + j] += scaled * b[r * n_b + j];
            }
        }
    }
}

static void evaluate_cost(const toy *t, int k, const double *x, const double *u,
                          const mhe_stage_values *out) {
    int n_x = t->problem.n_x, n_u = t->problem.n_u, n_r = u != NULL ? t->n_r : t->n_r_last;
    double r[TOY_MAX_R], w[TOY_MAX_R];
    static _Thread_local double rx[TOY_MAX_R * TOY_MAX_X], ru[TOY_MAX_R * TOY_MAX_U];
    memset(rx, 0, sizeof rx);
    memset(ru, 0, sizeof ru);
    t->residual(t, k, x, u, r, w, rx, ru);
    if (out->cost != NULL) {
        double one = 0;
        weighted_product(n_r, 1, 1, r, r, w, &one);
        *out->cost = x[0] > t->nan_above ? NAN : one / 2;
    }
    if (out->grad_x != NULL) {
        weighted_product(n_r, n_x, 1, rx, r, w, out->grad_x);
    }
    if (out->hess_xx != NULL) {
        weighted_product(n_r, n_x, n_x, rx, rx, w, out->hess_xx);
    }
    if (u != NULL && out->grad_u != NULL) {
        weighted_product(n_r, n_u, 1, ru, r, w, out->grad_u);
    }
    if (u != NULL && out->hess_uu != NULL) {
        weighted_product(n_r, n_u, n_u, ru, ru, w, out->hess_uu);
    }
    if (u != NULL && out->hess_ux != NULL) {
        weighted_product(n_r, n_u, n_x, ru, rx, w, out->hess_ux);
    }
}

static mhe_status evaluate(const mhe_stage_problem *problem, int32_t worker, int32_t k,
                           const double *x, const double *u, const mhe_stage_values *out,
                           mhe_error *err) {
    toy *t = problem->data;
    (void)worker;
    t->evaluations++;
    t->linearisations += out->grad_x != NULL || out->A != NULL;
    t->steps += out->x_next != NULL;
    if (t->failure != MHE_OK) {
        return mhe_fail(err, t->failure, "the toy was told to fail at node %d", (int)k);
    }
    if (x[0] > t->retry_above) {
        t->retries++;
        return MHE_RETRY;
    }
    evaluate_cost(t, k, x, u, out);
    if (u != NULL && out->x_next != NULL) {
        toy_step(t, x, u, out->x_next, out->A, out->B);
    }
    return MHE_OK;
}

void toy_init(toy *t, int n_intervals, int n_x, int n_u, double dt, int substeps, toy_rate rate,
              toy_residual residual, int n_r, int n_r_last) {
    size_t n_xs = (size_t)((n_intervals + 1) * n_x), n_us = (size_t)(n_intervals * n_u);
    size_t n_pattern = (size_t)((n_x + n_u) * (n_x + n_u));
    *t = (toy){.rate = rate,
               .residual = residual,
               .n_r = n_r,
               .n_r_last = n_r_last,
               .dt = dt,
               .substeps = substeps,
               .retry_above = INFINITY,
               .nan_above = INFINITY};
    t->bounds = malloc(sizeof(double) * 2 * (n_xs + n_us));
    t->pattern = malloc(n_pattern);
    if (t->bounds == NULL || t->pattern == NULL) {
        abort();
    }
    memset(t->pattern, 1, n_pattern);
    for (size_t i = 0; i < n_xs + n_us; i++) {
        t->bounds[i] = -INFINITY;
        t->bounds[n_xs + n_us + i] = INFINITY;
    }
    t->problem = (mhe_stage_problem){.size = sizeof t->problem,
                                     .n_intervals = n_intervals,
                                     .n_x = n_x,
                                     .n_u = n_u,
                                     .n_workers = 1,
                                     .x_lower = t->bounds,
                                     .u_lower = t->bounds + n_xs,
                                     .x_upper = t->bounds + n_xs + n_us,
                                     .u_upper = t->bounds + 2 * n_xs + n_us,
                                     .A_pattern = t->pattern,
                                     .B_pattern = t->pattern,
                                     .xx_pattern = t->pattern,
                                     .ux_pattern = t->pattern,
                                     .uu_pattern = t->pattern,
                                     .data = t,
                                     .evaluate = evaluate};
}

void toy_free(toy *t) {
    free(t->bounds);
    free(t->pattern);
}

double *toy_x_lower(toy *t, int k) {
    return t->bounds + k * t->problem.n_x;
}

double *toy_u_lower(toy *t, int k) {
    return t->bounds + (t->problem.n_intervals + 1) * t->problem.n_x + k * t->problem.n_u;
}

static ptrdiff_t upper_offset(const toy *t) {
    int N = t->problem.n_intervals;
    return (N + 1) * t->problem.n_x + N * t->problem.n_u;
}

double *toy_x_upper(toy *t, int k) {
    return toy_x_lower(t, k) + upper_offset(t);
}

double *toy_u_upper(toy *t, int k) {
    return toy_u_lower(t, k) + upper_offset(t);
}
