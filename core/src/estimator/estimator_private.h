/* SPDX-License-Identifier: Apache-2.0 */
/* estimator_private.h: the estimator as the sum of its parts.
 *
 *     frame -> clock (which node?) -> channels (its measurements) -> trust (which are believed?)
 *           -> window (targets, bounds, start) -> solve -> output
 *
 * Each part is a struct with a file of its own. How far the window is says `phase`, which phase.c
 * alone changes. */
#ifndef MHI_ESTIMATOR_PRIVATE_H
#define MHI_ESTIMATOR_PRIVATE_H

#include "base/arena.h"
#include "estimator/bands.h"
#include "estimator/begin.h"
#include "estimator/channel.h"
#include "estimator/clock.h"
#include "estimator/create.h"
#include "estimator/feed.h"
#include "estimator/output.h"
#include "estimator/pace.h"
#include "estimator/rates.h"
#include "estimator/tasks.h"
#include "estimator/trust.h"
#include "estimator/unmet.h"
#include "estimator/window.h"
#include "model/joints.h"

#include <math.h>
#include <mhe/config.h>
#include <mhe/estimator.h>
#include <stddef.h>

struct mhe_estimator {
    const mhe_host *host;
    mhe_config *config; /* its own; NULL where it was lent */
    atomic_int stopped; /* mhe_estimator_stop */
    mhi_feed feed;
    const mhi_run *run;
    mhe_description *owned_description; /* NULL where it was lent */
    const mhe_description *description;
    mhi_system *system;
    mhi_reactions *reactions; /* NULL: not wanted */
    const char **joint_names; /* [n_bodies] */
    const mhi_tasks *tasks;   /* data.marker_weights; NULL: none */
    mhi_ocp *ocp;
    const mhe_solver_ops *solver;
    void *solver_self;
    int32_t failure_told;   /* the host knows that the solver gave an error */
    const atomic_int *stop; /* by a signal; NULL: never */

    int32_t n_q, n_m, n_k, n_r, n_x, n_u; /* of the system */
    int32_t node;  /* whose estimate is given: 0 the oldest, `window.n` the newest */
    int32_t phase; /* MHE_PHASE_*, see phase.c */

    mhi_frame_clock clock;
    mhi_channels channels;
    mhi_trust trust;
    mhi_window window;
    mhi_begin begin;
    mhi_rates rates;
    mhi_pace pace;
    mhi_output output;
    mhi_unmet unmet;
    mhi_bands *bands;     /* NULL: not wanted */
    const double **given; /* [channels] what the frame in work says, scratch */
    mhi_arena arena;
};

/* phase.c: what happens to a window, and what phase it is in then. */
#define MHI_EVENT_EMPTIED 0 /* as if no frame had come yet */
#define MHI_EVENT_NODES 1   /* nodes were added or dropped */
#define MHI_EVENT_BEGUN 2   /* it has a start from its measurements, with the first state free */
#define MHI_EVENT_SETTLED 3 /* its first state is known */
void mhi_phase_on(mhe_estimator *e, int32_t event);
int32_t mhi_phase_begun(const mhe_estimator *e);   /* it has a start */
int32_t mhi_phase_settled(const mhe_estimator *e); /* and its first state is fixed */

/* solve.c: solves; the outcome as MHE_FRAME_*. MHE_E_INTERRUPTED: told to stop, no outcome. */
mhe_status mhi_window_solve(mhe_estimator *e, mhe_solve_info *info, int32_t *frame_status,
                            mhe_error *err);

/* locked.c: takes what the model section locks out of a description just read. */
mhe_status mhi_estimator_lock(const mhi_run *run, mhe_description *description, mhe_error *err);
/* What the description knows of the motion to come: the range of model.motion, else of data.angles.
 * [cold] */
mhe_status mhi_estimator_motion(const mhi_run *run, mhe_description *description,
                                const mhe_host *host, mhe_error *err);

/* feed.c: means of the intervals that are not complete yet, as far as their samples go. */
mhe_status mhi_feed_before_solve(mhe_estimator *e, mhe_error *err);

/* Distance of two sets of n numbers, of which per_point make a point; NaN entries do not count. */
double mhi_rms_distance(const double *a, const double *b, int32_t n, int32_t per_point);

static inline double *mhi_row(double *array, int32_t k, int32_t width) {
    return array + (ptrdiff_t)k * width;
}

static inline double mhi_clip(double value, double lower, double upper) {
    return fmin(fmax(value, lower), upper);
}

#endif
