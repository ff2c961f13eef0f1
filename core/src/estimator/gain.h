/* SPDX-License-Identifier: Apache-2.0 */
/* gain.h: how the window answers errors of what it rests on, to first order.
 *
 * Around its solution a window is a linear-quadratic problem whose first state is given, so that
 * its states and controls are linear in that state's error and in those of measurements and model.
 * The answers are found by the Riccati recursion of a window that stays as it is at one node:
 * moment arms and weights change little in a tenth of a second. One stage is done a frame, so that
 * no frame is longer than another, and the answers are renewed every few frames.
 *
 * A control that may come to a bound answers a share of what it would without (`free`). That is as
 * if it had more weight of its own.
 *
 * Columns are unit errors: of each muscle's EMG, at all nodes; of each muscle's force (in the place
 * of an error of its activation), on all intervals; of the posture that the markers show, at all
 * nodes, in n_q independent directions; and the same of single nodes, the newest first, each for
 * itself. Those of nodes that have left the window go on behind them for as long again. */
#ifndef MHI_GAIN_H
#define MHI_GAIN_H

#include "base/arena.h"
#include "base/product.h"

#define MHI_GAIN_LONGEST 64 /* intervals of a window whose output is not the first node's */

/* Filled by the caller before a sweep begins. All of one node, row-major. */
typedef struct mhi_gain_node {
    double *A, *B;                   /* [n_x x n_x], [n_x x n_u] */
    double *hess_xx;                 /* [n_x x n_x] */
    double *hess_ux;                 /* [n_u x n_x] */
    double *hess_uu;                 /* [n_u x n_u] */
    double *force;                   /* [n_x x n_m] next state by a force error */
    double *pose_fixed, *pose_fresh; /* [n_q x n_q] gradient by q of the posture's directions */
    double *control;                 /* [n_m] gradient by a muscle's control of its EMG's error */
    double *free;                    /* [n_m] share of what a muscle's control answers, in (0, 1] */
} mhi_gain_node;

/* A sweep's result. `ff`: controls by the columns. */
typedef struct mhi_gain_answer {
    double *A, *B, *force; /* as above */
    double *K, *ff;        /* at node 0: [n_u x n_x], [n_u x n_window] */
    double *free;          /* as above */
    double *weight;        /* [n_m] what holds a muscle's control while all others answer */
    double *to_x, *to_ff;  /* state of the output's node: by x_0, by columns */
    double *u_x, *u_ff;    /* its controls (of the last node those before), by the same */
} mhi_gain_answer;

typedef struct mhi_gain {
    int32_t n_x, n_u, n_q, n_m;
    int32_t horizon;  /* intervals that are looked at: the window's, or the first of a long one */
    int32_t whole;    /* 1: the window's, whose last node's costs count for themselves */
    int32_t node;     /* of the output */
    int32_t n_window; /* columns that a window answers */
    int32_t n_columns;
    int32_t fixed, fresh; /* first column of postures at all nodes, of single nodes */
    double interval;
    mhi_gain_node here;
    mhi_gain_answer known;
    int32_t has_known;
    /* The sweep in work. */
    int32_t stage, forward; /* what is next: stage backwards, or interval forwards */
    double *V, *T;          /* [n_x x n_x], [n_x x n_window] cost to go, its gradient */
    double *K, *ff;         /* [horizon] */
    double *to_x, *to_ff, *u_x, *u_ff;
    double *VA, *VB, *BVA, *M, *BT, *closed, *more, *inverse;
} mhi_gain;

mhe_status mhi_gain_create(mhi_gain *gain, mhi_arena *arena, mhe_error *err);
void mhi_gain_begin(mhi_gain *gain); /* a sweep, with what `here` and `interval` hold */
/* One stage of it. 1: that was the last, `known` is new; -1: there is no answer. */
int32_t mhi_gain_go_on(mhi_gain *gain);

#endif
