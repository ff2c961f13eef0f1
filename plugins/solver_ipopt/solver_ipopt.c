/* SPDX-License-Identifier: Apache-2.0 */
/* solver_ipopt: the stage problem by Ipopt's interior-point method with a Gauss-Newton Hessian.
 * Source: Waechter and Biegler (2006), Math. Program. 106, doi:10.1007/s10107-004-0559-y. */
#include "ipopt_solver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const mhe_option ipopt_options[] = {
    MHE_OPT_REAL(struct ipopt_config, tolerance, 1e-4, 1e-12, 1, "1",
                 "Largest scaled violation of the optimality conditions of a converged solve."),
    MHE_OPT_INT(struct ipopt_config, max_iterations, 15, 1, 100000, "1",
                "Iterations after which a solve stops with what it has."),
    MHE_OPT_REAL(struct ipopt_config, acceptable_tolerance, 1e-3, 1e-12, 1e3, "1",
                 "Violation that counts as converged after acceptable_iterations in a row."),
    MHE_OPT_INT(struct ipopt_config, acceptable_iterations, 0, 0, 1000, "1",
                "Iterations within acceptable_tolerance that end a solve; 0: never."),
    MHE_OPT_ENUM(struct ipopt_config, mu_strategy, "auto", "auto|adaptive|monotone",
                 "How the barrier parameter is lowered; auto: monotone after a start with "
                 "multipliers, else adaptive."),
    MHE_OPT_REAL(struct ipopt_config, mu_init_warm, 3e-7, 1e-12, 1e3, "1",
                 "First barrier parameter of a monotone solve that starts with multipliers."),
    MHE_OPT_REAL(struct ipopt_config, objective_scale, 0, 0, 1e12, "1",
                 "Factor on the objective inside Ipopt; 0: makes the mean curvature of the "
                 "controls 1 at the first start."),
    MHE_OPT_BOOL(struct ipopt_config, adapt_curvature, 0,
                 "Scale the Gauss-Newton Hessian where successive steps overshoot or creep; for "
                 "long motions of strongly curved dynamics."),
    MHE_OPT_TEXT(struct ipopt_config, linear_solver, 0, "mumps", "Linear solver of Ipopt."),
    MHE_OPT_INT(struct ipopt_config, print_level, 0, 0, 12, "1",
                "Amount of Ipopt's own console output; 0: none."),
    MHE_OPT_MAP(struct ipopt_config, options, 0,
                "Any options of Ipopt by name; they win over those above."),
};

static void ipopt_destroy(void *self) {
    ipopt_solver *s = self;
    if (s == NULL) {
        return;
    }
    if (s->ipopt != NULL) {
        FreeIpoptProblem(s->ipopt);
    }
    nlp_free(&s->nlp);
    free(s->curvature.point);
    free(s->v);
    free(s);
}

static mhe_status ipopt_create(const mhe_host *host, const mhe_stage_problem *problem,
                               const void *config, void **self, mhe_error *err) {
    mhe_status status = ipopt_check(config, err);
    if (status != MHE_OK) {
        return status;
    }
    ipopt_solver *s = calloc(1, sizeof *s);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for the solver");
    }
    s->host = host;
    s->config = config;
    status = nlp_create(&s->nlp, problem, err);
    size_t n = (size_t)s->nlp.n_all;
    s->v = status == MHE_OK ? calloc(5 * n, sizeof(double)) : NULL;
    if (s->v == NULL) {
        ipopt_destroy(s);
        return status != MHE_OK ? status : mhe_fail(err, MHE_E_MEMORY, "no memory for the solver");
    }
    s->curvature.factor = 1;
    s->curvature.point = s->config->adapt_curvature ? calloc(2 * n, sizeof(double)) : NULL;
    if (s->config->adapt_curvature && s->curvature.point == NULL) {
        ipopt_destroy(s);
        return mhe_fail(err, MHE_E_MEMORY, "no memory for the solver");
    }
    s->z_lower = s->v + n;
    s->z_upper = s->z_lower + n;
    s->lambda = s->z_upper + n;
    s->work = s->lambda + n;
    *self = s;
    return MHE_OK;
}

/* Free variables of w [n_all] -> out [n], and back. */
static void pack(const nlp *p, const double *w, double *out) {
    for (int32_t i = 0; i < p->n; i++) {
        out[i] = w[p->of[i]];
    }
}

static void unpack(const nlp *p, const double *v, double *w) {
    for (int32_t i = 0; i < p->n; i++) {
        w[p->of[i]] = v[i];
    }
}

static int32_t is_finite(const double *values, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        if (!isfinite(values[i])) {
            return 0;
        }
    }
    return 1;
}

