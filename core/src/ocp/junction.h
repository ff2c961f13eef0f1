/* SPDX-License-Identifier: Apache-2.0 */
/* junction.h: several motions in one problem, one behind the other.
 *
 * Solvers see one chain of nodes. Between the last node of a motion and the first of the next lie
 * intervals in which nothing moves: their controls are the next motion's first state, as many of
 * them an interval as there are. The first such interval begins at the last node of the motion
 * before, and forgets its state. So the motions share nothing but the parameters, and no solver
 * needs to know. */
#ifndef MHI_OCP_JUNCTION_H
#define MHI_OCP_JUNCTION_H

#include "base/arena.h"
#include "model/system.h"

#include <mhe/solver.h>

typedef struct mhi_junction {
    int32_t n; /* intervals */
    int32_t n_x, n_u;
    int32_t n_all;        /* of the problem's state, n_x or more: what is carried is 0 behind it */
    int32_t *control;     /* [n x n_x] that a state is set to in an interval, -1: none */
    const int32_t *place; /* [N] of the problem: which interval of a junction, -1: of a motion */
} mhi_junction;

/* `place` [N], lent, may be NULL where n alone is wanted. [cold] */
mhe_status mhi_junction_create(const mhi_system *system, const int32_t *place, mhi_arena *arena,
                               mhi_junction *junction, mhe_error *err);
/* x_next, A, B and P (zero) of interval number `i`; derivatives where they are wanted. [hot] */
void mhi_junction_step(const mhi_junction *junction, int32_t i, const double *x, const double *u,
                       int32_t n_p, const mhe_stage_values *out);
/* What holds controls that set nothing at 0: cost, gradient and Hessian are set. [hot] */
void mhi_junction_cost(const mhi_junction *junction, int32_t i, const double *u,
                       const mhe_stage_values *out);

#endif
