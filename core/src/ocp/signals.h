/* SPDX-License-Identifier: Apache-2.0 */
/* signals.h: the named quantities that costs read, at one node, with their derivatives.
 *
 * z = [x; u] is a node's point. Each signal depends on one contiguous range of z: either y_i =
 * z[column + i] or a dense block of `n_columns` columns. All signals of a problem lie one after the
 * other in a vector of n_y values; targets have the same layout.
 *
 * A cost may read a signal of the node before. Its value is carried along then as state of the
 * problem, m_{k+1} = y(x_k, u_k): row MHI_N_SIGNALS + i of the table is signal i of the node
 * before, with one column of z an entry, and z = [x; u; m]. Solvers see [x; m] as the state. */
#ifndef MHI_SIGNALS_H
#define MHI_SIGNALS_H

#include "model/system.h"

#define MHI_MAX_REACTIONS 4
#define MHI_REACTION "joint_reaction/" /* then the joint's name */

enum {
    MHI_SIGNAL_MARKERS,
    MHI_SIGNAL_Q,
    MHI_SIGNAL_QDOT,
    MHI_SIGNAL_ACTIVATION,
    MHI_SIGNAL_EXCITATION,
    MHI_SIGNAL_MUSCLE_FORCE,
    MHI_SIGNAL_JOINT_MOMENT,
    MHI_SIGNAL_RESIDUAL_TORQUE,
    MHI_SIGNAL_LOOP_GAP,
    MHI_SIGNAL_LOOP_RATE,
    MHI_SIGNAL_ACTUATOR,
    MHI_SIGNAL_REACTION, /* of the first joint that a cost asks for, and so on */
    MHI_LAST_REACTION = MHI_SIGNAL_REACTION + MHI_MAX_REACTIONS - 1,
    MHI_N_SIGNALS
};

typedef struct mhi_signal {
    const char *name, *unit;
    int32_t n_y;       /* 0: this problem has no such signal */
    int32_t offset;    /* in the vector of all signals */
    int32_t column;    /* first column of z it depends on */
    int32_t n_columns; /* of the dense block; 0: y_i = z[column + i] */
    int32_t reads_u;   /* has no value at the last node */
    int32_t jacobian;  /* offset of its dense block in the node's Jacobian store */
    double scale;      /* y_i = scale z[column + i]: what is carried is of the size of 1, as other
                        * states; else 1 */
} mhi_signal;

typedef struct mhi_signals {
    mhi_signal signal[2 * MHI_N_SIGNALS]; /* the second half: of the node before, n_y = 0 where not
                                           * carried */
    int32_t n_y;                          /* of all signals */
    int32_t n_jacobian;                   /* doubles of the Jacobian store */
    int32_t n_z;                          /* [x; u], where m begins */
    int32_t n_carried; /* entries of m; they follow the n_y values in the vector of all signals */
} mhi_signals;

void mhi_signals_layout(const mhi_system *system, mhi_signals *signals);
/* Signal i of the node before is carried along from now on; its row. */
int32_t mhi_signals_carry(mhi_signals *signals, int32_t i);

/* What joints that costs ask for pass on: places are kept for MHI_MAX_REACTIONS of them, without a
 * name and with n_y = 0 until they are. Row of the one named `name` (lent), which gets the next
 * place if it has none yet; -1: all are taken. */
int32_t mhi_signals_open_reaction(mhi_signals *signals, const char *name);

/* Values y [n_y] of the signals in the bit set `wanted` (1 << MHI_SIGNAL_*), but of joints, at (x,
 * u); u NULL at the last node, where signals that read u become NaN. With `jacobian` [n_jacobian]
 * also their dense blocks, row-major. [hot] */
mhe_status mhi_signals_evaluate(const mhi_signals *signals, const mhi_system *system,
                                mhi_system_context *context, uint32_t wanted, const double *x,
                                const double *u, double *y, double *jacobian, mhe_error *err);

#endif
