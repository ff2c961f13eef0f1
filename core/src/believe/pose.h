/* SPDX-License-Identifier: Apache-2.0 */
/* pose.h: recorded markers on the model's nearest postures, under one common transform of them. */
#ifndef MHI_POSE_H
#define MHI_POSE_H

#include "estimator/recording.h"
#include "model/system.h"

#define MHI_POSE_TURN 1
#define MHI_POSE_SHIFT 2
#define MHI_POSE_SCALE 4

/* point -> scale turn point + shift; `turn` is orthogonal, a reflection where its determinant is
 * -1. */
typedef struct mhi_pose {
    double turn[9], shift[3], scale;
} mhi_pose;

typedef struct mhi_pose_search mhi_pose_search;

/* A dozen frames of the recording that show enough markers. *search is NULL where there are none.
 * MHE_E_MEMORY. [cold] */
mhe_status mhi_pose_open(const mhi_system *system, const mhi_recording *recording,
                         mhi_pose_search **search, mhe_error *err);
void mhi_pose_close(mhi_pose_search *search);

/* 1: few frames are looked at from here on, for a first choice; 0: all. */
void mhi_pose_look(mhi_pose_search *search, int32_t few);
/* 1: the work that a search may take is used up; what is found from here on is an upper bound. */
int32_t mhi_pose_spent(const mhi_pose_search *search);

mhi_pose mhi_pose_identity(void);
/* RMS distance of the transformed markers from the nearest postures, m. `anywhere`: these are
 * looked for from all over the ranges, else from the postures before. NaN: not known. */
double mhi_pose_fit(mhi_pose_search *search, const mhi_pose *pose, int32_t anywhere);
/* All postures are the default one, for mhi_pose_adjust to begin from. */
mhe_status mhi_pose_rest(mhi_pose_search *search);
/* Adjusts what `freedom` (MHI_POSE_*) names together with the postures, from those of the last fit
 * or rest, in at most `rounds` steps; returns the RMS distance that remains. */
double mhi_pose_adjust(mhi_pose_search *search, int32_t freedom, int32_t rounds, mhi_pose *pose);

/* Postures of the last fit [frames x n_q] and their number. */
const double *mhi_pose_postures(const mhi_pose_search *search, int32_t *n_frames);
/* Largest angle in degrees between up of the default posture and of the recorded ones as whole
 * bodies, where up is against gravity; NaN without gravity. */
double mhi_pose_tilt(mhi_pose_search *search, const mhi_pose *pose);

#endif