/* Reads the start into w, v and the multipliers. 1: the multipliers can be used. */
static int32_t read_start(ipopt_solver *s, const mhe_solution *start) {
    nlp *p = &s->nlp;
    nlp_begin(p, start->x, start->u, start->p);
    pack(p, p->w, s->v);
    if (!start->has_multipliers) {
        return 0;
    }
    nlp_gather(p, start->zx_lower, start->zu_lower, start->zp_lower, s->work);
    pack(p, s->work, s->z_lower);
    nlp_gather(p, start->zx_upper, start->zu_upper, start->zp_upper, s->work);
    pack(p, s->work, s->z_upper);
    memcpy(s->lambda, start->lambda, sizeof(double) * (size_t)p->m);
    return is_finite(s->z_lower, p->n) && is_finite(s->z_upper, p->n) && is_finite(s->lambda, p->m);
}

/* The Ipopt problem for the bounds just read: a new one only where they changed. */
static mhe_status prepare(ipopt_solver *s, int32_t changed, mhe_error *err) {
    nlp *p = &s->nlp;
    if (s->scale == 0) {
        s->scale = s->config->objective_scale > 0 ? s->config->objective_scale : nlp_scale(p, s->v);
        changed = 1;
    }
    if (!changed && s->ipopt != NULL) {
        return MHE_OK;
    }
    if (s->ipopt != NULL) {
        FreeIpoptProblem(s->ipopt);
    }
    const ptrdiff_t n = p->n_all;
    double *lower = calloc(4 * (size_t)n, sizeof(double));
    s->ipopt =
        lower != NULL ? ipopt_problem(p, lower, lower + n, lower + 2 * n, lower + 3 * n) : NULL;
    free(lower);
    if (s->ipopt == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for an Ipopt problem");
    }
    return ipopt_configure(s->ipopt, s->config, s->scale, err);
}

/* Ipopt's verdict -> MHE_SOLVE_*; -1: it could not even start. */
static int32_t outcome(const ipopt_solver *s, int32_t verdict, double primal_residual) {
    switch (verdict) {
    case Solve_Succeeded:
    case Feasible_Point_Found: /* as many free variables as constraints */
        return MHE_SOLVE_CONVERGED;
    case Solved_To_Acceptable_Level:
        return s->config->acceptable_iterations > 0 ? MHE_SOLVE_CONVERGED : MHE_SOLVE_FAILED;
    case Infeasible_Problem_Detected:
        return MHE_SOLVE_INFEASIBLE;
    case Restoration_Failed: /* at an infeasible point, or on the way from a feasible one */
        return primal_residual > s->config->tolerance ? MHE_SOLVE_INFEASIBLE : MHE_SOLVE_FAILED;
    case Maximum_Iterations_Exceeded:
        return MHE_SOLVE_ITERATION_LIMIT;
    case Maximum_CpuTime_Exceeded:
    case Maximum_WallTime_Exceeded:
        return MHE_SOLVE_DEADLINE;
    case User_Requested_Stop:
        return s->stopped != 0 ? s->stopped : MHE_SOLVE_FAILED;
    case Search_Direction_Becomes_Too_Small:
    case Diverging_Iterates:
    case Error_In_Step_Computation:
    case Invalid_Number_Detected:
        return MHE_SOLVE_FAILED;
    default:
        return -1;
    }
}

/* Multipliers of bounds: Ipopt's for free variables; for fixed ones what makes the Lagrangian
 * stationary. */
static void write_multipliers(ipopt_solver *s, mhe_solution *out) {
    nlp *p = &s->nlp;
    memcpy(out->lambda, s->lambda, sizeof(double) * (size_t)p->m);
    for (int side = 0; side < 2; side++) { /* lower, upper */
        nlp_lagrangian_gradient(p, s->lambda, s->work);
        for (int32_t i = 0; i < p->n_all; i++) {
            s->work[i] = fmax(0, side == 0 ? s->work[i] : -s->work[i]);
        }
        unpack(p, side == 0 ? s->z_lower : s->z_upper, s->work);
        nlp_scatter(p, s->work, side == 0 ? out->zx_lower : out->zx_upper,
                    side == 0 ? out->zu_lower : out->zu_upper,
                    side == 0 ? out->zp_lower : out->zp_upper);
    }
    out->has_multipliers = 1;
}

/* Largest product of a bound's multiplier and its distance. */
static double complementarity(const ipopt_solver *s) {
    const nlp *p = &s->nlp;
    double worst = 0;
    for (int32_t i = 0; i < p->n; i++) {
        double lower = p->lower[p->of[i]], upper = p->upper[p->of[i]];
        worst = fmax(worst, isfinite(lower) ? (s->v[i] - lower) * s->z_lower[i] : 0);
        worst = fmax(worst, isfinite(upper) ? (upper - s->v[i]) * s->z_upper[i] : 0);
    }
    return worst;
}

static double largest(const double *values, int32_t n) {
    double worst = 0;
    for (int32_t i = 0; i < n; i++) {
        worst = fmax(worst, fabs(values[i]));
    }
    return worst;
}

