/* SPDX-License-Identifier: Apache-2.0 */
/* check_solver.c: a cart (double integrator) that is to reach a place, with a thruster too weak to
 * do it freely: linear dynamics, quadratic cost, active bounds, so the optimality conditions of
 * solver.h decide alone. */
#include "dense_covariance.h"
#include "kit.h"

#include <math.h>
#include <mhe/solver.h>
#include <string.h>
#include <time.h>

#define N 10
#define N_X 2
#define DT 0.1
#define SPEED_LIMIT 0.8
#define FORCE_LIMIT 2.0

static const double target = 1.0;
static const double weight_x[N_X] = {20.0, 0.1}, weight_u = 0.02;
static const double dynamics_A[N_X * N_X] = {1.0, DT, 0.0, 1.0};
static const double dynamics_B[N_X] = {0.5 * DT * DT, DT};

typedef struct cart {
    double x_lower[(N + 1) * N_X], x_upper[(N + 1) * N_X], u_lower[N], u_upper[N];
    mhe_status refuse; /* what evaluate() is to return */
} cart;

static void put(double *out, const double *values, int n) {
    if (out != NULL) {
        memcpy(out, values, sizeof *out * (size_t)n);
    }
}

static mhe_status evaluate(const mhe_stage_problem *problem, int32_t worker, int32_t k,
                           const double *x, const double *u, const mhe_stage_values *out,
                           mhe_error *err) {
    const cart *c = problem->data;
    (void)worker;
    if (c->refuse != MHE_OK) {
        return mhe_fail(err, c->refuse, "the test asked for it");
    }
    const double off = x[0] - target;
    const double grad_x[N_X] = {weight_x[0] * off, weight_x[1] * x[1]};
    const double hess_xx[N_X * N_X] = {weight_x[0], 0, 0, weight_x[1]};
    double cost = 0.5 * (weight_x[0] * off * off + weight_x[1] * x[1] * x[1]);
    put(out->grad_x, grad_x, N_X);
    put(out->hess_xx, hess_xx, N_X * N_X);
    if (k < N) {
        const double grad_u = weight_u * u[0], zeros[N_X] = {0, 0};
        double next[N_X];
        for (int i = 0; i < N_X; i++) {
            next[i] =
                dynamics_A[2 * i] * x[0] + dynamics_A[2 * i + 1] * x[1] + dynamics_B[i] * u[0];
        }
        cost += 0.5 * weight_u * u[0] * u[0];
        put(out->grad_u, &grad_u, 1);
        put(out->hess_ux, zeros, N_X);
        put(out->hess_uu, &weight_u, 1);
        put(out->x_next, next, N_X);
        put(out->A, dynamics_A, N_X * N_X);
        put(out->B, dynamics_B, N_X);
    }
    put(out->cost, &cost, 1);
    return MHE_OK;
}

/* First state fixed, speed and force limited. */
static void set_bounds(cart *c, double start) {
    for (int k = 0; k <= N; k++) {
        c->x_lower[2 * k] = -INFINITY;
        c->x_upper[2 * k] = INFINITY;
        c->x_lower[2 * k + 1] = -SPEED_LIMIT;
        c->x_upper[2 * k + 1] = SPEED_LIMIT;
    }
    c->x_lower[0] = c->x_upper[0] = start;
    c->x_lower[1] = c->x_upper[1] = 0.0;
    for (int k = 0; k < N; k++) {
        c->u_lower[k] = -FORCE_LIMIT;
        c->u_upper[k] = FORCE_LIMIT;
    }
}

typedef struct iterate {
    double x[(N + 1) * N_X], u[N], lambda[N * N_X];
    double zx_lower[(N + 1) * N_X], zx_upper[(N + 1) * N_X], zu_lower[N], zu_upper[N];
} iterate;

