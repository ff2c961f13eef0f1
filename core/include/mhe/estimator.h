/* SPDX-License-Identifier: Apache-2.0 */
/* estimator.h: the C API that an application embeds.
 *
 *     mhe_estimator *e;  mhe_error err;
 *     mhe_estimator_open("arm.yaml", NULL, 0, NULL, &e, &err);
 *     while (measure(&frame)) {
 *         mhe_estimator_push(e, &frame, &estimate, &ready, &err);
 *         if (ready) { show(estimate.force); }
 *         mhe_estimator_prepare(e, &err);
 *     }
 *     mhe_estimator_close(e);
 *
 * Moving horizon estimation (Bailly et al. 2021, doi:10.3389/fbioe.2021.642742, Algorithm 1): the
 * window holds the newest N+1 frames; each new frame drops the oldest, fixes the first state to the
 * previous solution's second, and solves again from the shifted solution. The estimate is that of
 * the node that `output.node` names: the first is best known and N intervals late, the last is of
 * the frame just pushed.
 *
 * An estimate comes whatever happens, marked by its status. Frames may be missing, NaN, or wrong:
 * a frame that is late by less than a window leaves nodes without measurements; markers far from
 * where they are expected are left out (`data.marker_outlier`), and so is EMG most of which stays
 * at the ends of its range (`data.emg_saturation`); after more than a window without a frame, or
 * when the clock was set back by more than a window, the window fills anew as at the start. Where
 * three frames in a row do not fit what was expected, or a whole window of solves failed, the
 * window begins again from its measurements (MHE_FRAME_RESTARTED). With `realtime.deadline_ms`
 * every solve ends in time with what it has; the long first solve of a window that begins is then
 * spread over the frames that follow.
 *
 * A config file may come from anywhere, and a plugin is code: a `plugin_path` in the file is
 * refused. An application that trusts a folder names it itself, by `set` or in MHE_PLUGIN_PATH.
 *
 * Threads: one estimator belongs to one thread at a time; several estimators are independent. */
#ifndef MHE_ESTIMATOR_H
#define MHE_ESTIMATOR_H

#include <mhe/config.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mhe_estimator mhe_estimator;

/* Sizes and names, constant over the estimator's life. Names live as long as it. */
typedef struct mhe_estimator_info {
    uint32_t size;
    int32_t formulation; /* 0: excitation-driven, 1: activation-driven */
    int32_t n_q, n_muscles, n_markers, n_residual_torques;
    int32_t window;  /* intervals N */
    int32_t ratio;   /* every ratio-th frame is used */
    double interval; /* s between nodes; known from the first full window on */
    const char *const *coordinate_names;
    const char *const *muscle_names;
    const char *const *marker_names;
    const char *solver; /* plugin ids */
    const char *config_name;
    int32_t node; /* of the estimates: 0 the window's oldest frame, `window` the newest */
    double delay; /* s from that node to the newest frame: (window - node) * interval */
} mhe_estimator_info;

/* One measurement. Missing values are NaN; a NULL array is all missing. Lent for the call. */
typedef struct mhe_frame {
    uint32_t size;
    double time;           /* s */
    const double *markers; /* [n_markers x 3], m, ground frame */
    const double *emg;     /* [n_muscles], normalised 0..1 */
    const double *angles;  /* [n_q], measured coordinates, rad (m): target of the signal `q` */
} mhe_frame;

/* How a frame's estimate came about. */
#define MHE_FRAME_OK 0              /* the solve converged */
#define MHE_FRAME_ITERATION_LIMIT 1 /* the best iterate after max_iterations */
#define MHE_FRAME_DEADLINE 2        /* the best iterate at the deadline */
#define MHE_FRAME_PREDICTED 3       /* no usable solve: the model's prediction */
#define MHE_FRAME_RESTARTED 4       /* first solve after the window began again */

/* Arrays are the estimator's own and valid until its next call; never NaN. */
typedef struct mhe_estimate {
    uint32_t size;
    int32_t status; /* MHE_FRAME_* */
    double time;    /* s, of the frame it belongs to, the chosen node's */
    int32_t iterations;
    double kkt_residual;
    double solve_time;  /* s, of push and prepare */
    double marker_rms;  /* m, distance of estimated and measured markers; NaN without markers */
    double emg_rms;     /* difference of muscle control and EMG; NaN without EMG */
    const double *q;    /* [n_q], rad (m) */
    const double *qdot; /* [n_q], rad/s (m/s) */
    const double *activation; /* [n_muscles] */
    const double *excitation; /* [n_muscles], at the last node of the interval that leads to it;
                               * activation-driven: NULL */
    const double *force;      /* muscle forces [n_muscles], N */
    const double *moment;     /* joint moments by the muscles [n_q], N m */
    const double *residual;   /* residual joint torques [n_residual_torques], N m */
    const double *markers;    /* [n_markers x 3], m */
    double latency;           /* s from the call of push to the estimate */
    double evaluation_time;   /* s of it spent on costs, dynamics and their derivatives */
} mhe_estimate;

/* On a config (mhe/config.h), which is lent and must live longer; its host gets the messages.
 * Several estimators may be made of one. MHE_E_CONFIG, MHE_E_INPUT, MHE_E_PLUGIN: as below. [cold]
 */
MHE_API mhe_status mhe_estimator_create(mhe_config *config, mhe_estimator **estimator,
                                        mhe_error *err);

/* Opens a config file with `set` [n_set] assignments "path.to.key=value". `host` may be NULL
 * (messages are dropped). MHE_E_CONFIG, MHE_E_INPUT, MHE_E_PLUGIN: err->text says file:line and
 * what. [cold] */
MHE_API mhe_status mhe_estimator_open(const char *config, const char *const *set, int32_t n_set,
                                      const mhe_host *host, mhe_estimator **estimator,
                                      mhe_error *err);
MHE_API void mhe_estimator_close(mhe_estimator *estimator); /* NULL is fine. [cold] */

/* Fills `info`. [cold] */
MHE_API void mhe_estimator_describe(const mhe_estimator *estimator, mhe_estimator_info *info);

/* Does what can be done before the next frame comes: shifts the window, linearises it where the
 * solver can. May be called after each push; push does itself what was not done. [cold] */
MHE_API mhe_status mhe_estimator_prepare(mhe_estimator *estimator, mhe_error *err);

/* Takes the next frame (time must increase). `*ready` is 1 when `estimate` was filled: from the
 * window's first fill on, at every ratio-th frame; where frames have markers or angles, not before
 * one is measured or the start is known. A bad frame or a failed solve is told by
 * estimate->status. MHE_E_ARGUMENT: time does not increase (or only less than a window back: then
 * the frame is out of order); the frame is not taken. MHE_E_INPUT: no marker of the first window is
 * within a metre of the model, or the frames are half a second or more apart (times in ms?); the
 * window moves on and the next frame is tried. Anything else is a bug. [cold] */
MHE_API mhe_status mhe_estimator_push(mhe_estimator *estimator, const mhe_frame *frame,
                                      mhe_estimate *estimate, int32_t *ready, mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif
