/* SPDX-License-Identifier: Apache-2.0 */
/* between.c: a step between the results of the last two programs.
 *
 * Gauss-Newton leaves out how the dynamics and what is measured bend. Where that bends the cost
 * upward, its programs go too far, each back over the last, and a step that may only be whole or
 * halved goes to and fro about the solution, ever more slowly (factors of -0.9 to -8 an iteration,
 * in one direction). The mean of both results in which their steps cancel best is then near it
 * (mixing of Anderson 1965, doi:10.1145/321296.321305, with one result that is remembered), and as
 * both meet the bounds, it does, too. Its multipliers are the means of theirs.
 *
 * Where the steps turn about over next to no way, what lies between is a kink: kink.c. */
#include "rti.h"

#include <string.h>

#define LEAST_SHARE \
    0.3 /* of the last result: a factor of -0.43 is left alone, it soon gets there */
#define LEAST_OF_KINK 0.02
#define TURN 20 /* how much further than an iterate the steps turn at a kink; else 9 at most */

static void copy_program(const rti_solver *s, const double *w, const double *lambda,
                         const double *z_lower, const double *z_upper, rti_program_result *to) {
    const size_t z = sizeof(double) * size_z(&s->shape), x = sizeof(double) * size_x(&s->shape);
    memcpy(to->w, w, z);
    memcpy(to->z_lower, z_lower, z);
    memcpy(to->z_upper, z_upper, z);
    memcpy(to->lambda, lambda, x);
}

/* Products by the curvature of the cost of this step and of what has changed since the last. */
typedef struct products {
    double both; /* of the step and its change */
    double all;  /* of the change with itself */
    double way;  /* of the iterate's change with itself */
} products;

static products compare(rti_solver *s) {
    const qp_shape *shape = &s->shape;
    products p = {0};
    for (int32_t k = 0; k <= shape->N; k++) {
        const double *step = row_z(shape, s->qp.w, k), *last = row_z(shape, s->last.w, k);
        const double *now = row_z(shape, s->here.w, k), *from = row_z(shape, s->last_from, k);
        double *change = row_z(shape, s->slope, k), *bent = row_z(shape, s->qp.slope, k);
        for (int32_t i = 0; i < shape->ld_z; i++) {
            change[i] = now[i] - from[i];
            bent[i] = 0;
        }
        qp_add_curvature(shape, &s->here.stages[k], 1, change, bent);
        for (int32_t i = 0; i < shape->n_z; i++) {
            p.way += change[i] * bent[i];
        }
        for (int32_t i = 0; i < shape->ld_z; i++) {
            change[i] = step[i] - last[i];
            bent[i] = 0;
        }
        qp_add_curvature(shape, &s->here.stages[k], 1, change, bent);
        for (int32_t i = 0; i < shape->n_z; i++) {
            p.both += step[i] * bent[i];
            p.all += change[i] * bent[i];
        }
    }
    return p;
}

static void mix(size_t n, double share, const double *last, double *now) {
    for (size_t i = 0; i < n; i++) {
        now[i] += share * (last[i] - now[i]);
    }
}

int32_t rti_between(rti_solver *s, double *share) {
    const qp_shape *shape = &s->shape;
    const size_t z = size_z(shape);
    qp *q = &s->qp;
    const products p =
        s->last_is_known && s->last_damping == s->here.damping ? compare(s) : (products){0};
    *share = p.all > 0 ? p.both / p.all : 0;
    const int32_t turned = p.all > TURN * TURN * p.way && *share >= LEAST_OF_KINK &&
                           *share <= 1 - LEAST_OF_KINK,
                  mixed = *share >= LEAST_SHARE && *share < 1;
    copy_program(s, q->w, q->lambda, q->z_lower, q->z_upper, &s->first);
    if (turned || mixed) {
        for (size_t i = 0; i < z; i++) { /* the last result, as a step from here */
            s->last.w[i] += s->last_from[i] - s->here.w[i];
        }
        mix(z, *share, s->last.w, q->w);
        mix(z, *share, s->last.z_lower, q->z_lower);
        mix(z, *share, s->last.z_upper, q->z_upper);
        mix(size_x(shape), *share, s->last.lambda, q->lambda);
    }
    copy_program(s, s->first.w, s->first.lambda, s->first.z_lower, s->first.z_upper, &s->last);
    memcpy(s->before, s->last_from, sizeof(double) * z);
    memcpy(s->last_from, s->here.w, sizeof(double) * z);
    s->last_damping = s->here.damping;
    s->last_is_known = 1;
    return turned ? RTI_KINK : mixed;
}
