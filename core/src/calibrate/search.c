/* SPDX-License-Identifier: Apache-2.0 */
/* search.c: the way to the solution.
 *
 * Passive forces grow exponentially with lengths, so that the linearisation holds for small changes
 * of the parameters only. They may change by a part of their standard deviation (a trust region),
 * for a few iterations; then the region is moved, and made larger or smaller by how much was
 * gained. */
#include "calibrate/calibrate.h"

#include <math.h>
#include <string.h>

#define FIRST_RADIUS 0.3 /* standard deviations */
#define LEAST_RADIUS 0.01
#define MOST_RADIUS 4.0
#define SHORT 2 /* iterations within a region */

typedef struct counter {
    mhi_calibration *c;
    int32_t done, limit; /* iterations before this solve; of this solve, at most */
    double last;         /* objective of the iteration before */
    int32_t still;       /* iterations in a row that changed it by less than the tolerance */
} counter;

#define STILL 2         /* of those, and it has come to rest */
#define NEARLY_MET 0.05 /* largest violation of the optimality conditions there */

static int32_t count(void *data, int32_t iteration, double objective, double kkt) {
    counter *n = data;
    const mhi_calibration *c = n->c;
    if (iteration > 0) {
        const int32_t rests = fabs(n->last - objective) <= c->plan.tolerance * objective;
        n->still = rests && kkt < NEARLY_MET ? n->still + 1 : 0;
    }
    n->last = objective;
    const int32_t stop = c->progress != NULL && iteration > 0 &&
                         c->progress(c->data, n->done + iteration, objective, kkt);
    return stop || n->still >= STILL || iteration >= n->limit ||
           n->done + iteration >= c->plan.max_iterations;
}

/* Bounds of the region about p; 1: p itself is at one that is no bound of the parameter's. */
static void set_region(const mhi_calibration *c, mhi_ocp *ocp, const double *p, double radius,
                       double *lower, double *upper) {
    for (int32_t i = 0; i < c->n; i++) {
        const mhi_parameter *one = &c->setup.list[i];
        const double sd = fmin(one->sd, one->upper - one->lower);
        lower[i] = fmax(one->lower, p[i] - radius * sd);
        upper[i] = fmin(one->upper, p[i] + radius * sd);
    }
    mhi_ocp_set_parameter_bounds(ocp, lower, upper);
}

static int32_t is_held(const mhi_calibration *c, const double *p, const double *lower,
                       const double *upper) {
    int32_t held = 0;
    for (int32_t i = 0; i < c->n && !held; i++) {
        const mhi_parameter *one = &c->setup.list[i];
        const double margin = 1e-3 * (upper[i] - lower[i]), value = p[i];
        held = (value < lower[i] + margin && lower[i] > one->lower) ||
               (value > upper[i] - margin && upper[i] < one->upper);
    }
    return held;
}

/* A point of the search, to come back to. */
typedef struct point {
    double *x, *u, *p;
    size_t n_x, n_u, n_p;
} point;

static mhe_status make_point(mhi_calibration *c, const mhi_ocp *ocp, point *keep, mhe_error *err) {
    const mhe_stage_problem *f = mhi_ocp_face(ocp);
    const ptrdiff_t n_x = (ptrdiff_t)(f->n_intervals + 1) * f->n_x,
                    n_u = (ptrdiff_t)f->n_intervals * f->n_u;
    *keep = (point){.x = MHI_TAKE(&c->arena, double, n_x),
                    .u = MHI_TAKE(&c->arena, double, n_u),
                    .p = MHI_TAKE(&c->arena, double, c->n),
                    .n_x = (size_t)n_x,
                    .n_u = (size_t)n_u,
                    .n_p = (size_t)c->n};
    return keep->x == NULL || keep->u == NULL || keep->p == NULL
               ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
               : MHE_OK;
}

static void keep_point(point *keep, const mhe_solution *s) {
    memcpy(keep->x, s->x, sizeof *s->x * keep->n_x);
    memcpy(keep->u, s->u, sizeof *s->u * keep->n_u);
    memcpy(keep->p, s->p, sizeof *s->p * keep->n_p);
}

static void come_back(const point *keep, mhe_solution *s) {
    memcpy(s->x, keep->x, sizeof *s->x * keep->n_x);
    memcpy(s->u, keep->u, sizeof *s->u * keep->n_u);
    memcpy(s->p, keep->p, sizeof *s->p * keep->n_p);
    s->has_multipliers = 0;
}

int32_t mhi_calibration_is_lost(const mhe_solve_info *info) {
    return info->outcome == MHE_SOLVE_INFEASIBLE || info->outcome == MHE_SOLVE_FAILED ||
           !isfinite(info->objective);
}

mhe_status mhi_calibration_search(mhi_calibration *c, mhi_ocp *ocp, const mhe_solver_ops *solver,
                                  void *self, mhe_solution *s, mhe_error *err) {
    counter n = {.c = c};
    const mhe_solve_control control = {.size = sizeof control, .progress = count, .data = &n};
    double *lower = MHI_TAKE(&c->arena, double, c->n), *upper = MHI_TAKE(&c->arena, double, c->n);
    double radius = FIRST_RADIUS, before = INFINITY;
    point keep;
    mhe_status status = make_point(c, ocp, &keep, err);
    if (lower == NULL || upper == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t held = 1; status == MHE_OK && held && n.done < c->plan.max_iterations;) {
        set_region(c, ocp, s->p, radius, lower, upper);
        n.limit = SHORT;
        keep_point(&keep, s);
        c->info = (mhe_solve_info){.size = sizeof c->info};
        status = solver->solve(self, &control, s, &c->info, err);
        n.done += c->info.iterations > 0 ? c->info.iterations : 1;
        if (status != MHE_OK) {
            break;
        }
        if (mhi_calibration_is_lost(&c->info)) { /* too far for the linearisation */
            come_back(&keep, s);
            radius *= 0.25;
            held = radius >= LEAST_RADIUS;
            continue;
        }
        const double gain = before - c->info.objective;
        held = is_held(c, s->p, lower, upper) || !(gain < 1e-3 * fabs(before));
        radius = gain > 0.02 * fabs(before)   ? fmin(2 * radius, MOST_RADIUS)
                 : gain < 1e-4 * fabs(before) ? 0.5 * radius
                                              : radius;
        held = held && radius >= LEAST_RADIUS;
        before = c->info.objective;
    }
    if (status == MHE_OK) { /* without a region */
        set_region(c, ocp, s->p, INFINITY, lower, upper);
        n.limit = c->plan.max_iterations;
        n.still = 0;
        keep_point(&keep, s);
        status = solver->solve(self, &control, s, &c->info, err);
        c->info.iterations += n.done;
        if (status == MHE_OK && mhi_calibration_is_lost(&c->info)) {
            come_back(&keep, s);
        }
    }
    if (status == MHE_OK && c->info.outcome == MHE_SOLVE_INTERRUPTED) {
        c->info.outcome = n.still >= STILL ? MHE_SOLVE_CONVERGED : MHE_SOLVE_ITERATION_LIMIT;
    }
    return status;
}
