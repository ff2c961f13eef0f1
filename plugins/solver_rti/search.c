/* SPDX-License-Identifier: Apache-2.0 */
/* search.c: a step that must help, from any start: it lowers an exact penalty, the merit. */
#include "rti.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define ARMIJO 1e-4        /* part of the predicted decrease that must come true */
#define LEAST_DAMPING 1e-3 /* the first of Levenberg's, for controls of curvature 1 */
#define MOST_DAMPING 1e9
/* Part of the least residual so far that a step may leave, whatever its merit. */
#define NEARER 0.5
#define MOST_MISSED 12 /* kinks of a solve that are looked for in vain */
#define LEVEL 0.1      /* part of the tolerance under which a slope is none */
#define NEAR 1000      /* tolerances from the solution */

/* merit = cost + sum of weight * |gap| */
static double merit(const rti_solver *s, const rti_point *point) {
    return point->cost + rti_weighted_gaps(s, point);
}

/* Each gap has a penalty of its own, above its multiplier, that falls again by halves (Powell 1978,
 * doi:10.1007/BFb0067703). Multipliers of angles are a thousand times those of velocities and
 * activations: by the largest of all a step that bends a velocity counts as a thousand times what
 * it costs, and is refused down to its hundredth. Where bounds and dynamics contradict each other
 * multipliers say nothing, and all gaps count alike. */
static double raise_weights(rti_solver *s, int32_t alike) {
    const double largest = RTI_PENALTY * rti_largest_multiplier(s);
    s->penalty = 0;
    for (size_t i = 0; i < size_x(&s->shape); i++) {
        const double least = alike ? largest : 1.1 * fabs(s->qp.lambda[i]);
        s->weight[i] = fmax(least, 0.5 * (s->weight[i] + least));
        s->penalty = fmax(s->penalty, s->weight[i]);
    }
    return rti_weighted_gaps(s, &s->here);
}

/* Slope of the merit function along the step; raises the weights above the multipliers first. */
static double merit_slope(rti_solver *s, int32_t alike) {
    double slope = 0;
    for (int32_t k = 0; k <= s->shape.N; k++) {
        const double *step = row_z(&s->shape, s->qp.w, k);
        for (int32_t i = 0; i < s->shape.n_z; i++) {
            slope += s->here.stages[k].g[i] * step[i];
        }
        for (int32_t i = 0; i < s->shape.n_p; i++) {
            slope += s->here.stages[k].d[i] * row_p(&s->shape, s->qp.w)[i];
        }
    }
    return fmin(slope - raise_weights(s, alike), 0);
}

