/* SPDX-License-Identifier: Apache-2.0 */
/* offset_look.h: what the markers of one posture say of their offsets.
 *
 * left = J dq + offsets, in the axes of the markers' bodies, weighted by W. With the nearest
 * posture projected out the offsets' normal matrix is
 *
 *     W - W J (J^T W J)^-1 J^T W = W - Z^T Z,    L L^T = J^T W J,    L Z = J^T W,
 *
 * and that posture goes with the offsets by -L^-T Z. Coordinates stand in L and Z from the last to
 * the first: where bodies follow their parents, as in most models, a marker has then no entries in
 * Z but those of the coordinates that move it. */
#ifndef MHI_OFFSET_LOOK_H
#define MHI_OFFSET_LOOK_H

#include "base/arena.h"

/* How the nearest posture goes with the offsets. */
typedef struct mhi_offset_follow {
    double *factor;       /* [n_q x n_q] L */
    double *z;            /* [n_q x n] */
    int32_t *first, *end; /* [n_q] where the entries of a row of z that are not 0 begin and end */
    int32_t known;        /* 0: it stays where it is */
} mhi_offset_follow;

/* n = 3 n_k */
typedef struct mhi_offset_look {
    double *q;        /* [n_q] */
    double *measured; /* [n] markers, in ground; NaN: missing */
    double *left;     /* [n] measured less the model's, 0 where it does not count */
    double *weight;   /* [n] 0: missing or left out */
    mhi_offset_follow follow;
    int64_t number; /* of those that were kept, from 1 */
} mhi_offset_look;

/* What looks say together. */
typedef struct mhi_offset_sum {
    double *normal, *right; /* [n x n] the lower triangle, [n] */
    double squares, rows;   /* of what they left, over so many */
} mhi_offset_sum;

mhe_status mhi_offset_follow_create(mhi_offset_follow *follow, int32_t n, int32_t n_q,
                                    mhi_arena *arena, mhe_error *err);
mhe_status mhi_offset_look_create(mhi_offset_look *look, int32_t n, int32_t n_q, mhi_arena *arena,
                                  mhe_error *err);
/* `to` takes what `from` has. [hot] */
void mhi_offset_follow_copy(mhi_offset_follow *to, const mhi_offset_follow *from, int32_t n,
                            int32_t n_q);
/* Out of J [n x n_q] and the weights. What no marker shows stays as it is. 0: there is none. [hot]
 */
int32_t mhi_offset_follow_find(mhi_offset_follow *follow, const double *jacobian,
                               const double *weight, int32_t n, int32_t n_q);
/* How the posture moves where the offsets do by `change` [n] -> move [n_q]. [hot] */
void mhi_offset_follow_move(const mhi_offset_follow *follow, const double *change, int32_t n,
                            int32_t n_q, double *move);
/* A look into the sum (`sign` 1), or out of it (-1); `room` [n + n_q]. [hot] */
void mhi_offset_look_count(const mhi_offset_look *look, double sign, int32_t n, int32_t n_q,
                           double *room, mhi_offset_sum *sum);
/* sum of squares left by the offsets `value` [n] over all looks. [hot] */
double mhi_offset_sum_squares(const mhi_offset_sum *sum, const double *value, int32_t n);

#endif