static mhe_solution view(iterate *w, int32_t has_multipliers) {
    return (mhe_solution){.size = sizeof(mhe_solution),
                          .has_multipliers = has_multipliers,
                          .x = w->x,
                          .u = w->u,
                          .lambda = w->lambda,
                          .zx_lower = w->zx_lower,
                          .zx_upper = w->zx_upper,
                          .zu_lower = w->zu_lower,
                          .zu_upper = w->zu_upper};
}

/* ---- optimality conditions, with the signs of solver.h ---- */

typedef struct kkt {
    double stationarity, dynamics, bounds, complementarity, sign;
} kkt;

static void add(double *worst, double value) {
    *worst = value > *worst || isnan(value) ? value : *worst;
}

/* One variable between its bounds; `slope` is dL/dw without the bounds' multipliers. */
static void add_variable(kkt *r, double w, double lower, double upper, double slope, double z_lower,
                         double z_upper) {
    add(&r->bounds, fmax(lower - w, w - upper));
    if (lower == upper) {
        return; /* fixed: any slope is borne */
    }
    add(&r->stationarity, fabs(slope - z_lower + z_upper));
    add(&r->sign, fmax(-z_lower, -z_upper));
    add(&r->complementarity, isfinite(lower) ? z_lower * (w - lower) : z_lower);
    add(&r->complementarity, isfinite(upper) ? z_upper * (upper - w) : z_upper);
}

static kkt conditions(const mhe_stage_problem *problem, const iterate *w) {
    kkt r = {0};
    for (int k = 0; k <= N; k++) {
        const double *x = &w->x[N_X * k];
        double grad_x[N_X], grad_u = 0, next[N_X];
        const mhe_stage_values out = {
            .size = sizeof out, .grad_x = grad_x, .grad_u = &grad_u, .x_next = next};
        (void)evaluate(problem, 0, k, x, k < N ? &w->u[k] : NULL, &out, NULL);
        const double *ahead = k < N ? &w->lambda[N_X * k] : NULL;
        for (int i = 0; i < N_X; i++) {
            double slope = grad_x[i] + (k > 0 ? w->lambda[N_X * (k - 1) + i] : 0.0);
            if (ahead != NULL) {
                slope -= dynamics_A[i] * ahead[0] + dynamics_A[N_X + i] * ahead[1];
                add(&r.dynamics, fabs(x[N_X + i] - next[i]));
            }
            const int at = N_X * k + i;
            add_variable(&r, x[i], problem->x_lower[at], problem->x_upper[at], slope,
                         w->zx_lower[at], w->zx_upper[at]);
        }
        if (ahead != NULL) {
            const double slope = grad_u - dynamics_B[0] * ahead[0] - dynamics_B[1] * ahead[1];
            add_variable(&r, w->u[k], problem->u_lower[k], problem->u_upper[k], slope,
                         w->zu_lower[k], w->zu_upper[k]);
        }
    }
    return r;
}

/* Asked for 1e-8 where the plugin has a tolerance; the solver may scale its own measure, which
 * costs at most two digits here. */
static void check_conditions(mhi_kit *kit, const mhe_stage_problem *problem, const iterate *w) {
    const double limit = 1e-5;
    const kkt r = conditions(problem, w);
    (void)mhi_kit_limit(kit, "x[k+1] = F(x[k], u[k])", r.dynamics, limit);
    (void)mhi_kit_limit(kit, "bounds are kept", r.bounds, limit);
    (void)mhi_kit_limit(kit, "stationarity with the multipliers", r.stationarity, limit);
    (void)mhi_kit_limit(kit, "multipliers of bounds are not negative", r.sign, limit);
    (void)mhi_kit_limit(kit, "complementarity", r.complementarity, limit);
    int active = 0;
    for (int k = 0; k < N; k++) {
        active += fabs(w->u[k]) > FORCE_LIMIT - 1e-4;
    }
    if (active == 0) {
        mhi_kit_fail(kit, "bounds are active", "no force is at its bound");
    } else {
        mhi_kit_pass(kit, "bounds are active");
    }
}

