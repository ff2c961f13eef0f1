/* SPDX-License-Identifier: Apache-2.0 */
/* description.h: a musculoskeletal model as plain data, whatever file it came from.
 *
 * Made by the readers (.osim, .bioMod), read by model and muscle plugins. SI units and radians.
 * Rotation matrices are row-major [3 x 3] and map child coordinates to parent coordinates. All
 * memory is owned by the core and outlives every plugin instance. */
#ifndef MHE_DESCRIPTION_H
#define MHE_DESCRIPTION_H

#include <mhe/abi.h>

#include <math.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A scalar function of one variable as a row of polynomial pieces:
 *     f(t) = sum_k coef[i n_coef + k] s^k,   s = t - origin[i],   k = 0 .. n_coef - 1.
 * Piece i > 0 serves t >= origin[i] (and below the next piece's origin); piece 0 everything below
 * origin[1]. Constants, lines, polynomials of any degree, broken lines, cubic and higher splines,
 * their multiples and sums are all of this kind; a spline carries its extrapolation as first and
 * last piece. Where the value or a derivative jumps from piece to piece, that of the piece which
 * serves t holds. */
typedef struct mhe_function {
    const double *origin; /* [n_pieces], increasing from piece 1 on */
    const double *coef;   /* [n_pieces x n_coef] */
    int32_t n_pieces;     /* >= 1 */
    int32_t n_coef;       /* >= 1; a cubic has 4 */
} mhe_function;

#define MHE_MOTION_ROTATION 0    /* about `axis`, value in rad */
#define MHE_MOTION_TRANSLATION 1 /* along `axis`, value in m */

/* One elementary motion f(q[coordinate]) in the frame that the motions before it have reached. */
typedef struct mhe_motion {
    int32_t kind;       /* MHE_MOTION_* */
    int32_t coordinate; /* index, see mhe_coordinate; -1: the motion is the constant function(0) */
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

/* Coordinates are numbered: first the free ones (0 .. n_coordinates - 1, the order of q), then the
 * dependent ones (n_coordinates .. n_coordinates + n_dependents - 1). Locked and prescribed
 * coordinates never appear: the reader turns what depends on them into constants and keeps their
 * names in `constants`. */
typedef struct mhe_coordinate {
    const char *name;
    int32_t rotational;  /* 1: rad, 0: m */
    double lower, upper; /* range; +-infinity where the file has none */
    double value, speed; /* the file's default position and speed */
} mhe_coordinate;

/* A coordinate that is a function of another one (a coupler): value = function(value of
 * `independent`). `independent` may itself be dependent, but only an earlier one. Never a state. */
typedef struct mhe_dependent {
    mhe_coordinate coordinate;
    int32_t independent; /* number of a coordinate, as above */
    mhe_function function;
} mhe_dependent;

/* A coordinate that stays where it is: locked, or prescribed to a constant. */
typedef struct mhe_constant {
    const char *name;
    int32_t rotational;
    double value; /* rad (m) */
    int32_t body; /* whose joint it belongs to */
} mhe_constant;

typedef struct mhe_marker {
    const char *name;
    int32_t body; /* -1: ground */
    double location[3];
} mhe_marker;

#define MHE_POINT_FIXED 0
#define MHE_POINT_MOVING 1      /* location[i] is function[i] of coordinate[i] */
#define MHE_POINT_CONDITIONAL 2 /* part of the path only while coordinate[0] is in its range */

typedef struct mhe_path_point {
    int32_t kind;          /* MHE_POINT_* */
    int32_t body;          /* -1: ground */
    double location[3];    /* in the body frame, m; moving: of the entries without a coordinate */
    int32_t coordinate[3]; /* numbers; -1: none. Moving: of x, y, z; conditional: [0] */
    mhe_function function[3]; /* moving: m */
    double lower, upper;      /* conditional: on where lower <= coordinate <= upper; rad (m) */
} mhe_path_point;

/* What paths may wrap around. Fixed to a body; its frame (r, p) in the body's. */
#define MHE_OBSTACLE_SPHERE 0 /* size[0]: radius */
#define MHE_OBSTACLE_CYLINDER                                                                    \
    1                            /* size[0]: radius, size[1]: length along z (paths off its ends \
                                  * do not wrap); axis z */
#define MHE_OBSTACLE_ELLIPSOID 2 /* size[0..2]: half axes */
#define MHE_OBSTACLE_TORUS                                                        \
    3 /* size[0]: radius of the tube (OpenSim's inner_radius), size[1]: of the    \
       * circle in its middle (outer_radius); axis z. The path passes through the \
       * hole */
typedef struct mhe_obstacle {
    const char *name;
    int32_t kind; /* MHE_OBSTACLE_* */
    int32_t body; /* -1: ground */
    double r[9], p[3];
    double size[3];    /* m, > 0 */
    int32_t side_axis; /* constrained to one side: 0..2 for x..z of its frame; -1: any side */
    int32_t side_sign; /* +1, -1: the half space where the path must pass */
} mhe_obstacle;

#define MHE_WRAP_HYBRID                                                      \
    0 /* OpenSim's methods for ellipsoids; true geodesics make no difference \
       */
#define MHE_WRAP_MIDPOINT 1
#define MHE_WRAP_AXIAL 2

/* A path's use of an obstacle, between path points `first` and `last` (indices into its points;
 * -1: from the start, to the end). Several are passed in the order listed. */
typedef struct mhe_path_wrap {
    int32_t obstacle;
    int32_t first, last;
    int32_t method; /* MHE_WRAP_* */
} mhe_path_wrap;

/* A polynomial of several coordinates: sum_t coef[t] prod_k x_k^exponent[t n + k],
 * x_k = (value of coordinate[k] - centre[k]) / scale[k]. */
typedef struct mhe_polynomial {
    int32_t n;                    /* coordinates */
    const int32_t *coordinate;    /* [n] numbers */
    const double *centre, *scale; /* [n] */
    int32_t n_terms;
    const double *coef;      /* [n_terms] */
    const uint8_t *exponent; /* [n_terms x n] */
} mhe_polynomial;

/* A line of action. Either points (>= 2: origin, via points, insertion) with the obstacles between
 * them, or, where n_points is 0, a length given as a polynomial. */
typedef struct mhe_path {
    const char *name; /* of the muscle, ligament or spring */
    int32_t n_points, n_wraps;
    const mhe_path_point *points;
    const mhe_path_wrap *wraps;
    const mhe_polynomial *length; /* m; NULL where there are points */
    int32_t line;                 /* of the file */
} mhe_path;

/* Muscle type as the file states it; curve sets decide what they make of it. */
#define MHE_MUSCLE_UNSTATED 0
#define MHE_MUSCLE_HILL 1          /* bioMod hill */
#define MHE_MUSCLE_HILL_THELEN 2   /* bioMod hillthelen */
#define MHE_MUSCLE_HILL_DEGROOTE 3 /* bioMod hilldegroote */
#define MHE_MUSCLE_THELEN2003 4    /* osim Thelen2003Muscle */
#define MHE_MUSCLE_MILLARD2012 5   /* osim Millard2012EquilibriumMuscle */
#define MHE_MUSCLE_DEGROOTE2016 6  /* osim DeGrooteFregly2016Muscle */
#define MHE_MUSCLE_SCHUTTE1993 7   /* osim Schutte1993Muscle_Deprecated; curves below */
#define MHE_MUSCLE_RIGID 8         /* osim RigidTendonMuscle; curves below */

/* Curve parameters of Millard et al. (2013), doi:10.1115/1.4023390, under their names in OpenSim.
 * NaN: the file says nothing. */
typedef struct mhe_millard_curves {
    double min_norm_active_fiber_length, transition_norm_fiber_length, max_norm_active_fiber_length;
    double shallow_ascending_slope, minimum_value;
    double concentric_slope_at_vmax, concentric_slope_near_vmax, isometric_slope;
    double eccentric_slope_at_vmax, eccentric_slope_near_vmax;
    double max_eccentric_velocity_force_multiplier, concentric_curviness, eccentric_curviness;
    double fiber_strain_at_zero_force, fiber_strain_at_one_norm_force;
    double fiber_stiffness_at_low_force, fiber_stiffness_at_one_norm_force, fiber_curviness;
    double tendon_strain_at_one_norm_force, tendon_stiffness_at_one_norm_force;
    double tendon_norm_force_at_toe_end, tendon_curviness;
} mhe_millard_curves;

/* Musculotendon parameters; muscle i has path i. NaN where the file says nothing and the muscle
 * plugin's own default holds; flags are -1 there. */
typedef struct mhe_muscle {
    const char *name;
    int32_t type;                       /* MHE_MUSCLE_* */
    int32_t line;                       /* of the file */
    double max_isometric_force;         /* N */
    double optimal_fiber_length;        /* m */
    double tendon_slack_length;         /* m */
    double pennation_angle;             /* at optimal fibre length, rad */
    double maximum_pennation_angle;     /* rad; NaN */
    double max_contraction_velocity;    /* optimal fibre lengths per second; NaN */
    double activation_time;             /* s; NaN */
    double deactivation_time;           /* s; NaN */
    double minimum_activation;          /* NaN */
    double min_control, max_control;    /* limits of the excitation; NaN */
    double fiber_damping;               /* NaN */
    double passive_strain;              /* Thelen, De Groote e0: strain at one norm force; infinite:
                                           no passive force; NaN */
    double passive_shape;               /* Thelen k_PE; NaN */
    double active_shape;                /* Thelen gamma (KshapeActive); De Groote: how many times
                                           as wide the active curve is about 1; NaN */
    double velocity_shape;              /* Thelen A_f; NaN */
    double max_lengthening_force;       /* Thelen F_len, in F_max; NaN */
    double tendon_strain;               /* Thelen, De Groote: strain at one norm force; NaN */
    int32_t ignore_tendon_compliance;   /* 0, 1; -1 */
    int32_t ignore_activation_dynamics; /* 0, 1; -1 */
    mhe_millard_curves millard;
    /* Curves that stand in the file (Schutte 1993), in normalised units; n_pieces 0: none. */
    mhe_function active_force_length, passive_force_length, tendon_force_length, force_velocity;
} mhe_muscle;

/* A muscle of which nothing is known but its name. [any] */
static inline mhe_muscle mhe_muscle_unstated(const char *name) {
    mhe_muscle m;
    memset(&m, 0, sizeof m);
    mhe_millard_curves *c = &m.millard;
    m.max_isometric_force = m.optimal_fiber_length = m.tendon_slack_length = NAN;
    m.pennation_angle = m.maximum_pennation_angle = m.max_contraction_velocity = NAN;
    m.activation_time = m.deactivation_time = m.minimum_activation = NAN;
    m.min_control = m.max_control = m.fiber_damping = NAN;
    m.passive_strain = m.passive_shape = m.active_shape = m.velocity_shape = NAN;
    m.max_lengthening_force = m.tendon_strain = NAN;
    c->min_norm_active_fiber_length = c->transition_norm_fiber_length = NAN;
    c->max_norm_active_fiber_length = c->shallow_ascending_slope = c->minimum_value = NAN;
    c->concentric_slope_at_vmax = c->concentric_slope_near_vmax = c->isometric_slope = NAN;
    c->eccentric_slope_at_vmax = c->eccentric_slope_near_vmax = NAN;
    c->max_eccentric_velocity_force_multiplier = NAN;
    c->concentric_curviness = c->eccentric_curviness = NAN;
    c->fiber_strain_at_zero_force = c->fiber_strain_at_one_norm_force = NAN;
    c->fiber_stiffness_at_low_force = c->fiber_stiffness_at_one_norm_force = NAN;
    c->fiber_curviness = NAN;
    c->tendon_strain_at_one_norm_force = c->tendon_stiffness_at_one_norm_force = NAN;
    c->tendon_norm_force_at_toe_end = c->tendon_curviness = NAN;
    m.name = name;
    m.ignore_tendon_compliance = m.ignore_activation_dynamics = -1;
    return m;
}

/* Forces other than muscles. */

/* OpenSim's CoordinateLimitForce, converted to rad: a force towards the range beyond upper and
 * lower, smoothly switched on over `transition`. */
typedef struct mhe_coordinate_limit {
    const char *name;
    int32_t coordinate;
    double upper, lower;                     /* rad (m) */
    double upper_stiffness, lower_stiffness; /* N m/rad (N/m) */
    double damping;                          /* N m s/rad (N s/m) */
    double transition;                       /* rad (m) */
} mhe_coordinate_limit;

/* A spring along a path: tension = stiffness (l - rest) (1 + dissipation l'), never pushing. */
typedef struct mhe_path_spring {
    int32_t path;
    int32_t pushes; /* 1: a point-to-point spring, which also pushes and has no dissipation */
    double stiffness, rest, dissipation; /* N/m, m, s/m */
} mhe_path_spring;

/* tension = scale * curve(l / rest): OpenSim's Ligament with its normalised curve. */
typedef struct mhe_ligament {
    int32_t path;
    double rest, scale; /* m, N */
    mhe_function curve;
} mhe_ligament;

/* f = -stiffness (q - rest) - viscosity qdot. */
typedef struct mhe_coordinate_spring {
    const char *name;
    int32_t coordinate;
    double stiffness, rest, viscosity; /* N m/rad, rad, N m s/rad (N/m, m, N s/m) */
} mhe_coordinate_spring;

/* Six springs and dampers between a frame on each of two bodies (OpenSim's BushingForce: body-fixed
 * x-y-z angles of frame 2 in frame 1 and the offset of their origins). */
typedef struct mhe_bushing {
    const char *name;
    int32_t body[2];
    double r[2][9], p[2][3];
    double rotational_stiffness[3], translational_stiffness[3]; /* N m/rad, N/m */
    double rotational_damping[3], translational_damping[3];
} mhe_bushing;

/* A motor on a coordinate (CoordinateActuator), on bodies (TorqueActuator) or at a point
 * (PointActuator): force = optimal_force * control. */
#define MHE_ACTUATOR_COORDINATE 0
#define MHE_ACTUATOR_TORQUE 1 /* about `axis` on body[0], the opposite on body[1] */
#define MHE_ACTUATOR_POINT 2  /* along `axis` at `point` of body[0] */
typedef struct mhe_actuator {
    const char *name;
    int32_t kind;       /* MHE_ACTUATOR_* */
    int32_t coordinate; /* -1: none */
    int32_t body[2];
    double axis[3], point[3];
    int32_t axis_in_ground;          /* else in body[0] */
    double optimal_force;            /* N m (N) */
    double min_control, max_control; /* NaN: none */
} mhe_actuator;

/* Two frames that stay together: their origins (a point), or frames (a weld). To the model they are
 * free; what holds them is a force that the system finds with its accelerations. */
#define MHE_LOOP_POINT 0
#define MHE_LOOP_WELD 1
typedef struct mhe_loop {
    const char *name;
    int32_t kind; /* MHE_LOOP_* */
    int32_t body[2];
    double r[2][9], p[2][3];
    int32_t line;
} mhe_loop;

typedef struct mhe_description {
    uint32_t size;
    const char *name;
    const char *source; /* path of the file */
    double gravity[3];  /* m/s^2, ground frame */
    int32_t n_bodies, n_coordinates, n_markers, n_muscles;
    const mhe_body *bodies;            /* parents first */
    const mhe_coordinate *coordinates; /* the free ones; their order is the order of q */
    const mhe_marker *markers;
    const mhe_muscle *muscles;
    int32_t n_dependents, n_constants;
    const mhe_dependent *dependents;
    const mhe_constant *constants;
    int32_t n_paths, n_obstacles; /* n_paths >= n_muscles: the muscles' paths come first */
    const mhe_path *paths;
    const mhe_obstacle *obstacles;
    int32_t n_limits, n_path_springs, n_ligaments, n_coordinate_springs, n_bushings;
    int32_t n_actuators, n_loops;
    const mhe_coordinate_limit *limits;
    const mhe_path_spring *path_springs;
    const mhe_ligament *ligaments;
    const mhe_coordinate_spring *coordinate_springs;
    const mhe_bushing *bushings;
    const mhe_actuator *actuators;
    const mhe_loop *loops;
    int32_t n_unsupported; /* what the file holds and this description cannot say, one line each */
    const char *const *unsupported;
    int32_t n_warnings; /* what the reader skipped or repaired, one line each with file:line */
    const char *const *warnings;
    int32_t n_dropped; /* what was left out because it only matters in a forward simulation of its
                        * own (contact, controllers, probes), one line each with file:line */
    const char *const *dropped;
    const char *const *joints; /* [n_bodies] names of the joints that carry the bodies; an entry is
                                * NULL where a file gives them none; NULL: no names */
    /* Where the motion at hand keeps to, [n_coordinates] each, without a margin: what a model may
     * be good at without being so everywhere. NaN: of this coordinate it is not known; NULL: of
     * none. */
    const double *motion_lower, *motion_upper;
} mhe_description;

#ifdef __cplusplus
}
#endif
#endif
