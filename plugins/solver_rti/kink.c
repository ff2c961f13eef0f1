/* SPDX-License-Identifier: Apache-2.0 */
/* kink.c: a solution at a kink.
 *
 * Some curves of muscles are bent sharply: the force of a fibre that lengthens rises twice as fast
 * as that of one that shortens, and where a joint comes to rest the best motion may lie on the
 * edge. There the slope of the Lagrangian never vanishes: on both sides it points to the other.
 * What vanishes is a mean of both sides (Clarke 1975, doi:10.1090/S0002-9947-1975-0367131-6), and
 * to be within an edge of such a point is all that an iterate can come to (Goldstein 1977,
 * doi:10.1007/BF01584320). So the kink is found by halving between two iterates whose steps point
 * at each other, and the next program is that of the mean of the linearisations on both sides: its
 * step goes along the kink, and where it is none, there is the solution. */
#include "rti.h"

#include <math.h>
#include <string.h>

#define EDGE 1e-3 /* times the tolerance */
#define LEAST_EDGE 1e-13
#define MOST_HALVES 40   /* of the way between them */
#define MOST_PROGRAMS 12 /* for the right mean */
#define ON_KINK 1e-6     /* of the most that their steps leave it */

/* Slope of the Lagrangian with the program's multipliers at a point -> s->slope, all of it. */
static void slope_at(rti_solver *s, const rti_point *point) {
    const qp *q = &s->qp;
    qp_slope(&s->shape, point->stages, NULL, q->lambda, s->slope);
    for (size_t i = 0; i < size_z(&s->shape); i++) {
        s->slope[i] += q->z_upper[i] - q->z_lower[i];
    }
}

static double dot(size_t n, const double *a, const double *b) {
    double sum = 0;
    for (size_t i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

double rti_edge(const rti_solver *s) {
    return fmax(EDGE * s->config->tolerance, LEAST_EDGE);
}

static double distance(const rti_solver *s) {
    double most = 0;
    for (size_t i = 0; i < size_z(&s->shape); i++) {
        most = fmax(most, fabs(s->trial.w[i] - s->here.w[i]));
    }
    return most;
}

/* Halves the way from `here` to the trial point until they lie within the edge, one on each side;
 * the way at first -> `way`. */
static int32_t close_in(rti_solver *s, double *way) {
    const size_t n = size_z(&s->shape);
    const double edge = rti_edge(s);
    double *end = s->before;
    for (size_t i = 0; i < n; i++) {
        s->trial.w[i] = end[i];
        way[i] = end[i] - s->here.w[i];
    }
    for (int32_t i = 0; i < MOST_HALVES && distance(s) > edge; i++) {
        for (size_t j = 0; j < n; j++) {
            s->trial.w[j] = 0.5 * (s->here.w[j] + end[j]);
        }
        if (rti_is_over(s) || !rti_evaluate(s, &s->trial, RTI_ALL)) {
            return 0;
        }
        slope_at(s, &s->trial);
        memcpy(dot(n, s->slope, way) < 0 ? s->here.w : end, s->trial.w, sizeof(double) * n);
        memcpy(s->trial.w, end, sizeof(double) * n);
    }
    return distance(s) <= edge && !rti_is_over(s) && rti_evaluate(s, &s->here, RTI_ALL) &&
           rti_evaluate(s, &s->trial, RTI_ALL);
}

/* The linearisation at `here`, of which `before` is the trial point's, gets `share` of it. */
static void blend(rti_solver *s, double before, double share) {
    const double keep = (1 - share) / (1 - before), add = share - before * keep;
    double *here = s->here.stages[0].H;
    const double *there = s->trial.stages[0].H;
    for (size_t i = 0; i < qp_stages_size(&s->shape); i++) {
        here[i] = keep * here[i] + add * there[i];
    }
}

/* How the slope changes from `here` to the trial point: it stands upright on the kink. */
static void find_change(rti_solver *s, double *change) {
    const size_t n = size_z(&s->shape);
    slope_at(s, &s->here);
    memcpy(change, s->slope, sizeof(double) * n);
    slope_at(s, &s->trial);
    for (size_t i = 0; i < n; i++) {
        change[i] = s->slope[i] - change[i];
    }
}

/* The program of the mean whose step stays on the kink; 0: none was found. Its share of the other
 * side is bracketed by false position (Illinois: Dowell and Jarratt 1971,
 * doi:10.1007/BF01934364). */
static int32_t solve_mean(rti_solver *s, double share, const double *upright) {
    double low = 0, high = 1, of_low = 0, of_high = 0; /* 0: not known yet */
    double before = 0, last = 0, most = 0;
    for (int32_t i = 0; i < MOST_PROGRAMS; i++) {
        blend(s, before, share);
        before = share;
        if (rti_program(s, 0) != QP_SOLVED) {
            return 0;
        }
        const rti_residuals r =
            rti_residuals_of(s, &s->here, s->qp.lambda, s->qp.z_lower, s->qp.z_upper);
        const double leaves = dot(size_z(&s->shape), upright, s->qp.w);
        most = fmax(most, fabs(leaves));
        if (r.stationarity <= s->config->tolerance || fabs(leaves) <= ON_KINK * most ||
            (i == 1 && fabs(leaves - last) < 0.01 * most)) { /* as there is none */
            return 1;
        }
        if (leaves > 0) {
            of_high *= last > 0 ? 0.5 : 1;
            low = share;
            of_low = leaves;
        } else {
            of_low *= last < 0 ? 0.5 : 1;
            high = share;
            of_high = leaves;
        }
        last = leaves;
        share = of_low > 0 && of_high < 0 ? low + (high - low) * of_low / (of_low - of_high)
                                          : 0.5 * (low + high);
    }
    return 1;
}

int32_t rti_step_along_kink(rti_solver *s, double share) {
    double *const way = s->last.w; /* free: what was remembered is forgotten */
    s->last_is_known = 0;
    if (!close_in(s, way)) {
        return 0;
    }
    const double damping = s->config->regularisation + s->held + s->damping;
    find_change(s, way);
    rti_set_damping(s, &s->here, damping);
    rti_set_damping(s, &s->trial, damping);
    return solve_mean(s, share, way);
}

int32_t rti_finds_kink(rti_solver *s, double *share) {
    const size_t n = size_z(&s->shape);
    rti_reach(s, 1);
    if (!rti_evaluate(s, &s->trial, RTI_ALL)) {
        return 0;
    }
    slope_at(s, &s->here);
    const double here = dot(n, s->slope, s->qp.w);
    slope_at(s, &s->trial);
    const double there = dot(n, s->slope, s->qp.w);
    memcpy(s->before, s->trial.w, sizeof(double) * n);
    memcpy(s->last_from, s->here.w, sizeof(double) * n);
    *share = here < 0 && there > 0 ? here / (here - there) : 0;
    return *share > 0;
}
