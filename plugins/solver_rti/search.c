/* SPDX-License-Identifier: Apache-2.0 */
/* search.c: a step that must help, from any start: it lowers an exact penalty, the merit, or passes
 * a filter. */
#include "rti.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define ARMIJO 1e-4        /* part of the predicted decrease that must come true */
#define LESS 1e-5          /* part of the gaps by which a point must be better than another */
#define TUBE 3e-3          /* sum of the gaps of an interval, rad, rad/s, 1: still a motion */
#define LEAST_DAMPING 1e-3 /* the first of Levenberg's, for controls of curvature 1 */
#define MOST_DAMPING 1e9
/* Part of the least residual so far that a step may leave, whatever its merit. */
#define NEARER 0.5

/* Along the step of the program. */
typedef struct slopes {
    double cost, merit;
} slopes;

/* ---- merit = cost + sum of penalty * |gap| ---- */

static double merit(const rti_solver *s, const rti_point *point) {
    return point->cost +
           (s->shape.n_p > 0 ? rti_weighted_gaps(s, point) : s->penalty * rti_gap_sum(s, point));
}

/* Each gap a penalty of its own, above its multiplier, that falls again by halves (Powell 1978): in
 * a problem of a thousand gaps of all kinds the largest multiplier of all would forbid every step
 * that bends. */
static double raise_weights(rti_solver *s) {
    for (size_t i = 0; i < size_x(&s->shape); i++) {
        const double least = 1.1 * fabs(s->qp.lambda[i]);
        s->weight[i] = fmax(least, 0.5 * (s->weight[i] + least));
    }
    return rti_weighted_gaps(s, &s->here);
}

/* Raises the penalties above the multipliers first. */
static slopes slopes_of(rti_solver *s) {
    const double largest = rti_largest_multiplier(s);
    slopes slope = {0, 0};
    if (s->penalty < 1.1 * largest) {
        s->penalty = RTI_PENALTY * largest;
    }
    for (int32_t k = 0; k <= s->shape.N; k++) {
        const double *step = row_z(&s->shape, s->qp.w, k);
        for (int32_t i = 0; i < s->shape.n_z; i++) {
            slope.cost += s->here.stages[k].g[i] * step[i];
        }
        for (int32_t i = 0; i < s->shape.n_p; i++) {
            slope.cost += s->here.stages[k].d[i] * row_p(&s->shape, s->qp.w)[i];
        }
    }
    const double gaps = s->shape.n_p > 0 ? raise_weights(s) : s->penalty * s->gap_sum;
    slope.merit = fmin(slope.cost - gaps, 0);
    return slope;
}

static int32_t has_less_merit(const rti_solver *s, double length, const slopes *slope) {
    const double before = merit(s, &s->here);
    return merit(s, &s->trial) <=
           before + ARMIJO * length * slope->merit + 1e-12 * (1 + fabs(before));
}

/* ---- the filter ----
 * Long steps along curved constraints make gaps that outweigh what little cost they save, and the
 * merit cuts them to pieces. So a full step of a window is also taken where its cost or its gaps
 * are less than those of each point of this solve so far (Fletcher and Leyffer 2002,
 * doi:10.1007/s101070100244), within a tube about the motions of the model (Gould and Toint 2010,
 * doi:10.1007/s10107-008-0244-7). */

static void remember(rti_filter *f, double gaps, double cost) {
    f->gaps[f->n % RTI_REMEMBERED] = gaps;
    f->cost[f->n % RTI_REMEMBERED] = cost;
    f->n++;
}

static int32_t passes(const rti_filter *f, double gaps, double cost) {
    int32_t good = 1;
    for (int32_t i = 0; i < f->n && i < RTI_REMEMBERED; i++) {
        good &= gaps <= (1 - LESS) * f->gaps[i] || cost <= f->cost[i] - LESS * f->gaps[i];
    }
    return good;
}

static int32_t is_new(const rti_solver *s, const slopes *slope) {
    const double gaps = rti_gap_sum(s, &s->trial), cost = s->trial.cost;
    const double least = ARMIJO * fmin(slope->cost, 0) - LESS * s->gap_sum;
    return gaps <= fmax(s->gap_sum, TUBE * s->shape.N) && passes(&s->filter, gaps, cost) &&
           (gaps <= (1 - LESS) * s->gap_sum || cost <= s->here.cost + least);
}

/* Is the trial point good enough after this length? Its cost and gaps must be known. */
static int32_t is_better(const rti_solver *s, double length, const slopes *slope) {
    return has_less_merit(s, length, slope) ||
           (length == 1 && s->shape.n_p == 0 && is_new(s, slope));
}

/* What of a difference of merits means nothing: the part of the cost that the program, solved to
 * its limits, leaves open, and rounding. */
