/* SPDX-License-Identifier: Apache-2.0 */
/* curvature.c: factor on the Gauss-Newton Hessian, learnt from successive directions.
 *
 * Near a solution a step of length alpha with the Hessian f H reduces the error along an
 * eigenvector of the pair (true Hessian, H) by 1 - alpha eta / f, and f times the direction is
 * proportional to that error. Once one eigenvector is left, two successive directions are parallel,
 * their ratio tells eta, and f = eta removes it (Aitken's extrapolation). */
#include "ipopt_solver.h"

#include <math.h>

#define PARALLEL 0.95 /* least |cosine| of the angle between two directions of one eigenvector */
#define SLOW 0.3      /* least ratio that is worth a change */
#define LEAST 0.03    /* of the factor */
#define LARGEST 8.0
#define SHORTEST 0.2 /* step length that still tells something */

/* Directions to and fro across a kink, where no eigenvector explains them. */
#define ZIGZAG (-0.3) /* largest cosine */
#define CALM 1.5      /* what the factor is multiplied with */

void curvature_begin(ipopt_curvature *c, int32_t n) {
    c->n = n;
    c->factor = c->factor_before = 1;
    c->length = c->length_before = 0;
    c->direction = c->point == NULL ? NULL : c->point + n;
}

/* The next factor, from the scalar products of the last two directions. */
static double next_factor(const ipopt_curvature *c, double before, double now, double product) {
    if (c->length < SHORTEST || c->length_before < SHORTEST || before == 0) {
        return fmax(c->factor, 1);
    }
    const double ratio = product / before, cosine = product / sqrt(before * now);
    if (fabs(cosine) > PARALLEL && fabs(ratio) > SLOW && ratio < 1) {
        return fmin(fmax(c->factor_before * (1 - ratio) / c->length_before, LEAST), LARGEST);
    }
    if (cosine < ZIGZAG && now > 0.5 * before) {
        return fmin(CALM * fmax(c->factor, 1), LARGEST);
    }
    return fmax(c->factor, 1); /* one extrapolation raises what is left in other directions */
}

void curvature_adapt(ipopt_curvature *c, const double *v) {
    double before = 0, now = 0, product = 0;
    const double scale = c->length > 0 ? c->factor / c->length : 0;
    for (int32_t i = 0; i < c->n; i++) {
        const double direction = scale * (v[i] - c->point[i]);
        before += c->direction[i] * c->direction[i];
        now += direction * direction;
        product += c->direction[i] * direction;
        c->direction[i] = direction;
        c->point[i] = v[i];
    }
    const double factor = next_factor(c, before, now, product);
    c->factor_before = c->factor;
    c->length_before = c->length;
    c->factor = factor;
}
