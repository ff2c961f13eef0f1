/* SPDX-License-Identifier: Apache-2.0 */
/* step.c: from one iterate to the next. */
#include "rti.h"

#include <math.h>
#include <string.h>

#define MOST_LOOSE 1e3
#define UNSETTLED 1000 /* one of so many variables, far from the solution */
#define FLAT 1e-5      /* proximal term of real-time iterations whose controls cost nothing */

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
int32_t rti_is_over(const void *data) {
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
int32_t rti_program(rti_solver *s, int32_t from_last) {
    qp *q = &s->qp;
    const size_t n = size_z(&s->shape);
    const double loose = looseness(s), tolerance = s->config->tolerance * loose;
    const qp_limits limits = {.stationarity = 0.1 * tolerance,
                              .feasibility = fmax(1e-4 * tolerance, 1e-12),
                              .complementarity = 0.01 * tolerance,
                              .max_iterations = s->config->max_qp_iterations,
                              .regularisation = 1e-9,
                              .unsettled = loose > 1 ? (int32_t)(n / UNSETTLED) : 0,
                              .is_late = s->control != NULL ? rti_is_over : NULL,
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
void rti_reach(rti_solver *s, double length) {
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

void rti_accept_multipliers(rti_solver *s, double length) {
    const size_t n = size_z(&s->shape);
    blend(length, size_x(&s->shape), s->qp.lambda, s->lambda);
    blend(length, n, s->qp.z_lower, s->z_lower);
    blend(length, n, s->qp.z_upper, s->z_upper);
    s->warm = 1;
}

/* The trial point becomes `here`. */
void rti_accept(rti_solver *s, double length) {
    const rti_point old = s->here;
    s->here = s->trial;
    s->trial = old;
    rti_accept_multipliers(s, length);
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

double rti_largest_multiplier(const rti_solver *s) {
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
    for (int32_t i = 0; i <= RTI_HALVINGS; i++, leap->length /= 2) {
        rti_reach(s, leap->length);
        leap->first_gap = rti_first_gap(s, s->trial.w);
        if (s->failure != MHE_OK) {
            break;
        }
        if (isfinite(leap->first_gap)) {
            double sum;
            const double penalty = RTI_PENALTY * rti_largest_multiplier(s);
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
            rti_accept_multipliers(s, leap->length);
            return result == QP_LATE ? RTI_CUT : RTI_MOVED;
        }
    }
    return RTI_STUCK;
}

/* From a program that is not to be stepped on further. */
int32_t rti_cut_short(rti_solver *s) {
    return s->qp.iterations > 0 ? leap(s, QP_LATE) : RTI_LATE;
}

/* Where no control has a cost of its own, optima are many, and a program goes to any of them, far
 * beyond what its linearisation is good for: nothing takes that back in the same window. A full
 * step stays near its start then, as far as that costs next to nothing. */
static void damp_full_step(rti_solver *s) {
    const qp_shape *shape = &s->shape;
    int32_t bent = 0;
    for (int32_t k = 0; k < shape->N && !bent; k++) {
        for (int32_t i = 0; i < shape->n_u && !bent; i++) {
            bent = s->here.stages[k].H[i * (shape->ld_z + 1)] > s->here.damping;
        }
    }
    const double given = s->config->regularisation;
    rti_set_damping(s, &s->here, bent ? given : fmax(given, FLAT));
}

int32_t rti_leap_on(rti_solver *s) {
    damp_full_step(s);
    const int32_t result = rti_program(s, 0);
    return result == QP_FAILED ? RTI_STUCK : result == QP_LATE ? rti_cut_short(s) : leap(s, result);
}

int32_t rti_step_full(rti_solver *s) {
    damp_full_step(s);
    const int32_t result = rti_program(s, 0);
    if (result == QP_FAILED || result == QP_LATE) {
        return result == QP_FAILED ? RTI_STUCK : rti_cut_short(s);
    }
    double length = 1;
    for (int32_t i = 0; i <= RTI_HALVINGS; i++, length /= 2) {
        rti_reach(s, length);
        if (rti_evaluate(s, &s->trial, RTI_ALL)) {
            rti_accept(s, length);
            return RTI_MOVED;
        }
        if (s->failure != MHE_OK) {
            break;
        }
        if (rti_is_over(s)) {
            return RTI_LATE;
        }
    }
    return RTI_STUCK;
}
