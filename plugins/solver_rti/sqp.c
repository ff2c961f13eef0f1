/* SPDX-License-Identifier: Apache-2.0 */
/* sqp.c: a solve: start, iterations, result. */
#include "rti.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* ---- memory: one block ---- */

static size_t stage_doubles(const qp_shape *s) { /* of what evaluate() writes */
    const size_t n_x = (size_t)s->n_x, n_u = (size_t)s->n_u;
    return n_x * n_x * 2 + n_u * n_x * 2 + n_u * n_u + n_u + n_x;
}

static double *take(double **memory, size_t n) {
    double *piece = *memory;
    *memory += n;
    return piece;
}

static void place(rti_solver *s) {
    const qp_shape *shape = &s->shape;
    const size_t z = size_z(shape), x = size_x(shape), n_x = (size_t)shape->n_x,
                 n_u = (size_t)shape->n_u, n_stages = (size_t)shape->N + 1;
    double *m = s->memory;
    qp_place(&s->qp, shape, m);
    m += qp_size(shape) / sizeof(double);
    rti_point *const points[] = {&s->here, &s->trial};
    for (int i = 0; i < 2; i++) {
        points[i]->w = take(&m, z);
        qp_stage *stages = (qp_stage *)m;
        m += n_stages * sizeof(qp_stage) / sizeof(double);
        qp_stages_place(shape, take(&m, qp_stages_size(shape)), stages);
        points[i]->stages = stages;
    }
    double **const of_z[] = {&s->lower, &s->upper, &s->z_lower, &s->z_upper, &s->slope};
    for (size_t i = 0; i < sizeof of_z / sizeof of_z[0]; i++) {
        *of_z[i] = take(&m, z);
    }
    s->lambda = take(&m, x);
    s->gaps = take(&m, x);
    s->xx = take(&m, n_x * n_x);
    s->A = take(&m, n_x * n_x);
    s->ux = take(&m, n_u * n_x);
    s->B = take(&m, n_u * n_x);
    s->uu = take(&m, n_u * n_u);
    s->grad_u = take(&m, n_u);
    s->x_next = take(&m, n_x);
}

static size_t memory_size(const qp_shape *s) {
    const size_t points = 2 * (size_z(s) + qp_stages_size(s)) * sizeof(double) +
                          2 * ((size_t)s->N + 1) * sizeof(qp_stage);
    const size_t bytes =
        qp_size(s) + points + (5 * size_z(s) + 2 * size_x(s) + stage_doubles(s)) * sizeof(double);
    return (bytes + 63) / 64 * 64;
}

mhe_status rti_create(const mhe_host *host, const mhe_stage_problem *problem, const void *config,
                      void **self, mhe_error *err) {
    rti_solver *s = calloc(1, sizeof *s);
    int32_t *control_of = calloc((size_t)problem->n_x, sizeof *control_of);
    if (s != NULL && control_of != NULL) {
        s->host = host;
        s->config = config;
        s->problem = problem;
        qp_shape_of(problem, control_of, &s->shape);
        s->memory = aligned_alloc(64, memory_size(&s->shape));
    }
    if (s == NULL || control_of == NULL || s->memory == NULL) {
        free(s);
        free(control_of);
        return mhe_fail(err, MHE_E_MEMORY, "no memory for %d intervals of %d states, %d controls",
                        (int)problem->n_intervals, (int)problem->n_x, (int)problem->n_u);
    }
    memset(s->memory, 0, memory_size(&s->shape));
    place(s);
    *self = s;
    return MHE_OK;
}

void rti_destroy(void *self) {
    rti_solver *s = self;
    if (s != NULL) {
        free((void *)s->shape.control_of);
        free(s->memory);
        free(s);
    }
}

/* ---- between the caller's arrays x [(N+1) x n_x], u [N x n_u] and vectors of all w ---- */

static void gather(const qp_shape *s, const double *x, const double *u, double *w) {
    for (int32_t k = 0; k <= s->N; k++) {
        double *row = row_z(s, w, k);
        memcpy(row + s->n_u, x + k * s->n_x, sizeof(double) * (size_t)s->n_x);
        if (k < s->N) {
            memcpy(row, u + k * s->n_u, sizeof(double) * (size_t)s->n_u);
        }
    }
}

static void scatter(const qp_shape *s, const double *w, double *x, double *u) {
    for (int32_t k = 0; k <= s->N; k++) {
        const double *row = w + (ptrdiff_t)k * s->ld_z;
        memcpy(x + k * s->n_x, row + s->n_u, sizeof(double) * (size_t)s->n_x);
        if (k < s->N) {
            memcpy(u + k * s->n_u, row, sizeof(double) * (size_t)s->n_u);
        }
    }
}

static int32_t is_finite(const double *values, size_t n) {
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        sum += values[i] - values[i];
    }
    return sum == 0;
}

