/* SPDX-License-Identifier: Apache-2.0 */
/* rounding.h: what frames that are not quite rotations add to the torques of the joints.
 *
 * A rotation matrix R read from a file has the file's digits, and is used as it stands. M(q) and
 * gravity follow from the joints' places and axes z in such frames as in true ones. But the
 * recursion of dynamics.c lets a joint turn all beyond it about z, while in fact R is turned:
 *     dR/dangle = R [z]x R^-1 R = ([R z]x + E) R,    E = (R - cof R) [z]x R^-1,
 * and E is 0 for rotations only. Without E the torques of speed are not those of M, which makes or
 * loses kinetic energy, and moves accelerations by the rounding times the condition number of M.
 * Here are the terms with E of Lagrange's
 *     dM/dt v - 1/2 d(v^T M v)/dq. */
#ifndef SIMBODY_ROUNDING_H
#define SIMBODY_ROUNDING_H

#include "dynamics.h"

/* Of one link. Strain moves a point x of it by the velocity W x + u, beside the rigid one. */
typedef struct link_rounding {
    double joint[9];         /* E of its joint */
    double strain[9];        /* W: sum of the joints' E times speed, from ground to here */
    double drift[3];         /* u */
    double axis_rate[6];     /* of its joint's axis S, by strain of the parent */
    double acceleration[6];  /* by the axes' rates */
    double momentum[6];      /* composite, as are those below */
    double force[6];         /* rate of momentum by strain */
    double energy_strain[9]; /* derivative of kinetic energy by W of what is beyond the joint */
    double energy_drift[3];  /* by u */
} link_rounding;

/* torque [n_joints] at joint speeds [n_joints], of `links` and `points` after
 * dynamics_velocities(), in the placement r, p. `work` [n_joints] is scratch. */
void rounding_torque(const tree *tree, const double *r, const double *p, const double *speed,
                     const link_motion *links, const link_points *points, link_rounding *work,
                     double *torque);

#endif
