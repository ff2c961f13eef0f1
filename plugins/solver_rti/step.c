/* SPDX-License-Identifier: Apache-2.0 */
/* step.c: from one iterate to the next. */
#include "rti.h"

#include <float.h>
#include <math.h>
#include <string.h>

#define MAX_HALVINGS 8
#define MOST_LOOSE 1e3
#define UNSETTLED 1000     /* one of so many variables, far from the solution */
#define ARMIJO 1e-4        /* part of the predicted decrease that must come true */
#define LEAST_DAMPING 1e-3 /* the first of Levenberg's, for controls of curvature 1 */
#define MOST_DAMPING 1e9
#define PENALTY 1.5 /* of the gaps, times the largest multiplier */
/* Part of the least residual so far that a step may leave, whatever its merit. */
#define NEARER 0.5

int32_t rti_is_spent(rti_solver *s) {
    const mhe_solve_control *control = s->control;
    const int32_t solutions = qp_take_work(&s->qp);
    return control != NULL && control->spent != NULL && control->spent(control->budget, solutions);
}

int32_t rti_is_late(const rti_solver *s, double seconds) {
    const mhe_solve_control *control = s->control;
    return control != NULL && control->late != NULL
               ? control->late(control->budget, seconds)
               : isfinite(s->deadline) && rti_now() + seconds >= s->deadline;
}

void rti_tick(const rti_solver *s) {
    const mhe_solve_control *control = s->control;
    if (control != NULL && control->late != NULL) {
        (void)control->late(control->budget, 0);
    }
}

/* Before each iteration of a program, too. */
static int32_t is_late(const void *data) {
    rti_solver *s = (rti_solver *)data; /* whose count of solutions is told */
    return rti_is_spent(s) || rti_is_late(s, 0);
}

/* How far from its limits the program of a whole recording may stay while the iterate is far from
 * the solution: which of ten thousand bounds hold to the last digit is then no news. */
static double looseness(const rti_solver *s) {
    return s->shape.n_p == 0
               ? 1
               : fmin(fmax(0.1 * rti_excess(&s->residuals) / s->config->tolerance, 1), MOST_LOOSE);
}

/* The quadratic program at `here` -> s->qp.w, a step; QP_*. Its bounds and dynamics are met
 * closely: what is left of them, times large multipliers, is noise in the merit function. */
static int32_t solve_program(rti_solver *s, int32_t from_last) {
    qp *q = &s->qp;
    const size_t n = size_z(&s->shape);
    const double loose = looseness(s), tolerance = s->config->tolerance * loose;
    const qp_limits limits = {.stationarity = 0.1 * tolerance,
                              .feasibility = fmax(1e-4 * tolerance, 1e-12),
                              .complementarity = 0.01 * tolerance,
                              .max_iterations = s->config->max_qp_iterations,
                              .regularisation = 1e-9,
                              .unsettled = loose > 1 ? (int32_t)(n / UNSETTLED) : 0,
                              .is_late = s->control != NULL ? is_late : NULL,
                              .data = s};
    for (size_t i = 0; i < n; i++) {
        q->lower[i] = s->lower[i] - s->here.w[i];
        q->upper[i] = s->upper[i] - s->here.w[i];
    }
    if (!from_last) {
        memset(q->w, 0, sizeof(double) * n);
        memcpy(q->lambda, s->lambda, sizeof(double) * size_x(&s->shape));
        memcpy(q->z_lower, s->z_lower, sizeof(double) * n);
        memcpy(q->z_upper, s->z_upper, sizeof(double) * n);
    }
    const int32_t result = qp_solve(q, s->here.stages, &limits, s->warm);
    /* Bounds missed by no more than the gap that a converged solve may leave are no contradiction.
     */
    return result == QP_INFEASIBLE && q->feasibility <= 0.1 * s->config->tolerance ? QP_LIMIT
                                                                                   : result;
}

