/* SPDX-License-Identifier: Apache-2.0 */
/* output.h: the estimate handed out. */
#ifndef MHI_OUTPUT_H
#define MHI_OUTPUT_H

#include "base/arena.h"
#include "estimator/channel.h"

/* What one channel tracked [width]. */
typedef struct mhi_output_row {
    double *measured, *target, *weight, *estimated;
    int32_t *why;
} mhi_output_row;

typedef struct mhi_output {
    double *x, *u; /* [n_x], [n_u] of the system */
    double *held;  /* [n_u] at the time of the node */
    double *q, *v, *activation, *excitation, *force, *moment, *marker, *residual;
    double *reaction, *input; /* [6 n_joints], [n_w] */
    mhe_tracked *tracked;     /* [channels] */
    mhi_output_row *rows;     /* [channels] */
} mhi_output;

mhe_status mhi_output_create(mhi_output *output, const mhe_system *system, int32_t n_k,
                             int32_t n_joints, const mhi_channels *channels, mhi_arena *arena,
                             mhe_error *err);
/* Everything that is told about node k; the last one has the controls that lead to it. */
mhe_status mhi_output_give(mhe_estimator *e, int32_t k, mhe_estimate *out, mhe_error *err);

#endif