static void write_result(ipopt_solver *s, mhe_solution *out, mhe_solve_info *info) {
    nlp *p = &s->nlp;
    int32_t good = is_finite(s->v, p->n) && is_finite(s->lambda, p->m) &&
                   is_finite(s->z_lower, p->n) && is_finite(s->z_upper, p->n);
    if (good && nlp_evaluate(p, s->v, NLP_ALL)) { /* known already unless the solve failed */
        nlp_scatter(p, p->w, out->x, out->u, out->p);
        write_multipliers(s, out);
        nlp_constraints(p, s->work);
        info->primal_residual = largest(s->work, p->m);
        s->constant_gap = nlp_constant_gap(p, s->work);
        info->objective = nlp_cost(p);
        info->kkt_residual = fmax(s->kkt_residual, s->scale * complementarity(s));
    }
}

/* Nothing is free: the dynamics hold or they do not. */
static void judge_constant(ipopt_solver *s, mhe_solution *solution, mhe_solve_info *info) {
    memset(s->lambda, 0, sizeof(double) * (size_t)s->nlp.m);
    s->kkt_residual = 0;
    write_result(s, solution, info);
    info->outcome =
        info->primal_residual <= s->config->tolerance ? MHE_SOLVE_CONVERGED : MHE_SOLVE_INFEASIBLE;
}

static mhe_status ipopt_solve(void *self, const mhe_solve_control *control, mhe_solution *solution,
                              mhe_solve_info *info, mhe_error *err) {
    ipopt_solver *s = self;
    nlp *p = &s->nlp;
    info->outcome = MHE_SOLVE_FAILED;
    info->iterations = 0;
    info->objective = NAN;
    info->evaluation_time = 0;
    info->kkt_residual = info->primal_residual = INFINITY;

    int32_t change = nlp_read_bounds(p);
    if (change == NLP_EMPTY) {
        info->outcome = MHE_SOLVE_INFEASIBLE;
        return MHE_OK;
    }
    if (p->n < p->m - p->n_constant) {
        return mhe_fail(err, MHE_E_ARGUMENT, "%d free variables cannot satisfy %d constraints",
                        (int)p->n, (int)p->m);
    }
    int32_t warm = read_start(s, solution);
    if (!is_finite(p->w, p->n_all)) {
        return mhe_fail(err, MHE_E_ARGUMENT, "the start of the solve is not finite");
    }
    if (p->n == 0) {
        judge_constant(s, solution, info);
        return p->failure != MHE_OK ? mhe_fail(err, p->failure, "%s", p->error.text) : MHE_OK;
    }
    mhe_status status = prepare(s, change == NLP_CHANGED, err);
    if (status != MHE_OK) {
        return status;
    }
    ipopt_warm_start(s->ipopt, s->config, warm);
    s->control = control;
    s->stopped = s->iterations = 0;
    s->kkt_residual = INFINITY;
    s->constant_gap = 0;
    curvature_begin(&s->curvature, p->n);
    p->all_next = 1;
    int32_t verdict =
        (int32_t)IpoptSolve(s->ipopt, s->v, NULL, NULL, s->lambda, s->z_lower, s->z_upper, s);
    if (p->failure != MHE_OK) {
        return mhe_fail(err, p->failure, "%s", p->error.text);
    }
    write_result(s, solution, info);
    info->iterations = s->iterations;
    info->evaluation_time = p->seconds;
    info->outcome = s->constant_gap > s->config->tolerance
                        ? MHE_SOLVE_INFEASIBLE
                        : outcome(s, verdict, info->primal_residual);
    if (info->outcome < 0) {
        info->outcome = MHE_SOLVE_FAILED;
        return mhe_fail(err, MHE_E_NUMERIC, "Ipopt %s gave up with code %d (linear solver '%s')",
                        IPOPT_VERSION, (int)verdict, s->config->linear_solver);
    }
    return MHE_OK;
}

/* Any problem: parameters are variables behind the last state. */
static mhe_status ipopt_accepts(const mhe_stage_problem *problem, const void *config,
                                mhe_error *err) {
    (void)problem, (void)config, (void)err;
    return MHE_OK;
}

static const mhe_solver_ops ipopt_ops = {.size = sizeof ipopt_ops,
                                         .create = ipopt_create,
                                         .destroy = ipopt_destroy,
                                         .solve = ipopt_solve,
                                         .accepts = ipopt_accepts};

static const mhe_plugin ipopt_plugin = {
    .size = sizeof ipopt_plugin,
    .id = "mhe.solver.ipopt",
    .version = "0.1.0",
    .summary = "Sparse interior-point method with a Gauss-Newton Hessian (Ipopt).",
    .reference = "doi:10.1007/s10107-004-0559-y",
    .iface = MHE_SOLVER_IFACE,
    .ops = &ipopt_ops,
    MHE_PLUGIN_OPTIONS(struct ipopt_config, ipopt_options)};

MHE_PLUGIN_LIBRARY(&ipopt_plugin)
