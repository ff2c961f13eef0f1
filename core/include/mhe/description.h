/* SPDX-License-Identifier: Apache-2.0 */
/* description.h: a musculoskeletal model as plain data, whatever file it came from.
 *
 * Made by the readers (.osim, .bioMod), read by model and muscle plugins. SI units and radians.
 * Rotation matrices are row-major [3 x 3] and map child coordinates to parent coordinates. All
 * memory is owned by the core and outlives every plugin instance. */
#ifndef MHE_DESCRIPTION_H
#define MHE_DESCRIPTION_H

#include <mhe/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A scalar function as a row of cubic pieces: f(t) = c0 + c1 s + c2 s^2 + c3 s^3 with s = t -
 * origin[i]. Piece i > 0 serves t >= origin[i] (and below the next piece's origin); piece 0
 * everything below origin[1]. Linear functions and constants are one piece; a spline carries its
 * linear extrapolation as first and last piece. */
typedef struct mhe_function {
    const double *origin; /* [n_pieces], increasing from piece 1 on */
    const double *coef;   /* [n_pieces x 4] */
    int32_t n_pieces;     /* >= 1 */
} mhe_function;

#define MHE_MOTION_ROTATION 0    /* about `axis`, value in rad */
#define MHE_MOTION_TRANSLATION 1 /* along `axis`, value in m */

/* One elementary motion f(q[coordinate]) in the frame that the motions before it have reached. */
typedef struct mhe_motion {
    int32_t kind;       /* MHE_MOTION_* */
    int32_t coordinate; /* index into coordinates; -1: the motion is the constant function(0) */
    double axis[3];     /* unit vector */
    mhe_function function;
} mhe_motion;

/* A body and the joint that carries it. Its frame in the parent's: X = (joint_r, joint_p) * motions
 * in order * (body_r, body_p). */
typedef struct mhe_body {
    const char *name;
    int32_t parent; /* index of a body listed before this one; -1: ground */
    int32_t n_motions;
    const mhe_motion *motions;
    double joint_r[9], joint_p[3]; /* joint frame in the parent body */
    double body_r[9], body_p[3];   /* body frame in the moved joint frame */
    double mass;                   /* kg, >= 0 */
    double com[3];                 /* centre of mass in the body frame, m */
    double inertia[9];             /* about the centre of mass, body axes, kg m^2 */
} mhe_body;

/* A free coordinate. Locked ones never appear here: the reader turns their motions into constants.
 */
typedef struct mhe_coordinate {
    const char *name;
    int32_t rotational;  /* 1: rad, 0: m */
    double lower, upper; /* range; +-infinity where the file has none */
    double value, speed; /* the file's default position and speed */
} mhe_coordinate;

typedef struct mhe_marker {
    const char *name;
    int32_t body; /* -1: ground */
    double location[3];
} mhe_marker;

typedef struct mhe_path_point {
    int32_t body; /* -1: ground */
    double location[3];
} mhe_path_point;

/* Muscle type as the file states it; curve sets decide what they make of it. */
#define MHE_MUSCLE_UNSTATED 0
#define MHE_MUSCLE_HILL 1          /* bioMod hill */
#define MHE_MUSCLE_HILL_THELEN 2   /* bioMod hillthelen */
#define MHE_MUSCLE_HILL_DEGROOTE 3 /* bioMod hilldegroote */
#define MHE_MUSCLE_THELEN2003 4    /* osim Thelen2003Muscle */
#define MHE_MUSCLE_MILLARD2012 5   /* osim Millard2012EquilibriumMuscle */
#define MHE_MUSCLE_DEGROOTE2016 6  /* osim DeGrooteFregly2016Muscle */

/* Musculotendon parameters. NaN where the file says nothing and the muscle plugin's own default
 * holds. */
typedef struct mhe_muscle {
    const char *name;
    int32_t type;     /* MHE_MUSCLE_* */
    int32_t n_points; /* >= 2: origin, via points, insertion */
    const mhe_path_point *points;
    double max_isometric_force;      /* N */
    double optimal_fiber_length;     /* m */
    double tendon_slack_length;      /* m */
    double pennation_angle;          /* at optimal fibre length, rad */
    double max_contraction_velocity; /* optimal fibre lengths per second; NaN */
    double activation_time;          /* s; NaN */
    double deactivation_time;        /* s; NaN */
    double fiber_damping;            /* NaN */
    double passive_strain;           /* Thelen e0: strain at one norm force; NaN */
    double passive_shape;            /* Thelen k_PE; NaN */
    double active_shape;             /* Thelen gamma (KshapeActive); NaN */
    double velocity_shape;           /* Thelen A_f; NaN */
    double max_lengthening_force;    /* Thelen F_len, in F_max; NaN */
} mhe_muscle;

typedef struct mhe_description {
    uint32_t size;
    const char *name;
    const char *source; /* path of the file */
    double gravity[3];  /* m/s^2, ground frame */
    int32_t n_bodies, n_coordinates, n_markers, n_muscles;
    const mhe_body *bodies;            /* parents first */
    const mhe_coordinate *coordinates; /* their order is the order of q */
    const mhe_marker *markers;
    const mhe_muscle *muscles;
    int32_t n_unsupported; /* what the file holds and this description cannot say, one line each */
    const char *const *unsupported;
    int32_t n_warnings; /* what the reader skipped or repaired, one line each with file:line */
    const char *const *warnings;
} mhe_description;

#ifdef __cplusplus
}
#endif
#endif