static double noise(const rti_solver *s) {
    double size = 0;
    for (size_t i = 0; i < size_z(&s->shape); i++) {
        size += fabs(s->here.w[i]);
    }
    return s->qp.open + 10 * DBL_EPSILON * (fabs(s->here.cost) + s->penalty * size);
}

/* Close to the solution there is less to gain than noise, and merit and filter are deaf. Is the
 * trial point, with the multipliers of the program, then much nearer to the optimality conditions
 * than any point of this solve? As their residual is halved each time, such steps come to an end.
 */
static int32_t is_nearer(rti_solver *s, const slopes *slope) {
    if (-slope->merit > noise(s)) {
        return 0;
    }
    const rti_residuals r =
        rti_residuals_of(s, &s->trial, s->qp.lambda, s->qp.z_lower, s->qp.z_upper);
    return rti_excess(&r) <= NEARER * s->least_excess;
}

/* A second look at a full step that was refused: the program once more with the gaps that the step
 * left (second-order correction: Fletcher 1982; along curved constraints good steps are else
 * refused, the Maratos effect). The refused point's gaps are in trial. */
static int32_t second_look(rti_solver *s, const slopes *slope) {
    const qp_shape *shape = &s->shape;
    const size_t bytes = sizeof(double) * (size_t)shape->n_x;
    for (int32_t k = 0; k < shape->N; k++) {
        double *b = s->here.stages[k].b;
        memcpy(row_x(shape, s->gaps, k), b, bytes);
        for (int32_t i = 0; i < shape->n_x; i++) {
            b[i] += s->trial.stages[k].b[i];
        }
    }
    const int32_t result = rti_program(s, 1);
    for (int32_t k = 0; k < shape->N; k++) {
        memcpy(s->here.stages[k].b, row_x(shape, s->gaps, k), bytes);
    }
    if (result == QP_LATE) {
        return 0;
    }
    if (result == QP_SOLVED) {
        rti_reach(s, 1);
        if (rti_evaluate(s, &s->trial, RTI_ALL) && is_better(s, 1, slope)) {
            return 1;
        }
    }
    (void)rti_program(s, 0); /* the first step again, to be shortened */
    return 0;
}

/* Shortens the step until the trial point is better; the length, 0: none found. The point is
 * then known with derivatives. */
static double search(rti_solver *s, const slopes *slope) {
    double length = 0.5;
    for (int32_t i = 0; i < RTI_HALVINGS; i++, length /= 2) {
        rti_reach(s, length);
        if (rti_evaluate(s, &s->trial, RTI_DYNAMICS | RTI_COSTS) && is_better(s, length, slope)) {
            return rti_evaluate(s, &s->trial, RTI_ALL) ? length : 0;
        }
        if (s->failure != MHE_OK || rti_is_over(s)) {
            return 0;
        }
    }
    return 0;
}

/* Levenberg's term follows how well the linearisation predicted: none while full steps go well. */
static void adapt_damping(rti_solver *s, double length) {
    if (length == 1) {
        s->damping = s->damping > LEAST_DAMPING ? s->damping / 4 : 0;
    } else if (length < 0.25) {
        s->damping = fmax(4 * s->damping, LEAST_DAMPING);
    }
}

/* Tries the step of a solved program; the part of it that was gone, 0: none. */
static double try_step(rti_solver *s, int32_t result) {
    const slopes slope = slopes_of(s);
    rti_reach(s, 1);
    const int32_t known = rti_evaluate(s, &s->trial, RTI_ALL);
    if (known && (is_better(s, 1, &slope) || is_nearer(s, &slope))) {
        return 1;
    }
    if (known && result == QP_SOLVED && !rti_is_over(s) && second_look(s, &slope)) {
        return 1;
    }
    return s->failure == MHE_OK && !rti_is_over(s) ? search(s, &slope) : 0;
}

int32_t rti_step_globalised(rti_solver *s, int32_t cut) {
    while (s->damping <= MOST_DAMPING) {
        rti_set_damping(s, &s->here, s->config->regularisation + s->damping);
        const int32_t result = rti_program(s, 0);
        if (result == QP_LATE) {
            return cut && s->damping == 0 ? rti_cut_short(s) : RTI_LATE;
        }
        const double before = s->gap_sum;
        const double length = result == QP_FAILED ? 0 : try_step(s, result);
        if (length > 0) {
            remember(&s->filter, s->gap_sum, s->here.cost);
            rti_accept(s, length);
            adapt_damping(s, length);
            const int32_t stays = rti_gap_sum(s, &s->here) > 0.9 * before;
            return result == QP_INFEASIBLE && stays ? RTI_INFEASIBLE : RTI_MOVED;
        }
        if (s->failure != MHE_OK) {
            break;
        }
        if (rti_is_over(s)) {
            return RTI_LATE;
        }
        if (result == QP_INFEASIBLE) {
            return RTI_INFEASIBLE;
        }
        s->damping = fmax(10 * s->damping, LEAST_DAMPING);
    }
    return RTI_STUCK;
}
