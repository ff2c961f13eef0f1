/* SPDX-License-Identifier: Apache-2.0 */
/* context.h: what one thread needs to evaluate a model. */
#ifndef SIMBODY_CONTEXT_H
#define SIMBODY_CONTEXT_H

#include "dynamics.h"
#include "model.h"
#include "path.h"
#include "rounding.h"
#include "route.h"
#include "skeleton.h"

typedef struct simbody_model {
    const mhe_host *host;   /* NULL: none */
    struct path_fits *fits; /* NULL: paths are exact */
    route_set *whole;       /* of the fitted paths */
    const mhe_description *description;
    tree *tree;
    route_set *routes;
    int32_t *own_start, *own; /* path p depends on own[own_start[p] .. own_start[p + 1]] */
    path_bundle *bundles;
    int32_t n_bundles;
    int32_t dynamics; /* SIMBODY_DYNAMICS_* */
} simbody_model;

typedef struct simbody_context {
    const mhe_host *host;
    const mhe_description *description;
    const tree *tree;
    const route_set *routes;
    const int32_t *own_start, *own; /* the model's */
    route_work route_work;
    const path_bundle *bundles; /* [n_bundles] the model's */
    int32_t n_bundles;
    int32_t dynamics;
    int32_t placed;     /* a state was set */
    int32_t has_mass;   /* inertias and mass matrices are those of the state */
    int32_t has_motion; /* velocities and bias are those of the state */
    int32_t has_rates;
    skeleton *skeleton;
    link_motion *links; /* [n_joints] */
    path_step *steps;
    link_points *points;     /* [n_joints]; NULL: the frames are, or count as, rotations */
    link_rounding *rounding; /* likewise */
    double *memory;          /* all below */
    double *v;               /* [n_q] */
    double *numbers;         /* [4 x coordinates, free and dependent], see numbers.h */
    double *slopes;          /* [n_joints x 4] */
    double *angle, *speed, *acceleration, *torque; /* [n_joints] */
    double *rounding_torque;                       /* [n_joints] */
    double *r, *p;                                 /* links' placement */
    double *joint_mass, *by_angle, *by_speed;      /* [n_joints x n_joints] */
    double *mass, *factor;                         /* [n_q x n_q] */
    double *bias, *rest;                           /* [n_q] */
    double *length_q;                              /* [n_muscles x n_q] */
    double *loop_acceleration, *loop_vdot;         /* [n_joints x 6], [n_q]; see loops.c */
} simbody_context;

/* inside.c: warns of paths whose points lie inside their obstacles at the default position. Of a
 * model that is built, with a host. */
mhe_status simbody_tell_inside(simbody_model *model, mhe_error *err);

/* bodies.c: poses of the bodies and their derivatives, as mhe_kinematics has them; either may be
 * NULL. Of a context that is placed. */
void bodies_place(const simbody_context *c, double *body, double *body_q);
/* Pose of one body (-1: ground) in ground. */
void bodies_pose(const simbody_context *c, int32_t body, double r[9], double p[3]);

#endif