/* trial.w = here.w + length * step, within the bounds. */
static void reach(rti_solver *s, double length) {
    for (size_t i = 0; i < size_z(&s->shape); i++) {
        const double w = s->here.w[i] + length * s->qp.w[i];
        s->trial.w[i] = smaller(s->upper[i], larger(s->lower[i], w));
    }
}

/* Longest component of the step to the trial point in n variables. */
static double longest(const rti_solver *s, int32_t from, int32_t n) {
    double length = 0;
    for (int32_t i = from; i < from + n; i++) {
        length = larger(length, fabs(s->trial.w[i] - s->here.w[i]));
    }
    return length;
}

/* The same of the first controls, where some may be torques of hundreds of N m and others parts of
 * a whole: a control that the cost bends less than the most bent one counts for as much less (equal
 * parts of their sigmas count alike), but never for less than its part of its range. */
static double longest_control(const rti_solver *s) {
    const double *H = s->here.stages[0].H;
    double most = 0, length = 0;
    for (int32_t i = 0; i < s->shape.n_u; i++) {
        most = fmax(most, H[i * (s->shape.ld_z + 1)]);
    }
    for (int32_t i = 0; i < s->shape.n_u; i++) {
        const double bent = most > 0 ? H[i * (s->shape.ld_z + 1)] / most : 1;
        const double part = fmax(sqrt(fmax(bent, 0)), 1 / (s->upper[i] - s->lower[i]));
        length = fmax(length, fmin(part, 1) * fabs(s->trial.w[i] - s->here.w[i]));
    }
    return length;
}

static void blend(double length, size_t n, const double *to, double *from) {
    for (size_t i = 0; i < n; i++) {
        from[i] += length * (to[i] - from[i]);
    }
}

static void accept_multipliers(rti_solver *s, double length) {
    const size_t n = size_z(&s->shape);
    blend(length, size_x(&s->shape), s->qp.lambda, s->lambda);
    blend(length, n, s->qp.z_lower, s->z_lower);
    blend(length, n, s->qp.z_upper, s->z_upper);
    s->warm = 1;
}

/* The trial point becomes `here`. */
static void accept(rti_solver *s, double length) {
    const rti_point old = s->here;
    s->here = s->trial;
    s->trial = old;
    accept_multipliers(s, length);
}

/* Share of the parameters in it, of the step in s->slope. */
static double model_cost_p(rti_solver *s) {
    const qp_shape *shape = &s->shape;
    double *step = row_p(shape, s->slope), *slope = row_p(shape, s->qp.slope), cost = 0;
    for (int32_t i = 0; i < shape->n_p; i++) {
        step[i] = row_p(shape, s->trial.w)[i] - row_p(shape, s->here.w)[i];
        slope[i] = -0.5 * s->here.damping * step[i];
    }
    for (int32_t k = 0; k <= shape->N; k++) {
        const qp_stage *stage = &s->here.stages[k];
        qp_add_costs_p(shape, stage, row_z(shape, s->slope, k), step, 0.5, slope);
        for (int32_t i = 0; i < shape->n_p; i++) {
            slope[i] += stage->d[i];
        }
    }
    for (int32_t i = 0; i < shape->n_p; i++) {
        cost += slope[i] * step[i];
    }
    return cost;
}

/* The quadratic model without its damping at the trial point, scaled; the step -> s->slope. */
static double model_cost(rti_solver *s) {
    const qp_shape *shape = &s->shape;
    double cost = s->here.cost;
    for (int32_t k = 0; k <= shape->N; k++) {
        const double *from = row_z(shape, s->here.w, k), *to = row_z(shape, s->trial.w, k);
        double *step = row_z(shape, s->slope, k), *slope = row_z(shape, s->qp.slope, k);
        for (int32_t i = 0; i < shape->ld_z; i++) {
            step[i] = to[i] - from[i];
            slope[i] = s->here.stages[k].g[i] - 0.5 * s->here.damping * step[i];
        }
        qp_add_curvature(shape, &s->here.stages[k], 0.5, step, slope);
        for (int32_t i = 0; i < shape->n_z; i++) {
            cost += slope[i] * step[i];
        }
    }
    return shape->n_p > 0 ? cost + model_cost_p(s) : cost;
}