/* ---- solves ---- */

typedef struct solver_case {
    const mhe_solver_ops *ops;
    void *self;
    const mhe_stage_problem *problem;
} solver_case;

static int solve(mhi_kit *kit, solver_case *s, const mhe_solve_control *control, iterate *w,
                 int32_t warm, mhe_solve_info *info, const char *check) {
    mhe_error err = {0};
    mhe_solution solution = view(w, warm);
    *info = (mhe_solve_info){.size = sizeof *info};
    const mhe_status status = s->ops->solve(s->self, control, &solution, info, &err);
    if (status != MHE_OK) {
        mhi_kit_fail(kit, check, "status %d: %s", (int)status, err.text);
        return 0;
    }
    if (solution.x != w->x || solution.u != w->u) {
        mhi_kit_fail(kit, check, "the caller's pointers were changed");
        return 0;
    }
    return 1;
}

static int converged(mhi_kit *kit, const mhe_solve_info *info, const char *check) {
    if (info->outcome != MHE_SOLVE_CONVERGED) {
        mhi_kit_fail(kit, check, "outcome %d after %d iterations", (int)info->outcome,
                     (int)info->iterations);
        return 0;
    }
    mhi_kit_pass(kit, check);
    return 1;
}

static int32_t stop_at_once(void *data, int32_t iteration, double objective, double kkt_residual) {
    (void)iteration, (void)objective, (void)kkt_residual;
    (*(int *)data)++;
    return 1;
}

/* A deadline in the past and a caller who says stop: an iterate of numbers, and the reason. */
static void check_limits(mhi_kit *kit, solver_case *s) {
    int calls = 0;
    mhe_solve_info info;
    iterate w = {0};
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    const mhe_solve_control late = {.size = sizeof late, .deadline = (double)now.tv_sec - 1.0};
    const mhe_solve_control stop = {.size = sizeof stop, .data = &calls, .progress = stop_at_once};
    if (solve(kit, s, &late, &w, 0, &info, "deadline")) {
        const int good = info.outcome == MHE_SOLVE_DEADLINE && isfinite(w.x[2 * N]);
        if (good) {
            mhi_kit_pass(kit, "deadline");
        } else {
            mhi_kit_fail(kit, "deadline", "outcome %d, x %g", (int)info.outcome, w.x[2 * N]);
        }
    }
    w = (iterate){0};
    if (solve(kit, s, &stop, &w, 0, &info, "interruption")) {
        if (info.outcome == MHE_SOLVE_INTERRUPTED && calls > 0) {
            mhi_kit_pass(kit, "interruption");
        } else {
            mhi_kit_fail(kit, "interruption", "outcome %d, %d calls of progress()",
                         (int)info.outcome, calls);
        }
    }
}

/* An evaluate() that gives up must not look like success. */
static void check_refusal(mhi_kit *kit, solver_case *s, cart *c) {
    iterate w = {0};
    mhe_solution solution = view(&w, 0);
    mhe_solve_info info = {.size = sizeof info};
    c->refuse = MHE_E_NUMERIC;
    const mhe_status status = s->ops->solve(s->self, NULL, &solution, &info, NULL);
    c->refuse = MHE_OK;
    if (status < 0 || (status == MHE_OK && info.outcome != MHE_SOLVE_CONVERGED)) {
        mhi_kit_pass(kit, "a failing evaluate() is no success");
    } else {
        mhi_kit_fail(kit, "a failing evaluate() is no success", "status %d, outcome %d",
                     (int)status, (int)info.outcome);
    }
}

