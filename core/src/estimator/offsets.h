/* SPDX-License-Identifier: Apache-2.0 */
/* offsets.h: how far each marker is from its place in its segment, learnt as the recording runs.
 *
 * A marker is fixed to its segment and the segment to its joints. Markers that are not where the
 * model has them do not fit together, and do so in ever other ways as the limbs turn: no posture
 * makes up for it. What the posture of each moment can follow is projected out of what is left of
 * its markers; the rest is that of offsets that are the same at all moments, the least ones that
 * explain it. Muscles have no part in it. */
#ifndef MHI_OFFSETS_H
#define MHI_OFFSETS_H

#include "estimator/offset_look.h"
#include "model/system.h"
#include "ocp/tasks.h"

#define MHI_OFFSET_LOOKS 32

/* What a node has of its posture. */
typedef struct mhi_offset_node {
    double *rotation; /* [n_k x 9] to ground; the first NaN: not known */
    mhi_offset_follow follow;
    int32_t *held; /* [n_q] 1: this coordinate does not follow */
} mhi_offset_node;

typedef struct mhi_offsets {
    double sd;                                    /* m, what is expected of an offset; 0: off */
    double *value;                                /* [n] in the axes of the markers' bodies, m */
    mhi_offset_node *node;                        /* [nodes] */
    mhi_offset_look now, looks[MHI_OFFSET_LOOKS]; /* the older, the fewer */
    int32_t n_looks, next, last; /* the one that is looked at again next; the newest */
    int64_t number;              /* of the newest */
    mhi_offset_sum sum;          /* of all looks */
    double *work, *change;       /* [n x n], [n + n_q] scratch, as what follows */
    double *marker, *slope, *jacobian, *body, *rotation, *step;
    const mhe_description *description;
    mhi_system_context *context;
    const mhi_tasks *tasks;
    int32_t n_q, n_k, n, nodes;
} mhi_offsets;

/* Off where `sd` is 0 or there are no markers. [cold] */
mhe_status mhi_offsets_create(mhi_offsets *offsets, double sd, const mhi_system *system,
                              mhi_system_context *context, const mhi_tasks *tasks, int32_t nodes,
                              mhi_arena *arena, mhe_error *err);
void mhi_offsets_forget(mhi_offsets *offsets, int32_t k);
void mhi_offsets_shift(mhi_offsets *offsets);
/* Node k has the posture q: the axes of its bodies. */
void mhi_offsets_turn(mhi_offsets *offsets, int32_t k, const double *q);
/* The markers [n] of node k without their offsets -> out, may be the same; as they are where the
 * node's posture is not known. */
void mhi_offsets_correct(const mhi_offsets *offsets, int32_t k, const double *markers, double *out);
/* Learns from node k: markers as measured, and in `q` [nodes x n_q] the posture nearest to them
 * without their offsets. The postures of all nodes go along with what was learnt. */
void mhi_offsets_learn(mhi_offsets *offsets, int32_t k, const double *markers, double *q);
/* A coordinate of node k is measured otherwise: what is learnt does not move it. */
void mhi_offsets_hold(mhi_offsets *offsets, int32_t k, int32_t coordinate);
/* What is not known of the offsets, in the posture q, whose markers [n] some may be missing of:
 * J^T P J -> out [n_q x n_q], J the markers' slopes and P the covariance that what is expected and
 * all looks leave. 0: there is none. [hot] */
int32_t mhi_offsets_unknown(mhi_offsets *offsets, const double *q, const double *markers,
                            double *out);

#endif