/* Gaps at the trial point by the linearisation, of the step in s->slope: largest; the sum. */
static double model_gaps(rti_solver *s, double *sum) {
    const qp_shape *shape = &s->shape;
    double largest = *sum = 0;
    for (int32_t k = 0; k < shape->N; k++) {
        const double *next = row_z(shape, s->slope, k + 1) + shape->n_u;
        double *gap = row_x(shape, s->gaps, k);
        for (int32_t i = 0; i < shape->n_x; i++) {
            gap[i] = s->here.stages[k].b[i] - next[i];
        }
        qp_forward(shape, &s->here.stages[k], row_z(shape, s->slope, k), gap);
        if (shape->n_p > 0) {
            qp_forward_p(shape, &s->here.stages[k], row_p(shape, s->slope), gap);
        }
        for (int32_t i = 0; i < shape->n_x; i++) {
            largest = larger(largest, fabs(gap[i]));
            *sum += fabs(gap[i]);
        }
    }
    return largest;
}

/* The merit function is exact where its penalty is above this. */
static double largest_multiplier(const rti_solver *s) {
    double largest = 0;
    for (size_t i = 0; i < size_x(&s->shape); i++) {
        largest = larger(largest, fabs(s->qp.lambda[i]));
    }
    return largest;
}

/* The step to the result of a program as the last of a solve. That of a program cut short is taken
 * where it closes the gaps of the linearised dynamics and lowers its merit function. */
static int32_t leap(rti_solver *s, int32_t result) {
    rti_leap *leap = &s->leap;
    *leap = (rti_leap){.solved = result == QP_SOLVED, .length = 1};
    for (int32_t i = 0; i <= MAX_HALVINGS; i++, leap->length /= 2) {
        reach(s, leap->length);
        leap->first_gap = rti_first_gap(s, s->trial.w);
        if (s->failure != MHE_OK) {
            break;
        }
        if (isfinite(leap->first_gap)) {
            double sum;
            const double penalty = PENALTY * largest_multiplier(s);
            leap->cost = model_cost(s);
            leap->left = model_gaps(s, &sum);
            if (result == QP_LATE &&
                !(leap->left <= s->config->tolerance &&
                  leap->cost + penalty * sum < s->here.cost + penalty * s->gap_sum)) {
                return RTI_LATE;
            }
            leap->taken = 1;
            leap->front =
                fmax(longest_control(s), longest(s, s->shape.ld_z + s->shape.n_u, s->shape.n_x));
            double *const from = s->here.w;
            s->here.w = s->trial.w;
            s->trial.w = from;
            accept_multipliers(s, leap->length);
            return result == QP_LATE ? RTI_CUT : RTI_MOVED;
        }
    }
    return RTI_STUCK;
}

/* From a program that is not to be stepped on further. */
static int32_t cut_short(rti_solver *s) {
    return s->qp.iterations > 0 ? leap(s, QP_LATE) : RTI_LATE;
}

int32_t rti_leap_on(rti_solver *s) {
    rti_set_damping(s, &s->here, s->config->regularisation);
    const int32_t result = solve_program(s, 0);
    return result == QP_FAILED ? RTI_STUCK : result == QP_LATE ? cut_short(s) : leap(s, result);
}

int32_t rti_step_full(rti_solver *s) {
    rti_set_damping(s, &s->here, s->config->regularisation);
    const int32_t result = solve_program(s, 0);
    if (result == QP_FAILED || result == QP_LATE) {
        return result == QP_FAILED ? RTI_STUCK : cut_short(s);
    }
    double length = 1;
    for (int32_t i = 0; i <= MAX_HALVINGS; i++, length /= 2) {
        reach(s, length);
        if (rti_evaluate(s, &s->trial, RTI_ALL)) {
            accept(s, length);
            return RTI_MOVED;
        }
        if (s->failure != MHE_OK) {
            break;
        }
        if (is_late(s)) {
            return RTI_LATE;
        }
    }
    return RTI_STUCK;
}

