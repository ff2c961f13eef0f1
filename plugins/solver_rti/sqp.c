/* SPDX-License-Identifier: Apache-2.0 */
/* sqp.c: a solve: preparation, start, iterations, result. */
#include "rti.h"

#include "../constant_rows.h"

#include <math.h>
#include <string.h>

/* ---- between the caller's arrays x [(N+1) x n_x], u [N x n_u] and vectors of all w ---- */

/* p [n_p] is not looked at where there are none. */
static void gather(const qp_shape *s, const double *x, const double *u, const double *p,
                   double *w) {
    for (int32_t k = 0; k <= s->N; k++) {
        double *row = row_z(s, w, k);
        memcpy(row + s->n_u, x + k * s->n_x, sizeof(double) * (size_t)s->n_x);
        if (k < s->N) {
            memcpy(row, u + k * s->n_u, sizeof(double) * (size_t)s->n_u);
        }
    }
    for (int32_t i = 0; i < s->n_p; i++) {
        row_p(s, w)[i] = p[i];
    }
}

static void scatter(const qp_shape *s, const double *w, double *x, double *u, double *p) {
    for (int32_t k = 0; k <= s->N; k++) {
        const double *row = w + (ptrdiff_t)k * s->ld_z;
        memcpy(x + k * s->n_x, row + s->n_u, sizeof(double) * (size_t)s->n_x);
        if (k < s->N) {
            memcpy(u + k * s->n_u, row, sizeof(double) * (size_t)s->n_u);
        }
    }
    for (int32_t i = 0; i < s->n_p; i++) {
        p[i] = w[(ptrdiff_t)(s->N + 1) * s->ld_z + i];
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
    gather(&s->shape, p->x_lower, p->u_lower, p->p_lower, s->lower);
    gather(&s->shape, p->x_upper, p->u_upper, p->p_upper, s->upper);
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

/* The start, moved into the bounds, and its multipliers where they can be used; what was prepared
 * elsewhere is forgotten. 0: not finite. */
static int32_t read_start(rti_solver *s, const mhe_solution *start) {
    const qp_shape *shape = &s->shape;
    const size_t n = size_z(shape);
    gather(shape, start->x, start->u, start->p, s->trial.w);
    const int32_t finite = is_finite(s->trial.w, n);
    for (size_t i = 0; i < n; i++) {
        s->trial.w[i] = smaller(s->upper[i], larger(s->lower[i], s->trial.w[i]));
    }
    if (!s->prepared || memcmp(s->trial.w, s->here.w, sizeof(double) * n) != 0) {
        memcpy(s->here.w, s->trial.w, sizeof(double) * n);
        s->prepared = 0;
    }
    s->warm = start->has_multipliers;
    if (s->warm) {
        gather(shape, start->zx_lower, start->zu_lower, start->zp_lower, s->z_lower);
        gather(shape, start->zx_upper, start->zu_upper, start->zp_upper, s->z_upper);
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
        s->z_lower[i] = s->warm && isfinite(s->lower[i]) ? scale * larger(0, s->z_lower[i]) : 0;
        s->z_upper[i] = s->warm && isfinite(s->upper[i]) ? scale * larger(0, s->z_upper[i]) : 0;
    }
    return finite;
}

/* Evaluates the start; at the first of all also chooses the objective's scale. 0: no value. */
static int32_t begin(rti_solver *s) {
    const int32_t first = s->scale == 0;
    if (first) {
        s->scale = s->config->objective_scale > 0 ? s->config->objective_scale : 1;
    }
    const int32_t known =
        rti_evaluate(s, &s->here, s->prepared ? RTI_COSTS | RTI_DERIVATIVES : RTI_ALL);
    s->prepared = 0; /* from here on the steps use the memory */
    if (!known) {
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

static double worst(const rti_residuals *r) {
    return fmax(r->stationarity, fmax(r->gap, r->complementarity));
}

/* Why to stop before the next iteration: MHE_SOLVE_*, -1: not at all. */
static int32_t verdict(rti_solver *s, const mhe_solve_control *control, int32_t iteration,
                       int32_t limit) {
    const int32_t stop =
        control != NULL && control->progress != NULL &&
        control->progress(control->data, iteration, s->here.cost / s->scale, worst(&s->residuals));
    if (rti_excess(&s->residuals) <= s->config->tolerance) {
        return MHE_SOLVE_CONVERGED;
    }
    if (stop) {
        return MHE_SOLVE_INTERRUPTED;
    }
    if (iteration >= limit) {
        return MHE_SOLVE_ITERATION_LIMIT;
    }
    /* The next iteration will take about as long as the last one; a real-time one may be a leap. */
    const double takes = s->real_time && iteration > 0 ? s->leap_time : s->iteration_time;
    if (rti_is_late(s, takes) || rti_is_spent(s)) {
        return MHE_SOLVE_DEADLINE;
    }
    return -1;
}

/* Multipliers of the caller's objective. Those of fixed variables are what makes the Lagrangian
 * stationary; after a leap, that of the last program. */
static void write_multipliers(rti_solver *s, mhe_solution *out) {
    const qp_shape *shape = &s->shape;
    qp_slope(shape, s->here.stages, s->leap.taken ? s->qp.w : NULL, s->lambda, s->slope);
    for (size_t i = 0; i < size_z(shape); i++) {
        if (s->lower[i] == s->upper[i]) {
            s->z_lower[i] = larger(0, s->slope[i]);
            s->z_upper[i] = larger(0, -s->slope[i]);
        }
        s->z_lower[i] /= s->scale;
        s->z_upper[i] /= s->scale;
    }
    scatter(shape, s->z_lower, out->zx_lower, out->zu_lower, out->zp_lower);
    scatter(shape, s->z_upper, out->zx_upper, out->zu_upper, out->zp_upper);
    for (int32_t k = 0; k < shape->N; k++) {
        for (int32_t i = 0; i < shape->n_x; i++) {
            out->lambda[k * shape->n_x + i] = row_x(shape, s->lambda, k)[i] / s->scale;
        }
    }
    out->has_multipliers = 1;
}

/* Of the first `n` intervals. */
static double largest_gap(rti_solver *s, int32_t n) {
    double largest = 0;
    for (int32_t k = 0; k < n; k++) {
        for (int32_t i = 0; i < s->shape.n_x; i++) {
            largest = larger(largest, fabs(s->here.stages[k].b[i]));
        }
    }
    return largest;
}

/* Full steps need a start near the solution: multipliers and a given first state. */
static int32_t is_near(const rti_solver *s) {
    return s->warm && s->qp.first_is_fixed;
}

static int32_t one_step(const rti_solver *s) {
    const mhe_solve_control *c = s->control;
    return c != NULL && c->size > offsetof(mhe_solve_control, one_step) && c->one_step;
}

/* Any other window is solved as by `robust`. */
static int32_t is_real_time(const rti_solver *s) {
    return one_step(s) || (s->config->preset != RTI_ROBUST && is_near(s));
}

static void write_result(rti_solver *s, mhe_solution *out, mhe_solve_info *info) {
    const rti_leap *leap = &s->leap;
    scatter(&s->shape, s->here.w, out->x, out->u, out->p);
    write_multipliers(s, out);
    memcpy(s->result, s->here.w, sizeof(double) * size_z(&s->shape));
    s->has_result = 1;
    info->objective = (leap->taken ? leap->cost : s->here.cost) / s->scale;
    info->kkt_residual = worst(&s->residuals);
    const int32_t stepped = s->real_time && info->iterations > 0;
    /* A real-time iteration cut between steps is judged as one that ended with a leap. */
    info->primal_residual =
        leap->taken ? fmax(leap->first_gap, leap->left) : largest_gap(s, stepped ? 1 : s->shape.N);
}

static int32_t iteration_limit(const rti_solver *s) {
    static const int32_t most[] = {[RTI_SPEED] = 1, [RTI_BALANCED] = 3};
    const int32_t given = s->config->max_iterations;
    return one_step(s)                                          ? 1
           : is_real_time(s) && most[s->config->preset] < given ? most[s->config->preset]
                                                                : given;
}

/* What a leap came to. It is not measured again, so converged means what can be said of the node
 * that leaves the window next, after as many iterations as there are intervals: it is a motion of
 * the model, and it no longer moved much, which bounds what another iteration would change. */
static int32_t judge(const rti_solver *s) {
    const rti_leap *leap = &s->leap;
    return leap->solved && leap->length == 1 && leap->first_gap <= s->config->tolerance &&
                   leap->front <= s->config->settled
               ? MHE_SOLVE_CONVERGED
               : MHE_SOLVE_ITERATION_LIMIT;
}

static void tell_progress(const rti_solver *s, const mhe_solve_control *control,
                          int32_t iterations) {
    if (control != NULL && control->progress != NULL) {
        (void)control->progress(control->data, iterations, s->leap.cost / s->scale,
                                worst(&s->residuals));
    }
}

/* From the evaluated start; gives MHE_SOLVE_*. */
static int32_t iterate(rti_solver *s, const mhe_solve_control *control, int32_t *iterations) {
    const int32_t limit = iteration_limit(s), near = is_near(s), real_time = is_real_time(s);
    s->real_time = real_time;
    s->penalty = s->damping = 0;
    memset(s->weight, 0, sizeof(double) * size_x(&s->shape));
    s->least_excess = INFINITY;
    s->last_is_known = s->missed_kinks = s->on_kink = s->stays = s->on_level = 0;
    for (*iterations = 0;;) {
        rti_measure(s);
        const int32_t outcome = verdict(s, control, *iterations, limit);
        if (outcome >= 0) {
            return outcome;
        }
        const double begin = rti_now();
        const int32_t whole = *iterations + 1 == limit; /* else it leaps for want of time */
        const int32_t last = real_time && (whole || rti_is_late(s, s->full_time));
        const int32_t result = last        ? rti_leap_on(s)
                               : real_time ? rti_step_full(s)
                                           : rti_step_globalised(s, near && *iterations == 0);
        s->iteration_time = rti_now() - begin;
        *(last ? &s->leap_time : &s->full_time) = s->iteration_time;
        if (result == RTI_STUCK) {
            return MHE_SOLVE_FAILED;
        }
        if (result == RTI_LATE) {
            return MHE_SOLVE_DEADLINE;
        }
        *iterations += 1;
        if (result == RTI_INFEASIBLE) {
            rti_measure(s);
            return MHE_SOLVE_INFEASIBLE;
        }
        if (last || result == RTI_CUT) {
            tell_progress(s, control, *iterations);
            const int32_t came_to = result == RTI_CUT ? MHE_SOLVE_DEADLINE : judge(s);
            return came_to == MHE_SOLVE_CONVERGED || whole ? came_to : MHE_SOLVE_DEADLINE;
        }
    }
}

mhe_status rti_prepare(void *self, const mhe_solution *start, mhe_error *err) {
    rti_solver *s = self;
    gather(&s->shape, start->x, start->u, start->p, s->here.w);
    s->err = err;
    s->prepared = 0;
    s->failure = MHE_OK;
    s->control = NULL; /* ahead of a solve there is no limit of one */
    s->deadline = INFINITY;
    if (is_finite(s->here.w, size_z(&s->shape))) {
        s->prepared = rti_evaluate(s, &s->here, RTI_DYNAMICS | RTI_DERIVATIVES);
    }
    return s->failure;
}

mhe_status rti_solve(void *self, const mhe_solve_control *control, mhe_solution *solution,
                     mhe_solve_info *info, mhe_error *err) {
    rti_solver *s = self;
    int32_t n_free = 0;
    *info = (mhe_solve_info){.size = info->size,
                             .outcome = MHE_SOLVE_FAILED,
                             .objective = NAN,
                             .kkt_residual = INFINITY,
                             .primal_residual = INFINITY};
    s->has_result = 0;
    if (!read_bounds(s, &n_free)) {
        info->outcome = MHE_SOLVE_INFEASIBLE;
        return MHE_OK;
    }
    const int32_t n_equations = s->shape.N * s->shape.n_x;
    if (n_free < n_equations && n_free < n_equations - constant_rows(s->problem, NULL)) {
        return mhe_fail(err, MHE_E_ARGUMENT, "%d free variables cannot satisfy %d constraints",
                        (int)n_free, (int)n_equations);
    }
    if (!read_start(s, solution)) {
        return mhe_fail(err, MHE_E_ARGUMENT, "the start of the solve is not finite");
    }
    s->err = err;
    s->failure = MHE_OK;
    s->seconds = s->iteration_time = 0;
    s->leap = (rti_leap){0};
    s->control = control;
    s->deadline = control != NULL && control->deadline > 0 ? control->deadline : INFINITY;
    if (rti_is_late(s, 0)) { /* at once */
        s->control = NULL;
        info->outcome = MHE_SOLVE_DEADLINE;
        info->primal_residual = s->prepared ? largest_gap(s, s->shape.N) : INFINITY;
        return MHE_OK;
    }
    const int32_t programs = s->qp.programs, fallbacks = s->qp.fallbacks;
    if (begin(s)) {
        info->outcome = iterate(s, control, &info->iterations);
        if (s->failure == MHE_OK) {
            write_result(s, solution, info);
        }
    }
    info->programs = s->qp.programs - programs;
    info->fallbacks = s->qp.fallbacks - fallbacks;
    info->evaluation_time = s->seconds;
    s->control = NULL;
    return s->failure;
}
