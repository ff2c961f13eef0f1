/* SPDX-License-Identifier: Apache-2.0 */
/* inside.c: a program by the interior point (qp.h). */
#include "qp.h"

#include <math.h>
#include <string.h>

#define SOFTNESS 1e-9        /* proximal weight in the multipliers of bounds */
#define LEAST_SOFTNESS 1e-13 /* ... at tight limits */
#define NEAREST 0.995        /* part of the way to the nearest bound that a step may go */
#define SHORT 0.1            /* a step so short gets nowhere */
#define LEAST_BARRIER 0.1    /* of the complementarity asked for */
#define COLD_SLACK 0.1       /* least slack of a cold start */
#define COLD_BARRIER 1.0     /* t z of a cold start */
#define WARM_SLACK 1e-2 /* least slack and multiplier of a warm start: few bounds change sides */
#define WARM_MULTIPLIER 1e-4
#define MAX_REGULARISATION 1e8

/* Is there a variable at place i of stage k? */
static int32_t first_place(const qp_shape *s, int32_t k) {
    return k < s->N ? 0 : s->n_u;
}

/* Place of the parameters. */
static ptrdiff_t first_p(const qp_shape *s) {
    return (ptrdiff_t)(s->N + 1) * s->ld_z;
}

static void add_side(qp *q, ptrdiff_t at, double sign, double bound, double z) {
    q->sides[q->n_sides++] = (qp_side){.at = (int32_t)at, .sign = sign, .bound = bound, .z = z};
}

static void collect_one(qp *q, ptrdiff_t at, int32_t equal) {
    const double lower = q->lower[at], upper = q->upper[at];
    if (q->fixed[at] || (lower == upper) != equal) {
        return;
    }
    if (equal) {
        add_side(q, at, 1, lower, q->z_lower[at] - q->z_upper[at]);
        return;
    }
    if (isfinite(lower)) {
        add_side(q, at, 1, lower, q->z_lower[at]);
    }
    if (isfinite(upper)) {
        add_side(q, at, -1, upper, q->z_upper[at]);
    }
}

/* Equalities: `equal`; else inequalities. */
static void collect(qp *q, int32_t equal) {
    const qp_shape *s = q->shape;
    for (int32_t k = 0; k <= s->N; k++) {
        for (int32_t i = first_place(s, k); i < s->n_z; i++) {
            collect_one(q, (ptrdiff_t)k * s->ld_z + i, equal);
        }
    }
    for (int32_t i = 0; i < s->n_p; i++) {
        collect_one(q, first_p(s) + i, equal);
    }
}

static void begin(qp *q, int32_t warm) {
    const qp_shape *s = q->shape;
    q->n_sides = 0;
    collect(q, 0);
    q->n_inequalities = q->n_sides;
    collect(q, 1);
    for (int32_t i = 0; i < q->n_sides; i++) {
        qp_side *side = &q->sides[i];
        const double distance = side->sign * (q->w[side->at] - side->bound);
        if (i >= q->n_inequalities) {
            side->t = 0;
            side->z = warm ? side->z : 0;
        } else if (warm) {
            side->t = fmax(distance, WARM_SLACK);
            side->z = fmax(side->z, WARM_MULTIPLIER);
        } else {
            side->t = fmax(distance, COLD_SLACK);
            side->z = COLD_BARRIER / side->t;
        }
    }
    if (!warm) {
        memset(q->lambda, 0, sizeof(double) * size_x(s));
    }
}

/* Residuals at the iterate; the mean of t z. */
static double measure(qp *q) {
    const qp_shape *s = q->shape;
    double sum = 0;
    qp_slope(s, q->stages, q->w, q->lambda, q->slope);
    q->stationarity = q->feasibility = q->complementarity = 0;
    for (int32_t i = 0; i < q->n_sides; i++) {
        qp_side *side = &q->sides[i];
        q->slope[side->at] -= side->sign * side->z;
        side->residual = side->sign * (q->w[side->at] - side->bound) - side->t;
        q->feasibility = fmax(q->feasibility, fabs(side->residual));
        q->complementarity = fmax(q->complementarity, side->t * side->z);
        sum += side->t * side->z;
    }
    for (int32_t k = 0; k <= s->N; k++) {
        for (int32_t i = first_place(s, k); i < s->n_z; i++) {
            const ptrdiff_t at = (ptrdiff_t)k * s->ld_z + i;
            q->slope[at] = q->fixed[at] ? 0 : q->slope[at];
            q->stationarity = fmax(q->stationarity, fabs(q->slope[at]));
        }
    }
    qp_gaps(s, q->stages, q->w, q->gap);
    for (size_t i = 0; i < size_x(s); i++) {
        q->feasibility = fmax(q->feasibility, fabs(q->gap[i]));
    }
    for (ptrdiff_t at = first_p(s); at < first_p(s) + s->n_p; at++) {
        q->slope[at] = q->fixed[at] ? 0 : q->slope[at];
        q->stationarity = fmax(q->stationarity, fabs(q->slope[at]));
    }
    q->open = sum;
    return q->n_inequalities > 0 ? sum / q->n_inequalities : 0;
}

