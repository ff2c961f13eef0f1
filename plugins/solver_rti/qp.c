/* SPDX-License-Identifier: Apache-2.0 */
/* qp.c: a program's memory, and who solves it. */
#include "qp.h"

#include <string.h>

/* What factors take, in solutions with them (measured: 24 and 40 us beside 6 on the arm). */
#define KALMAN_FACTOR 4
#define RICCATI_FACTOR 6
#define BEGIN 2         /* a program's own numbers */
#define SWEEPS 24       /* along chains, in the time of a solution */
#define MOST_SKIPPED 15 /* programs that are not tried by sets after one whose sets cycled */

#define BORDER_BYTES ((sizeof(qp_border) + 63) / 64 * 64)

/* Of the recursions, which share their memory. */
static size_t recursion_size(const qp_shape *s) {
    const size_t one = riccati_size(s), other = kalman_size(s);
    return one > other ? one : other;
}

size_t qp_size(const qp_shape *s) {
    const size_t z = size_z(s), x = size_x(s);
    const size_t doubles =
        (4 + 8) * z + (1 + 5) * x + recursion_size(s) + border_size(s) + update_size(s);
    const size_t bytes = (s->n_p > 0 ? BORDER_BYTES : 0) + sizeof(double) * doubles +
                         sizeof(qp_side) * 2 * z + 2 * z + x;
    return (bytes + 63) / 64 * 64;
}

static double *take(double **memory, size_t n) {
    double *piece = *memory;
    *memory += n;
    return piece;
}

void qp_place(qp *q, const qp_shape *s, void *memory) {
    const size_t z = size_z(s), x = size_x(s);
    double *m = memory;
    memset(memory, 0, qp_size(s));
    *q = (qp){.shape = s};
    double **const of_z[] = {&q->lower, &q->upper,    &q->w,  &q->z_lower, &q->z_upper, &q->slope,
                             &q->rhs,   &q->diagonal, &q->dw, &q->fix_w,   &q->rest_w,  &q->side};
    double **const of_x[] = {&q->lambda, &q->gap, &q->dlambda, &q->fix_lambda, &q->rest_x};
    for (size_t i = 0; i < sizeof of_z / sizeof of_z[0]; i++) {
        *of_z[i] = take(&m, z);
    }
    for (size_t i = 0; i < sizeof of_x / sizeof of_x[0]; i++) {
        *of_x[i] = take(&m, x);
    }
    double *recursion = take(&m, recursion_size(s)), *columns = take(&m, border_size(s));
    update_place(&q->update, s, take(&m, update_size(s)));
    if (s->n_p > 0) {
        q->border = (qp_border *)take(&m, BORDER_BYTES / sizeof *m);
        border_place(q->border, s, columns);
    }
    q->because = take(&m, (size_t)s->ld_x);
    q->sides = (qp_side *)m;
    q->fixed = (uint8_t *)(q->sides + 2 * z);
    q->held = q->fixed + z;
    q->turned = q->held + z;
    q->recursion_memory = recursion;
    qp_use(q, QP_RICCATI);
}

void qp_use(qp *q, int32_t recursion) {
    if (q->recursion == recursion) {
        return;
    }
    q->recursion = recursion;
    if (recursion == QP_KALMAN) {
        kalman_place(&q->kalman, q->shape, q->recursion_memory);
    } else {
        riccati_place(&q->riccati, q->shape, q->fixed, q->recursion_memory);
        riccati_read_fixed(&q->riccati);
    }
}

int32_t qp_best(const qp *q) {
    return kalman_takes(q->shape) ? QP_KALMAN : QP_RICCATI;
}

int32_t qp_take_work(qp *q) {
    const int32_t taken = q->solutions + q->sweeps / SWEEPS;
    q->solutions = 0;
    q->sweeps %= SWEEPS;
    return taken;
}

int32_t qp_factor(qp *q, const uint8_t *held) {
    q->solutions += q->recursion == QP_KALMAN ? KALMAN_FACTOR : RICCATI_FACTOR + q->shape->n_p;
    if (q->recursion == QP_KALMAN) {
        return kalman_factor(&q->kalman, q->stages, q->diagonal, held);
    }
    q->riccati.fixed = held;
    return riccati_factor(&q->riccati, q->stages, q->diagonal) &&
           (q->shape->n_p == 0 || border_factor(q, held));
}

void qp_newton(qp *q, const double *g, const double *b, double *w, double *lambda) {
    q->solutions += 1;
    if (q->recursion == QP_KALMAN) {
        kalman_solve(&q->kalman, q->stages, g, b, w, lambda);
    } else {
        border_newton(q, g, b, w, lambda);
    }
}

/* Is there a variable at place i of stage k? */
static int32_t first_place(const qp_shape *s, int32_t k) {
    return k < s->N ? 0 : s->n_u;
}

/* Place of the parameters. */
static ptrdiff_t first_p(const qp_shape *s) {
    return (ptrdiff_t)(s->N + 1) * s->ld_z;
}

void qp_read_bounds(qp *q) {
    const qp_shape *s = q->shape;
    for (int32_t k = 0; k <= s->N; k++) {
        for (int32_t i = first_place(s, k); i < s->n_z; i++) {
            const ptrdiff_t at = (ptrdiff_t)k * s->ld_z + i;
            q->fixed[at] = (k == 0 || i < s->n_u) && q->lower[at] == q->upper[at];
        }
    }
    for (int32_t i = 0; i < s->n_p; i++) {
        q->fixed[first_p(s) + i] = row_p(s, q->lower)[i] == row_p(s, q->upper)[i];
    }
    q->first_is_fixed = 1;
    for (int32_t i = s->n_u; i < s->n_z; i++) {
        q->first_is_fixed &= q->fixed[i];
    }
    q->riccati.first_is_fixed = q->first_is_fixed;
}

int32_t qp_solve(qp *q, const qp_stage *stages, const qp_limits *limits, int32_t warm) {
    const qp_shape *s = q->shape;
    q->stages = stages;
    qp_use(q, qp_best(q));
    if (q->recursion == QP_KALMAN) {
        kalman_begin(&q->kalman, stages, !q->first_is_fixed);
    }
    if (s->n_p > 0) {
        border_begin(q);
    }
    q->programs++;
    q->solutions += BEGIN;
    const int32_t by_sets =
        q->first_is_fixed ? warm : q->recursion == QP_KALMAN; /* from none, at first */
    if (s->n_p == 0 && (!by_sets || q->skipped < q->to_skip)) {
        q->skipped++;
        return inside_solve(q, limits, warm);
    }
    const int32_t result = active_solve(q, limits);
    if (result != QP_LIMIT) {
        q->to_skip = 0;
        return result;
    }
    q->fallbacks++;
    q->skipped = 0;
    q->to_skip = q->to_skip < MOST_SKIPPED ? 2 * q->to_skip + 1 : q->to_skip;
    return inside_solve(q, limits, warm);
}
