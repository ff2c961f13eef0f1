/* SPDX-License-Identifier: Apache-2.0 */
/* curvature.c: factor on the Gauss-Newton Hessian, learnt from successive steps.
 *
 * Near a solution full steps with the Hessian f H reduce the error along an eigenvector of the pair
 * (true Hessian, H) by 1 - eta / f. Once one of them is left, two successive steps are parallel,
 * their ratio is 1 - eta / f, and eta is the factor that removes it (Aitken's extrapolation). */
#include "ipopt_solver.h"

#include <math.h>

#define PARALLEL 0.95 /* least |cosine| of the angle between two steps of one eigenvector */
#define SLOW 0.3      /* least ratio that is worth a change */
#define LEAST 0.03    /* of the factor */
#define LARGEST 8.0

void curvature_begin(ipopt_curvature *c, int32_t n) {
    c->n = n;
    c->factor = 1;
    c->full_step = 0;
    c->n_steps = -1;
    c->step = c->point + n;
}

void curvature_adapt(ipopt_curvature *c, const double *v) {
    double before = 0, now = 0, product = 0;
    for (int32_t i = 0; i < c->n; i++) {
        const double step = v[i] - c->point[i];
        before += c->step[i] * c->step[i];
        now += step * step;
        product += c->step[i] * step;
        c->step[i] = step;
        c->point[i] = v[i];
    }
    c->n_steps = c->full_step ? c->n_steps + 1 : 0;
    if (c->factor < 1) { /* one extrapolation; what it raised along other directions comes first */
        c->factor = 1;
        c->n_steps = 0;
    } else if (c->n_steps >= 2 && before > 0) {
        const double ratio = product / before;
        if (fabs(product) > PARALLEL * sqrt(before * now) && fabs(ratio) > SLOW && ratio < 1) {
            c->factor = fmin(fmax(c->factor * (1 - ratio), LEAST), LARGEST);
            c->n_steps = 0;
        }
    }
}
