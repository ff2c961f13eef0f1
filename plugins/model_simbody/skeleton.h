/* SPDX-License-Identifier: Apache-2.0 */
/* skeleton.h: a tree as a Simbody system. Each skeleton is a system and state of its own, so that
 * skeletons on different threads share nothing. */
#ifndef SIMBODY_SKELETON_H
#define SIMBODY_SKELETON_H

#include "tree.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct skeleton skeleton;

/* `tree` must outlive the skeleton. `description`, which the tree is of: with mass and loops; NULL:
 * for poses alone. [cold] */
mhe_status skeleton_create(const tree *tree, const mhe_description *description, skeleton **out,
                           mhe_error *err);
void skeleton_free(skeleton *skeleton); /* [cold] */

/* Sets the joints to `angle` [n_joints] (rad or m) and writes the links' placement in ground: r
 * [n_joints x 9], p [n_joints x 3]. [hot] */
mhe_status skeleton_place(skeleton *skeleton, const double *angle, double *r, double *p,
                          mhe_error *err);

/* Of a skeleton with mass, at the angles placed last: joint torques `torque` [n_joints] that give
 * `acceleration` at `speed` against gravity, and mass matrix M [n_joints x n_joints]; NULL: not
 * wanted. [hot] */
mhe_status skeleton_dynamics(skeleton *skeleton, const double *speed, const double *acceleration,
                             double *torque, double *mass, mhe_error *err);

/* What Simbody's constraints Ball and Weld say of the loops at the angles placed last, `speed` and
 * `acceleration` [n_joints], in the rows and axes of mhe_loop_values; NULL: not wanted. Where loops
 * are closed (and, for accelerations, keep so) these are the recursion's values; elsewhere Simbody
 * measures rates in moving axes. [hot] */
mhe_status skeleton_loops(skeleton *skeleton, const double *speed, const double *acceleration,
                          double *gap, double *rate, double *loop_acceleration, mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif
