/* SPDX-License-Identifier: Apache-2.0 */
/* rig.h: a variant set up to be timed: its recording, points of its own motion, whole runs. */
#ifndef RIG_H
#define RIG_H

#include "estimator/create.h"
#include "estimator/errors.h"
#include "variants.h"

#define RIG_POINTS_MAX 64

typedef struct rig {
    const variant *variant;
    const mhe_host *host; /* of what is created again for every run */
    mhi_recording *recording;
    int32_t n_frames; /* of the recording that a run takes */
    int32_t n_estimates_max;
    mhe_estimator *estimator; /* of the first run; its problem is what layers are timed on */
    mhe_estimator_info info;
    /* States and controls along the first run. */
    double *x, *u; /* [n_points x n_x], [n_points x n_u] */
    int32_t n_points;
    /* What the first run came to. */
    int32_t n_estimates, n_converged, iterations_max;
    double iterations_sum;
    int32_t has_rmse;
    mhi_rmse rmse;
    mhi_arena arena;
} rig;

/* Reads the data and makes a first run, which is not timed, of at most `estimates` estimates (0:
 * all). Warnings go to `loud`, those of later runs to `silent`. Give back with rig_free in any
 * case. */
mhe_status rig_create(const variant *v, int32_t estimates, const mhe_host *loud,
                      const mhe_host *silent, rig *r, mhe_error *err);
void rig_free(rig *r);

/* Parts of a frame's time. */
#define PART_FRAME 0      /* preparation and feedback */
#define PART_PREPARE 1    /* before the frame is there */
#define PART_FEEDBACK 2   /* from the frame to its estimate */
#define PART_EVALUATION 3 /* of the feedback: costs, dynamics, derivatives */
#define PART_REST 4       /* of the feedback: quadratic programs and what else the solver does */
#define N_PARTS 5

/* A whole run on a new estimator, prepared between the frames: seconds of each estimate, in
 * parts[i] [n <= n_estimates_max]. Making the estimator is not timed. */
mhe_status rig_run(const rig *r, double *const *parts, int32_t *n, mhe_error *err);

#endif
