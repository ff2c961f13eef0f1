/* SPDX-License-Identifier: Apache-2.0 */
/* start.h: a posture from markers alone (inverse kinematics), to start the first window from. */
#ifndef MHI_START_H
#define MHI_START_H

#include "model/system.h"
#include "ocp/tasks.h"

typedef struct mhi_start mhi_start;

mhe_status mhi_start_create(const mhi_system *system, mhi_system_context *context,
                            mhi_start **start, mhe_error *err);
/* What single markers and coordinates count; NULL, as at first: all markers the same. Lent. */
void mhi_start_set_tasks(mhi_start *start, const mhi_tasks *tasks);
/* The step, rad or m, below which a posture is taken as found; at first 1e-9. */
void mhi_start_set_enough(mhi_start *start, double step);
/* From how many postures spread over the ranges mhi_start_search begins; at first 12. */
void mhi_start_set_tries(mhi_start *start, int32_t tries);
/* The account of a search that nobody waits for long: half a second or so on any model, counted
 * and not timed, so that it ends alike everywhere. For mhi_work_begin. */
int64_t mhi_start_affordable(const mhi_start *start);
void mhi_start_free(mhi_start *start);

/* Least-squares posture q [n_q] within the coordinate ranges for markers [n_k x 3] (NaN: missing),
 * by Levenberg-Marquardt from the given q. `*rms` [m] is the remaining distance per marker, NaN
 * where no marker is there (q is then left as it was). */
mhe_status mhi_start_posture(mhi_start *start, const double *markers, double *q, double *rms,
                             mhe_error *err);

/* The same from several postures spread over the ranges; the best one wins. */
mhe_status mhi_start_search(mhi_start *start, const double *markers, double *q, double *rms,
                            mhe_error *err);

#endif