/* From a start so near that the way is not all bounds; a solver that has none says so by NULL. */
static void check_covariance(mhi_kit *kit, solver_case *s, cart *c) {
    const char *check = "covariance against a dense inverse";
    iterate w = {0};
    mhe_solve_info info;
    mhe_error err = {0};
    mhi_dense dense;
    if (s->ops->covariance == NULL) {
        mhi_kit_note(kit, check, "none can be had");
        return;
    }
    set_bounds(c, 0.75);
    if (!solve(kit, s, NULL, &w, 0, &info, check)) {
        return;
    }
    const mhe_solution at = view(&w, 1);
    if (!mhi_dense_make(s->problem, &at, &dense)) {
        mhi_kit_fail(kit, check, "the dense system is singular");
    } else if (dense.n_gone_u == 0) {
        mhi_kit_fail(kit, check, "no force is at its bound");
    } else {
        const double worst = mhi_dense_compare(&dense, s->ops, s->self, &err);
        if (isnan(worst)) {
            mhi_kit_fail(kit, check, "%s", err.text);
        } else {
            (void)mhi_kit_limit(kit, check, worst, 1e-4); /* bounds of later states may be held */
        }
    }
    mhi_dense_free(&dense);
}

static void check_solves(mhi_kit *kit, solver_case *s, cart *c) {
    mhe_solve_info first, second;
    iterate w = {0}, again = {0};
    if (!solve(kit, s, NULL, &w, 0, &first, "solve") || !converged(kit, &first, "solve")) {
        return;
    }
    check_conditions(kit, s->problem, &w);
    if (solve(kit, s, NULL, &again, 0, &second, "same bits twice")) {
        if (memcmp(&w, &again, sizeof w) == 0 && first.iterations == second.iterations) {
            mhi_kit_pass(kit, "same bits twice");
        } else {
            mhi_kit_fail(kit, "same bits twice", "a second solve gave another result");
        }
    }
    if (solve(kit, s, NULL, &again, 1, &second, "warm start") &&
        converged(kit, &second, "warm start") && second.iterations > first.iterations) {
        mhi_kit_note(kit, "warm start", "%d iterations, a cold start %d", (int)second.iterations,
                     (int)first.iterations);
    }
    check_limits(kit, s);
    check_refusal(kit, s, c);
    set_bounds(c, 0.2); /* read anew at every solve */
    if (solve(kit, s, NULL, &w, 1, &second, "moved bounds") &&
        converged(kit, &second, "moved bounds")) {
        check_conditions(kit, s->problem, &w);
        (void)mhi_kit_limit(kit, "the first state is where its bounds are", fabs(w.x[0] - 0.2),
                            1e-6);
    }
    check_covariance(kit, s, c);
}

void mhi_check_solver(mhi_kit *kit) {
    static const uint8_t A[] = {1, 1, 0, 1}, B[] = {1, 1}, xx[] = {1, 0, 0, 1}, ux[] = {0, 0},
                         uu[] = {1};
    cart c = {.refuse = MHE_OK};
    set_bounds(&c, 0.0);
    const mhe_stage_problem problem = {.size = sizeof problem,
                                       .n_intervals = N,
                                       .n_x = N_X,
                                       .n_u = 1,
                                       .n_workers = 1,
                                       .x_lower = c.x_lower,
                                       .x_upper = c.x_upper,
                                       .u_lower = c.u_lower,
                                       .u_upper = c.u_upper,
                                       .A_pattern = A,
                                       .B_pattern = B,
                                       .xx_pattern = xx,
                                       .ux_pattern = ux,
                                       .uu_pattern = uu,
                                       .data = &c,
                                       .evaluate = evaluate};
    mhi_kit_set_number(kit, "tolerance", 1e-8);
    mhi_kit_set_number(kit, "max_iterations", 200);
    solver_case s = {.ops = kit->plugin->ops, .problem = &problem};
    mhe_error err = {0};
    const mhe_status status = s.ops->create(&kit->host, &problem, kit->config, &s.self, &err);
    if (status != MHE_OK) {
        mhi_kit_fail(kit, "create", "status %d: %s", (int)status, err.text);
        return;
    }
    check_solves(kit, &s, &c);
    s.ops->destroy(s.self);
    mhi_check_parameters(kit);
}