/* Bounds; free variables are counted. 0: a lower bound lies above its upper one. */
static int32_t read_bounds(rti_solver *s, int32_t *n_free) {
    const mhe_stage_problem *p = s->problem;
    gather(&s->shape, p->x_lower, p->u_lower, s->lower);
    gather(&s->shape, p->x_upper, p->u_upper, s->upper);
    *n_free = 0;
    for (size_t i = 0; i < size_z(&s->shape); i++) { /* what is no variable is fixed to 0 */
        if (!(s->lower[i] <= s->upper[i])) {
            return 0;
        }
        *n_free += s->lower[i] < s->upper[i];
        s->qp.lower[i] = s->lower[i];
        s->qp.upper[i] = s->upper[i];
    }
    qp_read_bounds(&s->qp);
    return 1;
}

/* The start, moved into the bounds, and its multipliers where they can be used. 0: not finite. */
static int32_t read_start(rti_solver *s, const mhe_solution *start) {
    const qp_shape *shape = &s->shape;
    const size_t n = size_z(shape);
    gather(shape, start->x, start->u, s->here.w);
    const int32_t finite = is_finite(s->here.w, n);
    for (size_t i = 0; i < n; i++) {
        s->here.w[i] = fmin(fmax(s->here.w[i], s->lower[i]), s->upper[i]);
    }
    s->warm = start->has_multipliers;
    if (s->warm) {
        gather(shape, start->zx_lower, start->zu_lower, s->z_lower);
        gather(shape, start->zx_upper, start->zu_upper, s->z_upper);
        for (int32_t k = 0; k < shape->N; k++) {
            for (int32_t i = 0; i < shape->n_x; i++) {
                row_x(shape, s->lambda, k)[i] = start->lambda[k * shape->n_x + i];
            }
        }
        s->warm = is_finite(s->z_lower, n) && is_finite(s->z_upper, n) &&
                  is_finite(s->lambda, size_x(shape));
    }
    const double scale = s->warm ? s->scale : 0; /* inside, multipliers are of the scaled cost */
    for (size_t i = 0; i < size_x(shape); i++) {
        s->lambda[i] = s->warm ? scale * s->lambda[i] : 0;
    }
    for (size_t i = 0; i < n; i++) {
        s->z_lower[i] = s->warm && isfinite(s->lower[i]) ? scale * fmax(0, s->z_lower[i]) : 0;
        s->z_upper[i] = s->warm && isfinite(s->upper[i]) ? scale * fmax(0, s->z_upper[i]) : 0;
    }
    return finite;
}

/* Evaluates the start; at the first of all also chooses the objective's scale. 0: no value. */
static int32_t begin(rti_solver *s) {
    const int32_t first = s->scale == 0;
    if (first) {
        s->scale = s->config->objective_scale > 0 ? s->config->objective_scale : 1;
    }
    if (!rti_evaluate(s, &s->here, 1)) {
        s->scale = first ? 0 : s->scale;
        return 0;
    }
    if (first && s->config->objective_scale == 0) {
        s->scale = rti_scale_of(s, &s->here);
        rti_rescale(s, &s->here, s->scale);
    }
    if (first) { /* given multipliers could not be scaled yet */
        for (size_t i = 0; i < size_x(&s->shape); i++) {
            s->lambda[i] = 0;
        }
        s->warm = 0;
    }
    return 1;
}

