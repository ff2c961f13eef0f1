/* SPDX-License-Identifier: Apache-2.0 */
/* dynamics.h: inverse dynamics of the tree and its exact derivatives, in ground coordinates.
 *
 * The recursive derivatives of Carpentier & Mansard, "Analytical derivatives of rigid body dynamics
 * algorithms", RSS 2018, doi 10.15607/RSS.2018.XIV.038, summed over subtrees as in Singh, Russell &
 * Wensing, IEEE Robotics and Automation Letters 7(2), 2022. Everything here is per joint; functions
 * of coordinates are the caller's. */
#ifndef SIMBODY_DYNAMICS_H
#define SIMBODY_DYNAMICS_H

#include "tree.h"

/* A rigid body's or several bodies' inertia in ground axes about the ground origin. */
typedef struct rigid_inertia {
    double mass, first[3]; /* first: mass times centre of mass */
    double second[9];
} rigid_inertia;

/* f = I v */
void inertia_times(const rigid_inertia *inertia, const double *v, double *f);

/* A link's inertia about its centre of mass, in ground axes, as rest + trace(points) 1, `points` as
 * in tree_joint: a frame that is not quite a rotation turns both by r . r^T. */
typedef struct link_points {
    double points[9], rest[9];
} link_points;

/* What is known of one link at the present state. Composite: of the link and all beyond it. */
typedef struct link_motion {
    double axis[6];         /* motion of the link per unit of joint speed, S */
    double velocity[6];     /* v */
    double axis_rate[6];    /* v of the parent x S */
    double acceleration[6]; /* a, with gravity as an upward acceleration of ground */
    double force[6];        /* composite: rate of momentum */
    rigid_inertia own, composite;
    double second[6];            /* S'' of dynamics.c, of the last dynamics_derivatives() */
    double rate[9], momentum[3]; /* composite: change of force with velocity, dynamics_rates() */
} link_motion;

/* The links' placement in ground, r [n_joints x 9], p [n_joints x 3], at the joints' `angle` (rad
 * or m). */
void dynamics_place(const tree *tree, const double *angle, double *r, double *p);

/* Axes from the links' placement: r [n_joints x 9], p [n_joints x 3]. Needed by all below. */
void dynamics_axes(const tree *tree, const double *r, const double *p, link_motion *links);

/* Own and composite inertias. Needed by all below. Sets points [n_joints] as well; NULL: the frames
 * are rotations. */
void dynamics_inertias(const tree *tree, const double *r, const double *p, link_motion *links,
                       link_points *points);

/* M [n_joints x n_joints] */
void dynamics_mass(const tree *tree, const link_motion *links, double *mass);

/* Velocities at joint speeds [n_joints]. Needed by all below. */
void dynamics_velocities(const tree *tree, const double *speed, link_motion *links);

/* torque [n_joints] that gives the joints `acceleration` [n_joints] against gravity. */
void dynamics_inverse(const tree *tree, const double *speed, const double *acceleration,
                      link_motion *links, double *torque);

/* Of the state and velocities: what dynamics_derivatives() needs beside dynamics_inverse(). */
void dynamics_rates(const tree *tree, link_motion *links);

/* Derivatives of the torques of the last dynamics_inverse(): by_angle and by_speed [n_joints x
 * n_joints], row: torque. */
void dynamics_derivatives(const tree *tree, link_motion *links, double *by_angle, double *by_speed);

#endif