/* Where bounds are redundant, their multipliers can move along a face, and a proximal term stops
 * them once it outweighs the slacks: it follows the barrier down, but not where bounds cannot be
 * met, for there it is all that keeps multipliers finite. */
static double softness(const qp *q, double barrier) {
    const double least = fmax(0.01 * barrier, 0.1 * q->feasibility);
    return fmin(fmax(least, LEAST_SOFTNESS), SOFTNESS);
}

/* The matrix of the Newton system at the iterate. 0: cannot be factorised however regularised. */
static int32_t factorise(qp *q) {
    const size_t n = size_z(q->shape);
    for (; q->regularisation < MAX_REGULARISATION; q->regularisation *= 100) {
        for (size_t i = 0; i < n; i++) {
            q->diagonal[i] = q->regularisation;
        }
        for (int32_t i = 0; i < q->n_sides; i++) {
            qp_side *side = &q->sides[i];
            side->weight =
                i < q->n_inequalities ? side->z / (side->t + q->softness * side->z) : 1 / SOFTNESS;
            q->diagonal[side->at] += side->weight;
        }
        if (qp_factor(q, q->fixed)) {
            return 1;
        }
        if (q->recursion == QP_KALMAN) {
            qp_use(q, QP_RICCATI);
            return factorise(q);
        }
    }
    return 0;
}

/* A second solve with what the first one left of the system. */
static void refine(qp *q) {
    const qp_shape *s = q->shape;
    for (int32_t k = 0; k <= s->N; k++) {
        const double *w = row_z(s, q->dw, k);
        double *rest = row_z(s, q->rest_w, k);
        for (int32_t i = 0; i < s->n_z; i++) {
            const ptrdiff_t at = (ptrdiff_t)k * s->ld_z + i;
            rest[i] = q->rhs[at] + q->diagonal[at] * w[i];
        }
        qp_add_curvature(s, &q->stages[k], 1, w, rest);
        for (int32_t i = 0; k > 0 && i < s->n_x; i++) {
            rest[s->n_u + i] += row_x(s, q->dlambda, k - 1)[i];
        }
        if (k < s->N) {
            double *gap = row_x(s, q->rest_x, k);
            const double *next = row_z(s, q->dw, k + 1) + s->n_u;
            qp_backward(s, &q->stages[k], -1, row_x(s, q->dlambda, k), rest);
            for (int32_t i = 0; i < s->n_x; i++) {
                gap[i] = row_x(s, q->gap, k)[i] - next[i];
            }
            qp_forward(s, &q->stages[k], w, gap);
        }
        if (s->n_p > 0) {
            qp_backward_p(s, &q->stages[k], row_p(s, q->dw), rest);
            if (k < s->N) {
                qp_forward_p(s, &q->stages[k], row_p(s, q->dw), row_x(s, q->rest_x, k));
            }
        }
    }
    for (ptrdiff_t at = first_p(s); at < first_p(s) + s->n_p; at++) {
        q->rest_w[at] = q->rhs[at] + q->diagonal[at] * q->dw[at];
    }
    qp_sum_p(s, q->stages, q->dw, q->dlambda, row_p(s, q->rest_w));
    q->solutions++; /* what is left takes about as long as a solution */
    qp_newton(q, q->rest_w, q->rest_x, q->fix_w, q->fix_lambda);
    for (size_t i = 0; i < size_z(s); i++) {
        q->dw[i] += q->fix_w[i];
    }
    for (size_t i = 0; i < size_x(s); i++) {
        q->dlambda[i] += q->fix_lambda[i];
    }
}

/* Newton step towards t z = barrier, with the second-order term of the last step or without. */
static void step(qp *q, double barrier, int32_t second_order) {
    memcpy(q->rhs, q->slope, sizeof(double) * size_z(q->shape));
    for (int32_t i = 0; i < q->n_sides; i++) {
        qp_side *side = &q->sides[i];
        side->shift = -side->weight * side->residual;
        if (i < q->n_inequalities) {
            const double target =
                barrier - side->t * side->z - (second_order ? side->dt * side->dz : 0);
            side->shift += target / (side->t + q->softness * side->z);
        }
        q->rhs[side->at] -= side->sign * side->shift;
    }
    qp_newton(q, q->rhs, q->gap, q->dw, q->dlambda);
    if (q->refine) {
        refine(q);
    }
    for (int32_t i = 0; i < q->n_sides; i++) {
        qp_side *side = &q->sides[i];
        const double move = side->sign * q->dw[side->at];
        side->dz = side->shift - side->weight * move;
        side->dt = i < q->n_inequalities ? move + q->softness * side->dz + side->residual : 0;
    }
}