static double now(void) {
    struct timespec time;
    (void)clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static double worst(const rti_residuals *r) {
    return fmax(r->stationarity, fmax(r->gap, r->complementarity));
}

/* Gaps and complementarity are held ten times tighter than the slope, as by solver_ipopt. */
static int32_t is_optimal(const rti_solver *s) {
    const double tolerance = s->config->tolerance;
    return s->residuals.stationarity <= tolerance && s->residuals.gap <= 0.1 * tolerance &&
           s->residuals.complementarity <= 0.1 * tolerance;
}

/* Why to stop before the next iteration: MHE_SOLVE_*, -1: not at all. */
static int32_t verdict(const rti_solver *s, const mhe_solve_control *control, int32_t iteration,
                       int32_t limit) {
    const int32_t stop =
        control != NULL && control->progress != NULL &&
        control->progress(control->data, iteration, s->here.cost / s->scale, worst(&s->residuals));
    if (is_optimal(s)) {
        return MHE_SOLVE_CONVERGED;
    }
    if (stop) {
        return MHE_SOLVE_INTERRUPTED;
    }
    if (iteration >= limit) {
        return MHE_SOLVE_ITERATION_LIMIT;
    }
    if (control != NULL && control->deadline > 0 && now() >= control->deadline) {
        return MHE_SOLVE_DEADLINE;
    }
    return -1;
}

/* Multipliers of the caller's objective. Those of fixed variables are what makes the Lagrangian
 * stationary; where only values are known at the result, those of the last program. */
static void write_multipliers(rti_solver *s, int32_t derivatives, mhe_solution *out) {
    const qp_shape *shape = &s->shape;
    if (derivatives) {
        qp_slope(shape, s->here.stages, NULL, s->lambda, s->slope);
    } else {
        qp_slope(shape, s->trial.stages, s->qp.w, s->lambda, s->slope);
    }
    for (size_t i = 0; i < size_z(shape); i++) {
        if (s->lower[i] == s->upper[i]) {
            s->z_lower[i] = fmax(0, s->slope[i]);
            s->z_upper[i] = fmax(0, -s->slope[i]);
        }
        s->z_lower[i] /= s->scale;
        s->z_upper[i] /= s->scale;
    }
    scatter(shape, s->z_lower, out->zx_lower, out->zu_lower);
    scatter(shape, s->z_upper, out->zx_upper, out->zu_upper);
    for (int32_t k = 0; k < shape->N; k++) {
        for (int32_t i = 0; i < shape->n_x; i++) {
            out->lambda[k * shape->n_x + i] = row_x(shape, s->lambda, k)[i] / s->scale;
        }
    }
    out->has_multipliers = 1;
}

static void write_result(rti_solver *s, int32_t derivatives, mhe_solution *out,
                         mhe_solve_info *info) {
    scatter(&s->shape, s->here.w, out->x, out->u);
    write_multipliers(s, derivatives, out);
    info->objective = s->here.cost / s->scale;
    info->kkt_residual = worst(&s->residuals);
    info->primal_residual = 0;
    for (int32_t k = 0; k < s->shape.N; k++) {
        for (int32_t i = 0; i < s->shape.n_x; i++) {
            info->primal_residual = fmax(info->primal_residual, fabs(s->here.stages[k].b[i]));
        }
    }
}

/* Real-time iterations need a start near the solution: multipliers and a given first state. Any
 * other window is solved as by `robust`. */
static int32_t is_real_time(const rti_solver *s) {
    return s->config->preset != RTI_ROBUST && s->warm && s->qp.riccati.first_is_fixed;
}

static int32_t iteration_limit(const rti_solver *s) {
    static const int32_t most[] = {[RTI_SPEED] = 1, [RTI_BALANCED] = 3};
    const int32_t given = s->config->max_iterations;
    return is_real_time(s) && most[s->config->preset] < given ? most[s->config->preset] : given;
}

/* From the evaluated start; gives MHE_SOLVE_*. `derivatives`: are they known at the result? */
static int32_t iterate(rti_solver *s, const mhe_solve_control *control, int32_t *iterations,
                       int32_t *derivatives) {
    const int32_t limit = iteration_limit(s), real_time = is_real_time(s);
    s->penalty = s->damping = 0;
    for (*iterations = 0;;) {
        rti_measure(s);
        const int32_t outcome = verdict(s, control, *iterations, limit);
        if (outcome >= 0) {
            return outcome;
        }
        const int32_t last = real_time && *iterations + 1 == limit;
        const int32_t result = real_time ? rti_step_full(s, last) : rti_step_globalised(s);
        if (result == RTI_STUCK) {
            return MHE_SOLVE_FAILED;
        }
        *iterations += 1;
        if (result == RTI_INFEASIBLE) {
            rti_measure(s);
            return MHE_SOLVE_INFEASIBLE;
        }
        if (last) {
            *derivatives = 0;
            if (control != NULL && control->progress != NULL) {
                (void)control->progress(control->data, *iterations, s->here.cost / s->scale,
                                        worst(&s->residuals));
            }
            return result == RTI_SMALL ? MHE_SOLVE_CONVERGED : MHE_SOLVE_ITERATION_LIMIT;
        }
    }
}

mhe_status rti_solve(void *self, const mhe_solve_control *control, mhe_solution *solution,
                     mhe_solve_info *info, mhe_error *err) {
    rti_solver *s = self;
    int32_t n_free = 0, derivatives = 1;
    info->outcome = MHE_SOLVE_FAILED;
    info->iterations = 0;
    info->objective = NAN;
    info->evaluation_time = 0;
    info->kkt_residual = info->primal_residual = INFINITY;
    if (!read_bounds(s, &n_free)) {
        info->outcome = MHE_SOLVE_INFEASIBLE;
        return MHE_OK;
    }
    if (n_free < s->shape.N * s->shape.n_x) {
        return mhe_fail(err, MHE_E_ARGUMENT, "%d free variables cannot satisfy %d constraints",
                        (int)n_free, (int)(s->shape.N * s->shape.n_x));
    }
    if (!read_start(s, solution)) {
        return mhe_fail(err, MHE_E_ARGUMENT, "the start of the solve is not finite");
    }
    s->err = err;
    s->failure = MHE_OK;
    s->seconds = 0;
    if (begin(s)) {
        info->outcome = iterate(s, control, &info->iterations, &derivatives);
        if (s->failure == MHE_OK) {
            write_result(s, derivatives, solution, info);
        }
    }
    info->evaluation_time = s->seconds;
    return s->failure;
}
