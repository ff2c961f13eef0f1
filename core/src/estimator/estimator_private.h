/* SPDX-License-Identifier: Apache-2.0 */
/* estimator_private.h: the estimator's parts, shared by its files. */
#ifndef MHI_ESTIMATOR_PRIVATE_H
#define MHI_ESTIMATOR_PRIVATE_H

#include "base/arena.h"
#include "estimator/create.h"
#include "estimator/start.h"

#include <math.h>
#include <mhe/config.h>
#include <mhe/estimator.h>
#include <stddef.h>

struct mhe_estimator {
    const mhe_host *host;
    mhe_config *config; /* its own; NULL where it was lent */
    const mhi_run *run;
    mhe_description *owned_description; /* NULL where it was lent */
    const mhe_description *description;
    mhi_system *system;
    mhi_ocp *ocp;
    const mhe_solver_ops *solver;
    void *solver_self;
    mhi_start *start;

    int32_t n_q, n_m, n_k, n_r, n_x, n_u, n; /* n: intervals of the window */

    int32_t node; /* whose estimate is given: 0 the oldest, n the newest */

    /* Measurements, one row a node, oldest first; `filled` rows are there. */
    int32_t filled;
    double *times;   /* [n+1] */
    double *markers; /* [(n+1) x 3 n_k] */
    double *trusted; /* the same, NaN where recover.c does not believe them */
    double *emg;     /* [(n+1) x n_m] */
    double *angles;  /* [(n+1) x n_q] */
    /* EMG of the last frames, for the electromechanical delay. */
    double *delay_line; /* [(delay+1) x n_m] */
    int32_t delay;
    int64_t n_frames; /* pushed so far */

    /* The even grid of nodes that the frames' times stand for (clock.c). */
    double last_time;  /* of the last frame */
    double interval;   /* s between nodes; 0: not known before the window is full */
    double grid;       /* s, the newest node's */
    int32_t n_counted; /* frames since the window was emptied */
    double *steps;     /* [n], scratch */
    double *distance;  /* [n+1], scratch */

    /* How far the window is. */
    int32_t has_posture; /* a frame had markers or angles, be they missing */
    int32_t waited;      /* used frames before the first window for want of a posture */
    int32_t begun;       /* it has a start; else the next solve begins it from the measurements */
    int32_t settled;     /* its first state is known, and fixed; else free */
    int32_t rounds;      /* proximal solves since it was begun */
    int32_t prepared;    /* the start of the next solve is made */
    int32_t restarted;   /* begun again and no solve has succeeded since */
    int32_t solved;      /* windows so far */

    /* How well it goes (recover.c). */
    double outlier;      /* m; 0: everything is believed */
    double fit;          /* m, RMS marker distance of the newest node solved */
    double *expected;    /* [3 n_k] markers of the newest node before it is measured */
    int32_t saturation;  /* frames; 0: any EMG is believed */
    int32_t railed;      /* frames in a row whose EMG is at its rails */
    int32_t implausible; /* frames in a row most of whose markers are not where expected */
    int32_t predicted;   /* failed solves in a row */

    /* s, of CLOCK_MONOTONIC where a point in time. */
    double budget;  /* from a frame's arrival to its estimate; 0: no limit */
    double arrival; /* of the frame in work */
    double ahead;   /* spent by mhe_estimator_prepare on the next estimate */

    const atomic_int *stop; /* by a signal; NULL: never */
    int32_t failure_told;   /* the host knows that the solver gave an error */
    mhe_solution solution;
    double *guess_x, *guess_u;           /* what the last solve started from */
    double *prior_centre, *prior_weight; /* [n_x], of an unsettled window's proximal term */
    double *start_q, *start_v;           /* known first state [n_q], NaN where free */
    double *torque_max;                  /* largest residual torques [n_q], N m; 0: none */

    double *no_markers, *no_emg, *no_angles; /* all missing */

    /* The estimate handed out. */
    double *out_activation, *out_excitation, *out_force, *out_moment, *out_marker, *out_residual;
    double *out_q, *out_v;
    mhi_arena arena;
};

double mhi_now(void); /* s of CLOCK_MONOTONIC */

/* estimator.c: nothing is known of the first state. */
void mhi_estimator_forget_start(mhe_estimator *e);

/* limits.c: torque_max from the bounds section. MHE_E_CONFIG: no such coordinate, no number. */
mhe_status mhi_estimator_limits(mhe_estimator *e, mhe_error *err);

/* clock.c. Is this frame to be used? Missing nodes before it are put in. MHE_E_ARGUMENT: its time
 * does not follow the last one's. */
mhe_status mhi_clock_take(mhe_estimator *e, double time, int32_t *used, mhe_error *err);
/* Learns the interval from the full window. `*known` 0: there is a gap in it; what lies before is
 * dropped. MHE_E_INPUT: the frames come too seldom for seconds (MHI_SLOWEST). */
mhe_status mhi_clock_measure(mhe_estimator *e, int32_t *known, mhe_error *err);

/* window.c */
void mhi_window_append(mhe_estimator *e, double time, const double *markers, const double *emg,
                       const double *angles);
void mhi_window_skip(mhe_estimator *e, double time); /* a node without a measurement */
void mhi_window_clear(mhe_estimator *e);             /* as if no frame had come yet */
/* What can be done for the next solve before its newest frame is there: start, bounds, the solver's
 * part. Once between two frames of a window that was begun. */
void mhi_window_follow(mhe_estimator *e);
void mhi_window_set_targets(mhe_estimator *e);
/* Bounds of every node, the first state fixed where it is settled. */
void mhi_window_set_bounds(mhe_estimator *e);
/* Drops the oldest node and shifts the solution to start the next. */
void mhi_window_advance(mhe_estimator *e);

/* begin.c: start of a full window from its measurements alone. MHE_E_INPUT: the markers do not fit
 * the model at all; nothing is changed. */
mhe_status mhi_window_begin(mhe_estimator *e, mhe_error *err);

/* solve.c: solves; the outcome as MHE_FRAME_*. MHE_E_INTERRUPTED: told to stop, no outcome. */
mhe_status mhi_window_solve(mhe_estimator *e, mhe_solve_info *info, int32_t *frame_status,
                            mhe_error *err);

/* recover.c */
void mhi_recover_screen(mhe_estimator *e); /* the newest frame against what is expected */
/* Counts a frame's EMG [n_m], used or not, and takes out of the window what is at the rails. */
void mhi_recover_count_emg(mhe_estimator *e, const double *emg);
void mhi_recover_drop_emg(mhe_estimator *e);
int32_t mhi_recover_is_lost(const mhe_estimator *e);
void mhi_recover_begun(mhe_estimator *e); /* the window begins again: believe what was measured */
void mhi_recover_solved(mhe_estimator *e, int32_t frame_status);

/* locked.c: takes what the model section locks out of a description just read. */
mhe_status mhi_estimator_lock(const mhi_run *run, mhe_description *description, mhe_error *err);

/* Distance of two sets of n numbers, of which per_point make a point; NaN entries do not count. */
double mhi_rms_distance(const double *a, const double *b, int32_t n, int32_t per_point);

static inline double *mhi_row(double *array, int32_t k, int32_t width) {
    return array + (ptrdiff_t)k * width;
}

static inline double mhi_clip(double value, double lower, double upper) {
    return fmin(fmax(value, lower), upper);
}

#endif