/* ---- globalised by an exact penalty: merit = cost + sum weight |gap| ---- */

static double merit(const rti_solver *s, const rti_point *point) {
    return point->cost + rti_weighted_gaps(s, point);
}

/* Each gap has a penalty of its own, above its multiplier, that falls again by halves (Powell 1978,
 * doi:10.1007/BFb0067703). Multipliers of angles are a thousand times those of velocities and
 * activations: by the largest of all a step that bends a velocity counts as a thousand times what
 * it costs, and is refused down to its hundredth. Where bounds and dynamics contradict each other
 * multipliers say nothing, and all gaps count alike. */
static double raise_weights(rti_solver *s, int32_t alike) {
    const double largest = PENALTY * largest_multiplier(s);
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

/* A second look at a full step that was refused: the program once more with the gaps that the step
 * left (second-order correction: Fletcher 1982; the penalty function else refuses good steps along
 * curved constraints, the Maratos effect). The refused point's gaps are in trial. */
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
    const int32_t result = solve_program(s, 1);
    for (int32_t k = 0; k < shape->N; k++) {
        memcpy(s->here.stages[k].b, row_x(shape, s->gaps, k), bytes);
    }
    if (result == QP_LATE) {
        return 0;
    }
    if (result == QP_SOLVED) {
        reach(s, 1);
        if (rti_evaluate(s, &s->trial, RTI_ALL) && is_better(s, 1, slope)) {
            return 1;
        }
    }
    (void)solve_program(s, 0); /* the first step again, to be shortened */
    return 0;
}

/* Shortens the step until the merit function is better; the length, 0: none found. The point is
 * then known with derivatives. */
static double search(rti_solver *s, double slope) {
    double length = 0.5;
    for (int32_t i = 0; i < MAX_HALVINGS; i++, length /= 2) {
        reach(s, length);
        if (rti_evaluate(s, &s->trial, RTI_DYNAMICS | RTI_COSTS) && is_better(s, length, slope)) {
            return rti_evaluate(s, &s->trial, RTI_ALL) ? length : 0;
        }
        if (s->failure != MHE_OK || is_late(s)) {
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
    const double slope = merit_slope(s, result == QP_INFEASIBLE && s->shape.n_p == 0);
    reach(s, 1);
    const int32_t known = rti_evaluate(s, &s->trial, RTI_ALL);
    if (known && (is_better(s, 1, slope) || is_nearer(s, slope))) {
        return 1;
    }
    if (known && result == QP_SOLVED && !is_late(s) && second_look(s, slope)) {
        return 1;
    }
    return s->failure == MHE_OK && !is_late(s) ? search(s, slope) : 0;
}

int32_t rti_step_globalised(rti_solver *s, int32_t cut) {
    while (s->damping <= MOST_DAMPING) {
        rti_set_damping(s, &s->here, s->config->regularisation + s->damping);
        const int32_t result = solve_program(s, 0);
        if (result == QP_LATE) {
            return cut && s->damping == 0 ? cut_short(s) : RTI_LATE;
        }
        const double before = s->gap_sum;
        const double length = result == QP_FAILED ? 0 : try_step(s, result);
        if (length > 0) {
            accept(s, length);
            adapt_damping(s, length);
            const int32_t stays = rti_gap_sum(s, &s->here) > 0.9 * before;
            return result == QP_INFEASIBLE && stays ? RTI_INFEASIBLE : RTI_MOVED;
        }
        if (s->failure != MHE_OK) {
            break;
        }
        if (is_late(s)) {
            return RTI_LATE;
        }
        if (result == QP_INFEASIBLE) {
            return RTI_INFEASIBLE;
        }
        s->damping = fmax(10 * s->damping, LEAST_DAMPING);
    }
    return RTI_STUCK;
}
