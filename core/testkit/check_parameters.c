/* SPDX-License-Identifier: Apache-2.0 */
/* check_parameters.c: global parameters of a stage problem: a line of points that a drift p_0 moves
 * and an offset p_1 is measured with. Linear, so the optimality conditions of solver.h decide. */
#include "dense_covariance.h"
#include "kit.h"

#include <math.h>
#include <mhe/solver.h>
#include <string.h>

#define N 8
#define DT 0.25
#define WEIGHT_X 10.0 /* of x + p_1 - target */
#define WEIGHT_U 0.5  /* of u - p_0 / 2 */
#define WEIGHT_P 0.05 /* of p, at node 0 */
#define LARGEST_P 0.4 /* of p_1 */

typedef struct line {
    double x_lower[N + 1], x_upper[N + 1], u_lower[N], u_upper[N], p_lower[2], p_upper[2];
    double p[2]; /* set_parameters() */
} line;

typedef struct iterate {
    double x[N + 1], u[N], p[2], lambda[N];
    double zx_lower[N + 1], zx_upper[N + 1], zu_lower[N], zu_upper[N], zp_lower[2], zp_upper[2];
} iterate;

static double target(int32_t k) {
    return 1 + 0.3 * k + (k % 2 == 0 ? 0.1 : -0.1);
}

static void put(double *out, const double *values, size_t n) {
    if (out != NULL) {
        memcpy(out, values, n * sizeof *out);
    }
}

static mhe_status set_parameters(const mhe_stage_problem *problem, const double *p,
                                 mhe_error *err) {
    line *l = problem->data;
    (void)err;
    memcpy(l->p, p, sizeof l->p);
    return MHE_OK;
}

static mhe_status evaluate(const mhe_stage_problem *problem, int32_t worker, int32_t k,
                           const double *x, const double *u, const mhe_stage_values *out,
                           mhe_error *err) {
    const line *l = problem->data;
    (void)worker, (void)err;
    const double first = k == 0 ? WEIGHT_P : 0, with_u = u != NULL ? WEIGHT_U : 0;
    const double off = x[0] + l->p[1] - target(k), slack = u != NULL ? u[0] - 0.5 * l->p[0] : 0;
    const double grad_x = WEIGHT_X * off, hess_xx = WEIGHT_X;
    const double grad_p[2] = {first * l->p[0] - 0.5 * with_u * slack,
                              first * l->p[1] + WEIGHT_X * off};
    const double hess_px[2] = {0, WEIGHT_X};
    const double hess_pp[4] = {first + 0.25 * with_u, 0, 0, first + WEIGHT_X};
    const double cost = 0.5 * (WEIGHT_X * off * off + with_u * slack * slack +
                               first * (l->p[0] * l->p[0] + l->p[1] * l->p[1]));
    put(out->cost, &cost, 1);
    put(out->grad_x, &grad_x, 1);
    put(out->hess_xx, &hess_xx, 1);
    put(out->grad_p, grad_p, 2);
    put(out->hess_px, hess_px, 2);
    put(out->hess_pp, hess_pp, 4);
    if (u != NULL) {
        const double grad_u = WEIGHT_U * slack, hess_uu = WEIGHT_U, hess_ux = 0, one = 1, dt = DT;
        const double hess_pu[2] = {-0.5 * WEIGHT_U, 0}, P[2] = {DT, 0};
        const double next = x[0] + DT * (u[0] + l->p[0]);
        put(out->grad_u, &grad_u, 1);
        put(out->hess_uu, &hess_uu, 1);
        put(out->hess_ux, &hess_ux, 1);
        put(out->hess_pu, hess_pu, 2);
        put(out->x_next, &next, 1);
        put(out->A, &one, 1);
        put(out->B, &dt, 1);
        put(out->P, P, 2);
    }
    return MHE_OK;
}

static void add(double *worst, double value) {
    *worst = value > *worst || isnan(value) ? value : *worst;
}

/* Slope of the Lagrangian without bounds in one variable, which lies between them. */
static void add_variable(double worst[2], double w, double lower, double upper, double slope,
                         double z_lower, double z_upper) {
    add(&worst[1], fmax(lower - w, w - upper));
    if (lower != upper) {
        add(&worst[0], fabs(slope - z_lower + z_upper));
        add(&worst[1], fmax(-z_lower, -z_upper));
        add(&worst[1], isfinite(lower) ? z_lower * (w - lower) : z_lower);
        add(&worst[1], isfinite(upper) ? z_upper * (upper - w) : z_upper);
    }
}

/* Largest violations: of stationarity; of dynamics, bounds, signs and complementarity. */
static void conditions(const mhe_stage_problem *problem, const iterate *w, double worst[2]) {
    double slope_p[2] = {0, 0};
    (void)set_parameters(problem, w->p, NULL);
    for (int32_t k = 0; k <= N; k++) {
        double grad_x = 0, grad_u = 0, grad_p[2], next = 0;
        const double ahead = k < N ? w->lambda[k] : 0, behind = k > 0 ? w->lambda[k - 1] : 0;
        const mhe_stage_values out = {.size = sizeof out,
                                      .grad_x = &grad_x,
                                      .grad_u = &grad_u,
                                      .grad_p = grad_p,
                                      .x_next = &next};
        (void)evaluate(problem, 0, k, &w->x[k], k < N ? &w->u[k] : NULL, &out, NULL);
        add_variable(worst, w->x[k], problem->x_lower[k], problem->x_upper[k],
                     grad_x + behind - ahead, w->zx_lower[k], w->zx_upper[k]);
        slope_p[0] += grad_p[0] - DT * ahead;
        slope_p[1] += grad_p[1];
        if (k < N) {
            add(&worst[1], fabs(w->x[k + 1] - next));
            add_variable(worst, w->u[k], problem->u_lower[k], problem->u_upper[k],
                         grad_u - DT * ahead, w->zu_lower[k], w->zu_upper[k]);
        }
    }
    for (int32_t i = 0; i < 2; i++) {
        add_variable(worst, w->p[i], problem->p_lower[i], problem->p_upper[i], slope_p[i],
                     w->zp_lower[i], w->zp_upper[i]);
    }
}

