/* SPDX-License-Identifier: Apache-2.0 */
/* search.c: the way to the solution.
 *
 * Passive forces grow exponentially with lengths, so that the linearisation holds for small changes
 * of the parameters only. They may change by a part of their standard deviation (a trust region),
 * for a few iterations; then the region is moved, and made larger or smaller by how much was
 * gained. */
#include "calibrate/calibrate.h"

#include <math.h>

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

mhe_status mhi_calibration_search(mhi_calibration *c, mhi_ocp *ocp, const mhe_solver_ops *solver,
                                  void *self, mhe_solution *s, mhe_error *err) {
    counter n = {.c = c};
    const mhe_solve_control control = {.size = sizeof control, .progress = count, .data = &n};
    double *lower = MHI_TAKE(&c->arena, double, c->n), *upper = MHI_TAKE(&c->arena, double, c->n);
    double radius = FIRST_RADIUS, before = INFINITY;
    mhe_status status =
        lower == NULL || upper == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    for (int32_t held = 1; status == MHE_OK && held && n.done < c->plan.max_iterations;) {
        set_region(c, ocp, s->p, radius, lower, upper);
        n.limit = SHORT;
        c->info = (mhe_solve_info){.size = sizeof c->info};
        status = solver->solve(self, &control, s, &c->info, err);
        n.done += c->info.iterations > 0 ? c->info.iterations : 1;
        if (status != MHE_OK) {
            break;
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
        status = solver->solve(self, &control, s, &c->info, err);
        c->info.iterations += n.done;
    }
    if (status == MHE_OK && c->info.outcome == MHE_SOLVE_INTERRUPTED) {
        c->info.outcome = n.still >= STILL ? MHE_SOLVE_CONVERGED : MHE_SOLVE_ITERATION_LIMIT;
    }
    return status;
}
