/* SPDX-License-Identifier: Apache-2.0 */
/* active_tail.c: which bounds hold at the end of a long window, before all of it is solved.
 *
 * From one window to the next sets differ in the last few stages, where the newest measurement
 * pulls and the end of the window comes nearer to what was further inside. So these stages are a
 * program of their own first, from the state that the last window left them with: its systems are
 * as much cheaper as it is shorter, and the whole one then begins with a set in which little is
 * left to change. What it says is a guess: the set is judged by the whole program alone. */
#include "active.h"

#define LONG 20 /* windows of so many intervals have one, */
#define SHARE 4 /* one of so many stages */

static void forward(ptrdiff_t by, double **const *at, size_t n) {
    for (size_t i = 0; i < n; i++) {
        *at[i] += by;
    }
}

#define FORWARD(by, at) forward(by, at, sizeof(at) / sizeof(at)[0])

/* The same factors' memory from stage `from` on. */
static kalman factors_of(const kalman *f, const qp_shape *shape, ptrdiff_t from) {
    kalman tail = *f;
    double **const of_z[] = {&tail.h, &tail.used, &tail.inverse, &tail.v};
    double **const of_x[] = {&tail.p, &tail.K, &tail.closed, &tail.s, &tail.x};
    double **const of_d[] = {&tail.U_inverse, &tail.W_inverse, &tail.z};
    tail.shape = shape;
    tail.free = tail.known = 0;
    FORWARD(from * shape->ld_z, of_z);
    FORWARD(from * shape->ld_x, of_x);
    FORWARD(from * f->ld_d, of_d);
    tail.FT += from * shape->n_z * f->ld_d;
    tail.C += f->m > 0 ? from * shape->n_x * f->ld_d : 0;
    tail.U += from * f->n * f->ld_d;
    tail.W += from * f->n * f->ld_w;
    tail.D += from * f->n * shape->ld_x;
    return tail;
}

int32_t active_tail_begins(const qp *q) {
    const int32_t N = q->shape->N;
    return q->recursion == QP_KALMAN && q->first_is_fixed && N >= LONG ? N - N / SHARE : 0;
}

qp active_tail(const qp *q, qp_shape *shape, int32_t from) {
    qp tail = *q;
    const ptrdiff_t z = (ptrdiff_t)from * q->shape->ld_z, x = (ptrdiff_t)from * q->shape->ld_x;
    double **const of_z[] = {&tail.lower, &tail.upper,    &tail.w,  &tail.slope,
                             &tail.rhs,   &tail.diagonal, &tail.dw, &tail.side};
    double **const of_x[] = {&tail.lambda, &tail.gap, &tail.dlambda};
    *shape = *q->shape;
    shape->N -= from;
    tail.shape = shape;
    tail.stages += from;
    FORWARD(z, of_z);
    FORWARD(x, of_x);
    tail.fixed += z;
    tail.held += z;
    tail.kalman = factors_of(&q->kalman, shape, from);
    tail.update.at_once = tail.update.known = 0;
    tail.solutions = tail.sweeps = 0;
    return tail;
}
