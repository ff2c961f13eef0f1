/* SPDX-License-Identifier: Apache-2.0 */
/* pose_private.h: what pose.c and pose_adjust.c share. */
#ifndef MHI_POSE_PRIVATE_H
#define MHI_POSE_PRIVATE_H

#include "base/arena.h"
#include "believe/pose.h"
#include "estimator/start.h"

#define MHI_POSE_FREEDOMS 7 /* turn, shift, scale */

struct mhi_pose_search {
    const mhe_description *description;
    mhi_system_context *context;
    mhi_start *start;
    mhi_work work;
    int32_t n_frames, n_q, n_k;
    int32_t every;                /* frame is looked at */
    double *raw, *turned, *model; /* [frames x 3 n_k] */
    double *q, *trial, *rest;     /* [frames x n_q] twice, [n_q] */
    double *marker_q;             /* [3 n_k x n_q] */
    double *factor, *solved;      /* [frames x n_q x n_q], [frames x n_q x (freedoms + 1)] */
    double *coupling;             /* [n_q x (freedoms + 1)] */
    mhi_arena arena;
};

/* out = scale turn in + shift */
void mhi_pose_place(const mhi_pose *pose, const double in[3], double out[3]);
/* The best transform of the raw markers to where s->model has them, of what `freedom` names. */
void mhi_pose_superpose(const mhi_pose_search *s, int32_t freedom, mhi_pose *pose);

#endif
