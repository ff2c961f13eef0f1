/* SPDX-License-Identifier: Apache-2.0 */
/* parameters.h: what a problem estimates beside its motion: numbers p that are the same at all
 * nodes.
 *
 * Parameters are dimensionless or small by themselves, so that solvers see them all of one size: a
 * number of a muscle is p times the model's, EMG is
 *
 *     emg = h(u) / gain,     h(u) = ln(1 + u (exp(A) - 1)) / A,     h(u) = u where A = 0,
 *
 * which is the excitation u = (exp(A gain emg) - 1) / (exp(A) - 1) of Lloyd and Besier (2003,
 * doi:10.1016/S0021-9290(03)00010-1) the other way round, and a marker stands at its place in the
 * model plus an offset (units of 10 mm) in its body's axes, as does the last point of a muscle's
 * path. EMG that is measured d (units of 10 ms) before what it excites is compared with that of
 * d earlier: what the EMG differs by between the two times is added to y. What is measured stays as
 * it is: the noise is that of the measurement. Each parameter has a mean and a standard deviation
 * that are known beforehand, which the objective holds at node 0. */
#ifndef MHI_OCP_PARAMETERS_H
#define MHI_OCP_PARAMETERS_H

#include "base/arena.h"
#include "ocp/signals.h"

#define MHI_OFFSET_UNIT 0.01 /* m that an offset of a marker or an insertion counts in */
#define MHI_DELAY_UNIT 0.01  /* s that a delay counts in */

typedef struct mhi_parameter {
    double start, mean, sd; /* sd infinity: nothing is known */
    double lower, upper;
} mhi_parameter;

/* EMG of a muscle at node k as it was `delay` (s) before, NaN: missing; *slope: its derivative by
 * the delay. [any] */
typedef double mhi_emg_before(const void *data, int32_t k, int32_t muscle, double delay,
                              double *slope);

/* Lists of numbers of parameters, -1: none; NULL: none at all. Copied. */
typedef struct mhi_parameters_setup {
    int32_t n;
    const mhi_parameter *list;   /* [n] */
    const int32_t *of_system;    /* [n_p of the system], whose number is the model's times p, of an
                                  * insertion that plus MHI_OFFSET_UNIT p */
    const int32_t *gain, *shape; /* [n_m] */
    const int32_t *marker;       /* [n_k] of the first of three */
    const int32_t *delay;        /* [n_m] */
    mhi_emg_before *emg_before;  /* where there are delays; `emg` is its data, lent */
    const void *emg;
} mhi_parameters_setup;

/* dy/dp of one entry of a signal; column: of the Jacobian that a diagonal signal has at its place.
 */
#define MHI_MOST_BY_P 6 /* a muscle's force: three numbers of its own, and where it ends */
typedef struct mhi_by_parameter {
    int32_t n, at[MHI_MOST_BY_P];
    double by[MHI_MOST_BY_P];
    const double *row; /* [n of the parameters] by all of them instead; NULL: the list says it */
    double slope;      /* dy/dz of an entry that is z[column] where nothing is estimated */
} mhi_by_parameter;

typedef struct mhi_parameters {
    mhi_parameters_setup setup;
    int32_t moved[2];  /* entries of the system's parameters that are offsets: from, to */
    int32_t of_bodies; /* entries of the system's parameters from here on are no muscles' */
    int32_t set;       /* the system has the numbers that p says */
    int32_t control;   /* the signal that the muscles' controls are */
    double *p;         /* [n] now */
    double *model;     /* [n_p of the system] the model's own numbers */
    double *system;    /* scratch of the same size */
    double *lower, *upper;
} mhi_parameters;

/* Takes over a setup. [cold] */
mhe_status mhi_parameters_create(const mhi_parameters_setup *setup, const mhi_system *system,
                                 mhi_arena *arena, mhi_parameters *parameters, mhe_error *err);
/* [cold] */
mhe_status mhi_parameters_set(mhi_parameters *parameters, mhi_system *system, const double *p,
                              mhe_error *err);
/* The signals `wanted` of node k in y as they are measured (EMG whose target of `targets` [n_y],
 * may be NULL, is missing stays the control itself: its gain says nothing), and `by` [n_y] of them
 * (NULL: not wanted); jacobian as of mhi_signals_evaluate, changed where markers' offsets turn with
 * their bodies. [hot] */
mhe_status mhi_parameters_measure(const mhi_parameters *parameters, const mhi_signals *signals,
                                  const mhi_system *system, mhi_system_context *context,
                                  uint32_t wanted, int32_t k, const double *x, const double *u,
                                  const double *targets, double *room, double *y, double *jacobian,
                                  mhi_by_parameter *by, mhe_error *err);
/* Doubles of room, where `n` parameters are estimated. */
int32_t mhi_parameters_room(const mhi_system *system, int32_t n);
/* dF/dp [n_x x n] out of that by the system's parameters [n_x x n_p]. [hot] */
void mhi_parameters_fold(const mhi_parameters *parameters, int32_t n_x, int32_t n_p,
                         const double *of_system, double *P);

#endif