/* Part of the step after which a slack or multiplier becomes 0; at most 1. */
static double longest(const qp *q) {
    double length = 1;
    for (int32_t i = 0; i < q->n_inequalities; i++) {
        const qp_side *side = &q->sides[i];
        if (side->t + length * side->dt < 0) {
            length = -side->t / side->dt;
        }
        if (side->z + length * side->dz < 0) {
            length = -side->z / side->dz;
        }
    }
    return length;
}

/* Mean of t z after this part of the step. */
static double barrier_after(const qp *q, double length) {
    double sum = 0;
    for (int32_t i = 0; i < q->n_inequalities; i++) {
        const qp_side *side = &q->sides[i];
        sum += (side->t + length * side->dt) * (side->z + length * side->dz);
    }
    return sum / q->n_inequalities;
}

static void move(qp *q, double length) {
    for (size_t i = 0; i < size_z(q->shape); i++) {
        q->w[i] += length * q->dw[i];
    }
    for (size_t i = 0; i < size_x(q->shape); i++) {
        q->lambda[i] += length * q->dlambda[i];
    }
    for (int32_t i = 0; i < q->n_sides; i++) {
        q->sides[i].t += length * q->sides[i].dt;
        q->sides[i].z += length * q->sides[i].dz;
    }
}

static void write_multipliers(qp *q) {
    memset(q->z_lower, 0, sizeof(double) * size_z(q->shape));
    memset(q->z_upper, 0, sizeof(double) * size_z(q->shape));
    for (int32_t i = 0; i < q->n_sides; i++) {
        const qp_side *side = &q->sides[i];
        if (i >= q->n_inequalities) {
            q->z_lower[side->at] = fmax(0, side->z);
            q->z_upper[side->at] = fmax(0, -side->z);
        } else {
            (side->sign > 0 ? q->z_lower : q->z_upper)[side->at] = side->z;
        }
    }
}

static int32_t solved(const qp *q, const qp_limits *limits) {
    return q->stationarity <= limits->stationarity && q->feasibility <= limits->feasibility &&
           q->complementarity <= limits->complementarity;
}

/* One iteration, with the mean of t z aimed at no lower than `least`; the length of its step. */
static double advance(qp *q, double barrier, double least) {
    step(q, 0, 0);
    double length = longest(q);
    if (q->n_inequalities > 0) { /* Mehrotra: what the pure Newton step would leave, cubed */
        const double left = barrier_after(q, length) / barrier;
        step(q, fmax(least, left * left * left * barrier), 1);
        length = longest(q);
        if (length < SHORT || barrier_after(q, length) > 0.9 * barrier) {
            step(q, fmax(least, 0.1 * barrier), 0); /* his corrector may cycle, this does not */
            length = longest(q);
        }
        if (length < SHORT) { /* too far from the central path: back to it first */
            step(q, barrier, 0);
            length = longest(q);
        }
    }
    length = length < 1 ? NEAREST * length : 1;
    move(q, length);
    return length;
}

/* A Newton step leaves (1 - length) of a linear residual. More is rounding, which matters where it
 * is about as large as what is asked for. */
static int32_t is_rounding(double before, double after, double length, double limit) {
    return after > 0.1 * limit && after > (1 - length) * before + 0.1 * before;
}

int32_t inside_solve(qp *q, const qp_limits *limits, int32_t warm) {
    int32_t result = QP_LIMIT;
    q->regularisation = limits->regularisation;
    q->softness = SOFTNESS;
    q->refine = 0;
    begin(q, warm);
    double barrier = measure(q);
    for (q->iterations = 0; q->iterations < limits->max_iterations; q->iterations++) {
        if (solved(q, limits)) {
            result = QP_SOLVED;
            break;
        }
        if (limits->is_late != NULL && limits->is_late(limits->data)) {
            result = QP_LATE;
            break;
        }
        q->softness = fmin(q->softness, softness(q, barrier));
        q->solutions += 1; /* residuals, slacks and steps of all bounds take about as long */
        if (!isfinite(q->stationarity + q->feasibility + barrier) || !factorise(q)) {
            result = QP_FAILED;
            break;
        }
        const double slope = q->stationarity, gap = q->feasibility,
                     length = advance(q, barrier, LEAST_BARRIER * limits->complementarity);
        barrier = measure(q);
        if (is_rounding(slope, q->stationarity, length, limits->stationarity) ||
            is_rounding(gap, q->feasibility, length, limits->feasibility)) {
            if (q->refine) { /* the more exact recursion, where this is not it */
                qp_use(q, QP_RICCATI);
            }
            q->refine = 1;
        }
    }
    if (!isfinite(q->stationarity + q->feasibility + barrier)) {
        result = QP_FAILED;
    } else if (result == QP_LIMIT && solved(q, limits)) {
        result = QP_SOLVED;
    } else if (result == QP_LIMIT && q->feasibility > limits->feasibility) {
        result = QP_INFEASIBLE;
    }
    write_multipliers(q);
    return result;
}