static void check_covariance(mhi_kit *kit, const mhe_solver_ops *ops, void *self,
                             const mhe_stage_problem *problem, const mhe_solution *at) {
    const char *check = "parameters: covariance against a dense inverse";
    mhe_error err = {0};
    mhi_dense dense;
    if (ops->covariance == NULL) {
        return;
    }
    if (!mhi_dense_make(problem, at, &dense) || dense.n_gone_p != 1) {
        mhi_kit_fail(kit, check, "the dense system is singular, or no parameter at its bound");
    } else {
        const double worst = mhi_dense_compare(&dense, ops, self, &err);
        if (isnan(worst)) {
            mhi_kit_fail(kit, check, "%s", err.text);
        } else {
            (void)mhi_kit_limit(kit, check, worst, 1e-6);
        }
    }
    mhi_dense_free(&dense);
}

static void check_solve(mhi_kit *kit, const mhe_solver_ops *ops, void *self,
                        const mhe_stage_problem *problem) {
    const char *check = "parameters: solve";
    iterate w = {0};
    mhe_solution at = {.size = sizeof at,
                       .x = w.x,
                       .u = w.u,
                       .lambda = w.lambda,
                       .zx_lower = w.zx_lower,
                       .zx_upper = w.zx_upper,
                       .zu_lower = w.zu_lower,
                       .zu_upper = w.zu_upper,
                       .p = w.p,
                       .zp_lower = w.zp_lower,
                       .zp_upper = w.zp_upper};
    for (int32_t warm = 0; warm < 2; warm++) {
        mhe_solve_info info = {.size = sizeof info};
        mhe_error err = {0};
        double worst[2] = {0, 0};
        const mhe_status status = ops->solve(self, NULL, &at, &info, &err);
        if (status != MHE_OK || info.outcome != MHE_SOLVE_CONVERGED) {
            mhi_kit_fail(kit, check, "status %d, outcome %d: %s", (int)status, (int)info.outcome,
                         err.text);
            return;
        }
        mhi_kit_pass(kit, check);
        conditions(problem, &w, worst);
        (void)mhi_kit_limit(kit, "parameters: stationarity with the multipliers", worst[0], 1e-5);
        (void)mhi_kit_limit(kit, "parameters: dynamics, bounds, complementarity", worst[1], 1e-5);
        if (!(fabs(w.p[1] - LARGEST_P) < 1e-4 && fabs(w.p[0]) > 1e-2)) {
            mhi_kit_fail(kit, check, "p = %g, %g; one is to be at its bound", w.p[0], w.p[1]);
        }
    }
    check_covariance(kit, ops, self, problem, &at);
}

void mhi_check_parameters(mhi_kit *kit) {
    static const uint8_t one[] = {1}, none[] = {0};
    static const double infinite = INFINITY;
    line l = {.p_lower = {-infinite, -LARGEST_P}, .p_upper = {infinite, LARGEST_P}};
    for (int32_t k = 0; k <= N; k++) {
        l.x_lower[k] = k == 0 ? 0 : -infinite;
        l.x_upper[k] = k == 0 ? 0 : infinite;
        l.u_lower[k < N ? k : 0] = -infinite;
        l.u_upper[k < N ? k : 0] = infinite;
    }
    const mhe_solver_ops *ops = kit->plugin->ops;
    const mhe_stage_problem problem = {.size = sizeof problem,
                                       .n_intervals = N,
                                       .n_x = 1,
                                       .n_u = 1,
                                       .n_workers = 1,
                                       .x_lower = l.x_lower,
                                       .x_upper = l.x_upper,
                                       .u_lower = l.u_lower,
                                       .u_upper = l.u_upper,
                                       .A_pattern = one,
                                       .B_pattern = one,
                                       .xx_pattern = one,
                                       .ux_pattern = none,
                                       .uu_pattern = one,
                                       .data = &l,
                                       .evaluate = evaluate,
                                       .n_p = 2,
                                       .p_lower = l.p_lower,
                                       .p_upper = l.p_upper,
                                       .set_parameters = set_parameters};
    mhe_error err = {0};
    void *self = NULL;
    if (ops->accepts == NULL) {
        mhi_kit_note(kit, "parameters", "it solves problems without parameters only");
        return;
    }
    mhe_status status = ops->accepts(&problem, kit->config, &err);
    if (status != MHE_OK) { /* its right, if it says why */
        if (status > 0 || err.text[0] == '\0') {
            mhi_kit_fail(kit, "parameters", "refused with status %d and no reason", (int)status);
        } else {
            mhi_kit_note(kit, "parameters", "refuses them: %s", err.text);
        }
        return;
    }
    status = ops->create(&kit->host, &problem, kit->config, &self, &err);
    if (status != MHE_OK) {
        mhi_kit_fail(kit, "parameters: create", "status %d: %s", (int)status, err.text);
        return;
    }
    check_solve(kit, ops, self, &problem);
    ops->destroy(self);
}
