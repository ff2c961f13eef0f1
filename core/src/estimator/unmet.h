/* SPDX-License-Identifier: Apache-2.0 */
/* unmet.h: what windows that cannot be solved fail to meet. */
#ifndef MHI_UNMET_H
#define MHI_UNMET_H

#include "base/arena.h"

#include <mhe/estimator.h>

#define MHI_UNMET_TEXT 320

typedef struct mhi_unmet {
    double *next;                                      /* [n_x of the solver] scratch */
    int32_t length, most;                              /* failed solves in a row, now and at most */
    char now[MHI_UNMET_TEXT], of_most[MHI_UNMET_TEXT]; /* what the first of them did not meet */
} mhi_unmet;

mhe_status mhi_unmet_create(mhi_unmet *u, int32_t n_x, mhi_arena *arena, mhe_error *err);
/* After each solve, before its iterate is given up; `failed`: it will be. */
void mhi_unmet_solved(mhe_estimator *e, int32_t failed);
/* Of the longest row of failed solves, "" where there is none; the estimator's. [any] */
const char *mhi_estimator_unmet(const mhe_estimator *e);

#endif
