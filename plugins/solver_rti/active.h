/* SPDX-License-Identifier: Apache-2.0 */
/* active.h: what active.c, active_chain.c and active_update.c share. */
#ifndef ACTIVE_H
#define ACTIVE_H

#include "qp.h"

#define ACTIVE_HOLD 1e9 /* weight that holds a state at its bound */

/* Equal bounds of a later state. */
static inline int32_t active_is_equality(const qp *q, ptrdiff_t at) {
    return !q->fixed[at] && q->lower[at] == q->upper[at];
}

/* Where a variable is that is held, or fixed. */
static inline double active_bound(const qp *q, ptrdiff_t at) {
    return q->side[at] > 0 ? q->upper[at] : q->lower[at];
}

/* Which bound holds a variable that came to `w`, its multiplier z_lower - z_upper to `y`; 1: it has
 * changed. */
static inline int32_t active_turn(qp *q, ptrdiff_t at, double w, double y, double crossed,
                                  double pulled) {
    const double old = q->side[at];
    if (active_is_equality(q, at)) {
        return 0;
    }
    if (old == 0) {
        q->side[at] = w < q->lower[at] - crossed ? -1 : w > q->upper[at] + crossed ? 1 : 0;
    } else if (old * y > pulled) {
        q->side[at] = 0;
    }
    return q->side[at] != old;
}

/* Follows the bounds of simple state j and its control to a set that suits the present pulls; from
 * q->w, lambda, and slope at them. */
void active_follow(qp *q, int32_t j, double crossed, double pulled);

/* active_tail.c: the last stages as a program of their own, in the same memory; `shape` is its own.
 * 0: the window is too short for it, or has no factors to share. */
int32_t active_tail_begins(const qp *q);
qp active_tail(const qp *q, qp_shape *shape, int32_t from);

/* active_update.c: solves the present set's system by the factors of one before, as solve_set()
 * does; 0: they are of no use. */
int32_t active_update(qp *q);
/* The factors are of the set in update.side, whose solution this is: w, lambda, and slope there. */
void active_remember(qp *q);

#endif
