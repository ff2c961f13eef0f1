/* SPDX-License-Identifier: Apache-2.0 */
/* rates.h: joint velocities as the markers say, or the angles where these are measured: the posture
 * of each node by inverse kinematics, and its slopes to the nodes beside it.
 *
 * Markers are compared at nodes only. What happens between two nodes, while controls are held, they
 * do not see: a light segment under strong muscles can swing there and be back in time, and where
 * that saves activation it does. Velocities at the nodes forbid it. */
#ifndef MHI_RATES_H
#define MHI_RATES_H

#include "estimator/channel.h"
#include "estimator/offsets.h"
#include "estimator/start.h"

typedef struct mhi_rates {
    mhi_start *start;  /* NULL: off */
    double *q;         /* [nodes x n_q] postures; NaN where they are not known */
    double *found;     /* [n_q] */
    double *v;         /* [n_q] */
    double *corrected; /* [n_k x 3] markers without their offsets */
    mhi_offsets offsets;
    double nearest; /* m, the least distance that was left so far */
    double squares; /* m^2, of what was left of a coordinate, over ... */
    int32_t n_seen; /* ... so many postures */
    int32_t n_q, nodes;
} mhi_rates;

/* Off where data.rates is and data.marker_offset is 0. [cold] */
mhe_status mhi_rates_create(mhi_rates *rates, const mhi_run *run, const mhi_system *system,
                            mhi_system_context *context, const mhi_tasks *tasks, int32_t nodes,
                            mhi_arena *arena, mhe_error *err);
void mhi_rates_free(mhi_rates *rates);
void mhi_rates_clear(mhi_rates *rates);
void mhi_rates_shift(mhi_rates *rates);
/* How far markers were from the postures nearest to them so far, RMS of a coordinate (m): what is
 * left of their errors in their segments, whatever muscles do. NAN: not known. */
double mhi_rates_misfit(const mhi_rates *rates);
/* Node k [times: of all nodes] has come with `markers` and `angles` (NULL: none): its posture, the
 * angles where there are any, else near to that of the node before or `near`; and by it the
 * velocities of node k and of the one before, into `channel` (NULL: none wanted). */
void mhi_rates_take(mhi_rates *rates, int32_t k, const double *times, const double *markers,
                    const double *angles, const double *near, double outlier, mhi_channel *channel);

#endif