/* Is the trial point good enough after this length? Its merit must be known. */
static int32_t is_better(const rti_solver *s, double length, double slope) {
    const double before = merit(s, &s->here);
    return merit(s, &s->trial) <= before + ARMIJO * length * slope + 1e-12 * (1 + fabs(before));
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

/* Close to the solution there is less to gain than noise, and the merit function is deaf. Is the
 * trial point, with the multipliers of the program, then much nearer to the optimality conditions
 * than any point of this solve? As their residual is halved each time, such steps come to an end.
 */
static int32_t is_nearer(rti_solver *s, double slope) {
    if (-slope > noise(s)) {
        return 0;
    }
    const rti_residuals r =
        rti_residuals_of(s, &s->trial, s->qp.lambda, s->qp.z_lower, s->qp.z_upper);
    return rti_excess(&r) <= NEARER * s->least_excess;
}

/* The program's result is put aside, or is there again: what a step is made of. */
static void keep_residuals(rti_solver *s) {
    const qp *q = &s->qp;
    s->first.stationarity = q->stationarity;
    s->first.feasibility = q->feasibility;
    s->first.complementarity = q->complementarity;
    s->first.open = q->open;
}

static void keep_first(rti_solver *s) {
    const size_t z = sizeof(double) * size_z(&s->shape), x = sizeof(double) * size_x(&s->shape);
    const qp *q = &s->qp;
    memcpy(s->first.w, q->w, z);
    memcpy(s->first.z_lower, q->z_lower, z);
    memcpy(s->first.z_upper, q->z_upper, z);
    memcpy(s->first.lambda, q->lambda, x);
    keep_residuals(s);
}

static void recall_first(rti_solver *s) {
    const size_t z = sizeof(double) * size_z(&s->shape), x = sizeof(double) * size_x(&s->shape);
    qp *q = &s->qp;
    memcpy(q->w, s->first.w, z);
    memcpy(q->z_lower, s->first.z_lower, z);
    memcpy(q->z_upper, s->first.z_upper, z);
    memcpy(q->lambda, s->first.lambda, x);
    q->stationarity = s->first.stationarity;
    q->feasibility = s->first.feasibility;
    q->complementarity = s->first.complementarity;
    q->open = s->first.open;
}

/* A second look at a full step that was refused: the program once more with the gaps that the step
 * left (second-order correction: Fletcher 1982; along curved constraints good steps are else
 * refused, the Maratos effect). The refused point's gaps are in trial. */
static int32_t second_look(rti_solver *s, double slope) {
    const qp_shape *shape = &s->shape;
    const size_t bytes = sizeof(double) * (size_t)shape->n_x;
    for (int32_t k = 0; k < shape->N; k++) {
        double *b = s->here.stages[k].b;
        memcpy(row_x(shape, s->gaps, k), b, bytes);
        for (int32_t i = 0; i < shape->n_x; i++) {
            b[i] += s->trial.stages[k].b[i];
        }
    }
    keep_first(s);
    const int32_t result = rti_program(s, 1);
    for (int32_t k = 0; k < shape->N; k++) {
        memcpy(s->here.stages[k].b, row_x(shape, s->gaps, k), bytes);
    }
    if (result == QP_SOLVED) {
        rti_reach(s, 1);
        if (rti_evaluate(s, &s->trial, RTI_ALL) && is_better(s, 1, slope)) {
            return 1;
        }
    }
    recall_first(s); /* to be shortened */
    return 0;
}

/* Where the cost is flat, a program steps as far as its own proximal term lets it, and each step
 * leaves as large a gap as the last, for the dynamics are not flat: the cost falls by nothing that
 * can be seen, and nothing converges. Where two iterates in a row, near the solution, had no slope
 * to speak of, a step as long as the last may bring no more than such a slope: what is flat to the
 * tolerance is left alone, and the gaps close. */
static double hold(rti_solver *s) {
    const rti_residuals *r = &s->residuals;
    const double level = LEVEL * s->config->tolerance;
    const int32_t level_here = fmax(r->stationarity, 10 * r->complementarity) <= level &&
                               rti_excess(r) <= NEAR * s->config->tolerance;
    s->on_level = level_here ? s->on_level + 1 : 0;
    double longest = 0;
    for (size_t i = 0; s->on_level > 1 && i < size_z(&s->shape); i++) {
        longest = larger(longest, fabs(s->qp.w[i]));
    }
    return longest > 0 ? level / longest : 0;
}

static void set_damping(rti_solver *s) {
    rti_set_damping(s, &s->here, s->config->regularisation + s->held + s->damping);
}

/* Shortens the step until the trial point is better; the length, 0: none found. The point is
 * then known with derivatives. */
static double search(rti_solver *s, double slope) {
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

/* On a kink the merit function tells no points apart that are as near as its sides are held. */
static int32_t is_on_edge(const rti_solver *s) {
    return merit(s, &s->trial) <= merit(s, &s->here) + s->penalty * rti_edge(s);
}

/* The step along a kink between this iterate and `before`; where there is none to go, this is the
 * solution. Else back to where it came from. */
static int32_t step_along_kink(rti_solver *s, double share) {
    if (rti_step_along_kink(s, share)) {
        const rti_residuals r =
            rti_residuals_of(s, &s->here, s->qp.lambda, s->qp.z_lower, s->qp.z_upper);
        s->stays = rti_excess(&r) <= s->config->tolerance;
        if (s->stays) {
            return 1;
        }
        const double slope = merit_slope(s, 0);
        rti_reach(s, 1);
        s->on_kink =
            rti_evaluate(s, &s->trial, RTI_ALL) && (is_better(s, 1, slope) || is_on_edge(s));
        if (s->on_kink) {
            return 1;
        }
    }
    s->missed_kinks++;
    s->last_is_known = 0;
    memcpy(s->here.w, s->last_from, sizeof(double) * size_z(&s->shape));
    if (s->failure == MHE_OK && rti_evaluate(s, &s->here, RTI_ALL)) {
        set_damping(s);
    }
    return 0;
}

static int32_t may_seek_kink(rti_solver *s) {
    return s->failure == MHE_OK && s->missed_kinks < MOST_MISSED && !rti_is_over(s);
}

/* Tries the step to what lies between this program's result and the last one; where that does not
 * help, either, along a kink between both iterates. */
static int32_t step_between(rti_solver *s) {
    double share;
    const int32_t on_kink = s->on_kink;
    s->on_kink = 0;
    keep_residuals(s);
    int32_t what = rti_between(s, &share);
    if (what == 0 && on_kink && may_seek_kink(s) && rti_finds_kink(s, &share)) {
        what = RTI_KINK;
    }
    if (what == 0) {
        return 0;
    }
    if (what != RTI_KINK) {
        const double slope = merit_slope(s, 0);
        rti_reach(s, 1);
        if (rti_evaluate(s, &s->trial, RTI_ALL) &&
            (is_better(s, 1, slope) || is_nearer(s, slope))) {
            return 1;
        }
    }
    if (may_seek_kink(s) && step_along_kink(s, share)) {
        return 1;
    }
    recall_first(s);
    return 0;
}

/* Tries the step of a solved program; the part of it that was gone, 0: none. */
static double try_step(rti_solver *s, int32_t result) {
    const int32_t seeks = result == QP_SOLVED && s->shape.n_p == 0;
    double share;
    if (seeks && step_between(s)) {
        return 1;
    }
    if (s->failure != MHE_OK || rti_is_over(s)) {
        return 0;
    }
    const double slope = merit_slope(s, result == QP_INFEASIBLE && s->shape.n_p == 0);
    rti_reach(s, 1);
    const int32_t known = rti_evaluate(s, &s->trial, RTI_ALL);
    if (known && (is_better(s, 1, slope) || is_nearer(s, slope))) {
        return 1;
    }
    if (known && result == QP_SOLVED && !rti_is_over(s) && second_look(s, slope)) {
        return 1;
    }
    if (known && seeks && may_seek_kink(s) && rti_finds_kink(s, &share)) {
        keep_first(s);
        if (step_along_kink(s, share)) {
            return 1;
        }
        recall_first(s);
    }
    return s->failure == MHE_OK && !rti_is_over(s) ? search(s, slope) : 0;
}

int32_t rti_step_globalised(rti_solver *s, int32_t cut) {
    s->held = hold(s);
    while (s->damping <= MOST_DAMPING) {
        set_damping(s);
        const int32_t result = rti_program(s, 0);
        if (result == QP_LATE) {
            return cut && s->damping == 0 ? rti_cut_short(s) : RTI_LATE;
        }
        const double before = s->gap_sum;
        const double length = result == QP_FAILED ? 0 : try_step(s, result);
        if (length > 0 && s->stays) {
            rti_accept_multipliers(s, 1);
            return RTI_MOVED;
        }
        if (length > 0) {
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
