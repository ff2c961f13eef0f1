/* SPDX-License-Identifier: Apache-2.0 */
#include "solver_rig.h"
#include "use.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#ifndef RIG_SOLVER /* tests of other solvers say which */
#define RIG_SOLVER "mhe.solver.ipopt"
#endif

/* All values of an iterate: x and its two multipliers, u and its two, lambda. */
static int size_of(const toy *t) {
    int N = t->problem.n_intervals, n_x = t->problem.n_x, n_u = t->problem.n_u;
    return 3 * ((N + 1) * n_x + N * n_u) + N * n_x;
}

mhe_status rig_open(rig *r, toy *t, const char *yaml) {
    *r = (rig){.t = t};
    const mhe_plugin *plugin = test_plugin(RIG_SOLVER, MHE_SOLVER_IFACE);
    r->memory = calloc((size_t)size_of(t), sizeof(double));
    assert_non_null(plugin);
    assert_non_null(r->memory);
    rig_reset(r);
    r->ops = plugin->ops;
    return r->ops->create(test_host(), &t->problem, test_config(plugin, yaml), &r->solver,
                          &r->error);
}

void rig_close(rig *r) {
    if (r->solver != NULL) {
        r->ops->destroy(r->solver);
    }
    free(r->memory);
}

void rig_open_pendulum(rig *r, toy *t, int n_intervals, const char *yaml) {
    toy_pendulum(t, n_intervals);
    assert_int_equal(rig_open(r, t, yaml), MHE_OK);
}

void rig_close_both(rig *r, toy *t) {
    rig_close(r);
    toy_free(t);
}

void rig_reset(rig *r) {
    const mhe_stage_problem *p = &r->t->problem;
    int n_xs = (p->n_intervals + 1) * p->n_x, n_us = p->n_intervals * p->n_u;
    memset(r->memory, 0, sizeof(double) * (size_t)size_of(r->t));
    r->at = (mhe_solution){.size = sizeof r->at,
                           .x = r->memory,
                           .zx_lower = r->memory + n_xs,
                           .zx_upper = r->memory + 2 * n_xs,
                           .u = r->memory + 3 * n_xs,
                           .zu_lower = r->memory + 3 * n_xs + n_us,
                           .zu_upper = r->memory + 3 * n_xs + 2 * n_us,
                           .lambda = r->memory + 3 * n_xs + 3 * n_us};
}

mhe_status rig_solve(rig *r, const mhe_solve_control *control) {
    r->info = (mhe_solve_info){.size = sizeof r->info};
    return r->ops->solve(r->solver, control, &r->at, &r->info, &r->error);
}

static void shift(double *rows, int n_rows, int n) {
    memmove(rows, rows + n, sizeof(double) * (size_t)((n_rows - 1) * n));
}

void rig_shift(rig *r) {
    const mhe_stage_problem *p = &r->t->problem;
    int N = p->n_intervals;
    double *of_x[] = {r->at.x, r->at.zx_lower, r->at.zx_upper};
    double *of_u[] = {r->at.u, r->at.zu_lower, r->at.zu_upper};
    for (int i = 0; i < 3; i++) {
        shift(of_x[i], N + 1, p->n_x);
        shift(of_u[i], N, p->n_u);
    }
    shift(r->at.lambda, N, p->n_x);
    memcpy(toy_x_lower(r->t, 0), r->at.x, sizeof(double) * (size_t)p->n_x);
    memcpy(toy_x_upper(r->t, 0), r->at.x, sizeof(double) * (size_t)p->n_x);
}

/* Bounds and their multipliers of n variables, whose Lagrangian without bounds has this slope. */
static void check_variables(rig_kkt *kkt, int n, const double *v, const double *lower,
                            const double *upper, const double *z_lower, const double *z_upper,
                            const double *slope, double scale) {
    for (int i = 0; i < n; i++) {
        double off = fabs(slope[i] - z_lower[i] + z_upper[i]) / scale;
        kkt->stationarity = fmax(kkt->stationarity, off);
        kkt->primal = fmax(kkt->primal, fmax(lower[i] - v[i], v[i] - upper[i]));
        kkt->dual = fmax(kkt->dual, fmax(-z_lower[i], -z_upper[i]));
        if (isfinite(lower[i])) {
            kkt->complementarity = fmax(kkt->complementarity, z_lower[i] * (v[i] - lower[i]));
        }
        if (isfinite(upper[i])) {
            kkt->complementarity = fmax(kkt->complementarity, z_upper[i] * (upper[i] - v[i]));
        }
        if ((isinf(lower[i]) && z_lower[i] != 0) || (isinf(upper[i]) && z_upper[i] != 0)) {
            kkt->dual = INFINITY;
        }
    }
}

rig_kkt rig_check(const rig *r) {
    toy *t = r->t;
    const mhe_stage_problem *p = &t->problem;
    int N = p->n_intervals, n_x = p->n_x, n_u = p->n_u;
    double next[TOY_MAX_X], A[TOY_MAX_X * TOY_MAX_X], B[TOY_MAX_X * TOY_MAX_U];
    double by_x[TOY_MAX_X], by_u[TOY_MAX_U];
    mhe_stage_values out = {
        .size = sizeof out, .grad_x = by_x, .grad_u = by_u, .x_next = next, .A = A, .B = B};
    rig_kkt kkt = {0};
    for (int k = 0; k <= N; k++) {
        const double *x = r->at.x + k * n_x, *u = k < N ? r->at.u + k * n_u : NULL;
        const double *lambda = r->at.lambda + k * n_x;
        if (p->evaluate(p, 0, k, x, u, &out, NULL) != MHE_OK) {
            return (rig_kkt){INFINITY, INFINITY, INFINITY, INFINITY};
        }
        double scale = 1;
        for (int i = 0; i < n_x; i++) {
            scale = fmax(scale, 1 + fabs(by_x[i]));
        }
        for (int i = 0; i < n_x; i++) {
            by_x[i] += k > 0 ? lambda[i - n_x] : 0;
            for (int j = 0; k < N && j < n_x; j++) {
                by_x[i] -= A[j * n_x + i] * lambda[j];
            }
            kkt.primal = k < N ? fmax(kkt.primal, fabs(x[n_x + i] - next[i])) : kkt.primal;
        }
        check_variables(&kkt, n_x, x, toy_x_lower(t, k), toy_x_upper(t, k),
                        r->at.zx_lower + k * n_x, r->at.zx_upper + k * n_x, by_x, scale);
        for (int i = 0; k < N && i < n_u; i++) {
            for (int j = 0; j < n_x; j++) {
                by_u[i] -= B[j * n_u + i] * lambda[j];
            }
        }
        if (k < N) {
            check_variables(&kkt, n_u, u, toy_u_lower(t, k), toy_u_upper(t, k),
                            r->at.zu_lower + k * n_u, r->at.zu_upper + k * n_u, by_u, scale);
        }
    }
    return kkt;
}
