/* SPDX-License-Identifier: Apache-2.0 */
/* joints.h: what joints transmit.
 *
 * Each joint gets six motions more, three shifts along and three turns about the axes of the
 * joint's frame in the child, all held at 0. The generalised force that inverse dynamics finds on
 * such a motion, less that of all loads and pulls, is what the joint has to give there: force and
 * moment on the child at that frame's origin. The moments of turns in a row are about the frame's
 * own axes, because the turns stand at 0. */
#ifndef MHI_JOINTS_H
#define MHI_JOINTS_H

#include "base/arena.h"
#include "model/system.h"

/* Axes that a reaction is given in; the values of output.reactions. */
#define MHI_IN_NONE 0
#define MHI_IN_CHILD 1  /* those of the body that the joint carries */
#define MHI_IN_PARENT 2 /* those of the body that it sits on */
#define MHI_IN_GROUND 3

/* `d` with six motions more between each joint's own and its child; coordinates of body i are
 * [n + 6 i, n + 6 i + 6), n those of `d`. Memory from `arena`; `d` must outlive it. [cold] */
mhe_status mhi_joints_open(const mhe_description *d, mhi_arena *arena, mhe_description *out,
                           mhe_error *err);
/* `d` with three shifts alone, before the own motions of `body`'s joint: along axes that the parent
 * body holds fast (those of joint_r), whatever the coordinates. Numbers [n, n + 3). [cold] */
mhe_status mhi_joints_loosen(const mhe_description *d, int32_t body, mhi_arena *arena,
                             mhe_description *out, mhe_error *err);
/* A model plugin's config with true paths: a fit knows nothing of a joint's own motions. [cold] */
mhe_status mhi_joints_exact_paths(const mhe_plugin *model, const void *config, mhi_arena *arena,
                                  const void **exact, mhe_error *err);
/* Force and moment of body i's joint on the body: `poses` [12 x n_bodies] as kinematics() gives
 * them, `tau` of the opened description `d`, of which `n` are its own. */
void mhi_joints_reaction(const mhe_description *d, int32_t i, const double *poses,
                         const double *tau, int32_t n, int32_t axes, double out[6]);

/* Reactions of a system's joints. */
typedef struct mhi_reactions mhi_reactions;
/* MHE_E_UNSUPPORTED: a muscle whose path has no points. `setup` is the one of the system.
 * [cold] */
mhe_status mhi_reactions_create(const mhi_system_setup *setup, const mhi_system *system,
                                mhi_reactions **reactions, mhe_error *err);
void mhi_reactions_free(mhi_reactions *reactions);
/* At a state with its controls and inputs: out [n_bodies x 6]. Muscles pull along their true paths,
 * also where the system's are fitted. Residual torques are part of what the joint transmits.
 * `context` of the same system. [hot] */
mhe_status mhi_reactions_solve(mhi_reactions *reactions, mhi_system_context *context,
                               const mhe_system_point *at, int32_t axes, double *out,
                               mhe_error *err);

#endif
