/* SPDX-License-Identifier: Apache-2.0 */
/* trajectory.h: states and controls of a motion on even intervals. */
#ifndef MHI_TRAJECTORY_H
#define MHI_TRAJECTORY_H

#include "base/arena.h"
#include "model/system.h"

typedef struct mhi_trajectory {
    int32_t n; /* intervals */
    int32_t n_x, n_u;
    double interval; /* s */
    double *x;       /* [(n+1) x n_x] */
    double *u;       /* [n x n_u], constant over each interval */
    double *A, *B;   /* [n x n_x x n_x], [n x n_x x n_u] derivatives of the next state, row-major;
                        NULL: not known */
} mhi_trajectory;

/* Zeroed arrays from the arena. */
mhe_status mhi_trajectory_take(mhi_arena *arena, const mhe_system *system, int32_t n,
                               double interval, mhi_trajectory *out, mhe_error *err);

/* State [n_x], linear between nodes, and control [n_u] at a time of several motions, one behind the
 * other; before the first and behind the last they stand still. Either may be NULL. */
void mhi_trajectory_at(const mhi_trajectory *const *motions, int32_t n_motions, double time,
                       double *x, double *u);
double mhi_trajectory_duration(const mhi_trajectory *const *motions, int32_t n_motions); /* s */

/* A block of states or controls, by its name: "q", "qdot", "activation", "excitation",
 * "residual_torque", what muscles have more. */
typedef struct mhi_part {
    int32_t in_u;             /* part of the control, else of the state */
    int32_t offset, n;        /* where it stands there */
    const char *const *names; /* [n] of its entries */
    const char *const *units; /* [n] */
} mhi_part;

/* 0 where the system has no such part. */
int32_t mhi_part_find(const mhe_system *system, const char *name, mhi_part *part);

#endif
