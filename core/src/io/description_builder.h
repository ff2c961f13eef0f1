/* SPDX-License-Identifier: Apache-2.0 */
/* description_builder.h: what a model file says, collected under names, then checked, ordered and
 * turned into a description. Shared by the model readers.
 *
 * Errors are sticky: the first one is kept in `status` and the caller's mhe_error, later ones are
 * dropped, so that a reader need only look at `status` where it decides whether to go on. */
#ifndef MHI_DESCRIPTION_BUILDER_H
#define MHI_DESCRIPTION_BUILDER_H

#include "base/arena.h"
#include "base/kinds.h"

#include <mhe/description.h>

/* What mhi_build_finish hands over. */
typedef struct mhi_owned_description {
    mhe_description description; /* first: its address is the address of the whole */
    mhi_arena arena;
} mhi_owned_description;

/* Pointers to things that live in the builder's arena; {0} is empty. */
typedef struct mhi_list {
    void **items;
    int32_t n, capacity;
} mhi_list;

/* Numbers of coordinates in drafts count all coordinates in file order, locked and dependent ones
 * too; bodies are named as in the file, NULL or "ground": ground. */

/* A place on a body: of a marker, or a point of a path (mhe_path_point without its body). */
typedef struct mhi_point_draft {
    const char *body;
    mhe_path_point point;
    int32_t line;
} mhi_point_draft;

typedef struct mhi_body_draft {
    mhe_body body; /* parent and motions are filled in by the builder */
    const char *parent;
    const char *joint; /* name of the joint that carries it; NULL */
    mhi_list motions;  /* mhe_motion */
    int32_t line;
    int32_t carried; /* for the reader: the joint has been seen */
} mhi_body_draft;

typedef struct mhi_coordinate_draft {
    mhe_coordinate coordinate;
    const char *joint, *in_joint; /* for the reader: its joint, and its name there */
    int32_t locked;               /* stays at its default value */
    int32_t moves_nothing;        /* for the builder: no body, and no other coordinate */
    int32_t line;
} mhi_coordinate_draft;

/* value of `dependent` = function(value of `independent`) */
typedef struct mhi_coupler_draft {
    const char *name;
    int32_t dependent, independent;
    mhe_function function;
    int32_t line;
} mhi_coupler_draft;

typedef struct mhi_marker_draft {
    const char *name;
    mhi_point_draft point;
} mhi_marker_draft;

typedef struct mhi_obstacle_draft {
    mhe_obstacle obstacle;
    const char *body;
    int32_t line;
    int32_t active;      /* 0: paths pass through it */
    int32_t used;        /* by a path that is there */
    const char *unknown; /* its type, where it is none of ours; NULL */
} mhi_obstacle_draft;

typedef struct mhi_wrap_draft {
    const char *obstacle;
    mhe_path_wrap wrap; /* its obstacle is filled in by the builder */
    int32_t line;
} mhi_wrap_draft;

typedef struct mhi_path_draft {
    const char *what;       /* "muscle", "ligament", "spring": for messages */
    mhi_list points;        /* mhi_point_draft, in path order */
    mhi_list wraps;         /* mhi_wrap_draft */
    mhe_polynomial *length; /* instead of points */
    const char *name;
    int32_t line;
} mhi_path_draft;

typedef struct mhi_muscle_draft {
    mhe_muscle muscle;
    mhi_path_draft path;
    int32_t line;
} mhi_muscle_draft;

/* Forces: their paths come after the muscles', in the order of springs, then ligaments. */
typedef struct mhi_path_spring_draft {
    mhe_path_spring spring;
    mhi_path_draft path;
} mhi_path_spring_draft;

typedef struct mhi_ligament_draft {
    mhe_ligament ligament;
    mhi_path_draft path;
} mhi_ligament_draft;

typedef struct mhi_bushing_draft {
    mhe_bushing bushing;
    const char *body[2];
    int32_t line;
} mhi_bushing_draft;

typedef struct mhi_actuator_draft {
    mhe_actuator actuator;
    const char *body[2];
    int32_t line;
} mhi_actuator_draft;

typedef struct mhi_loop_draft {
    mhe_loop loop;
    const char *body[2];
} mhi_loop_draft;

typedef struct mhi_builder {
    mhi_arena arena;
    const char *source; /* name of the file, for messages */
    const char *name;   /* of the model; NULL: the file's base name */
    double gravity[3];
    mhi_list bodies, coordinates, couplers, markers, muscles; /* the drafts above, in file order */
    mhi_list obstacles, path_springs, ligaments, bushings, actuators, loops;
    mhi_list limits, coordinate_springs;     /* of the description; coordinates of drafts */
    mhi_list unsupported, warnings, dropped; /* char */
    mhi_kinds kinds;                         /* of the warnings */
    int32_t unlocked;                        /* locked coordinates are to stay free */
    mhe_status status;
    mhe_error *err;
} mhi_builder;

void mhi_build_start(mhi_builder *b, const char *source, mhe_error *err);
/* Checks names, numbers and the tree, then hands over the description; on failure everything is
 * freed. `b` is empty afterwards. */
mhe_status mhi_build_finish(mhi_builder *b, mhe_description **description);
/* Gives everything back without a description and returns the status. */
mhe_status mhi_build_abandon(mhi_builder *b);

/* Each writes "file:line: ..."; line 0 leaves the line out. */
MHE_PRINTF(3, 4) void mhi_build_fail(mhi_builder *b, int32_t line, const char *format, ...);
MHE_PRINTF(3, 4) void mhi_build_warn(mhi_builder *b, int32_t line, const char *format, ...);
MHE_PRINTF(3, 4) void mhi_build_unsupported(mhi_builder *b, int32_t line, const char *format, ...);
MHE_PRINTF(3, 4) void mhi_build_dropped(mhi_builder *b, int32_t line, const char *format, ...);

/* Part of mhi_build_finish: the number of warnings that were only counted. */
void mhi_build_count_kinds(mhi_builder *b);

/* Appends to a list zeroed memory of `bytes`; NULL, with the status set, when memory is out. */
void *mhi_build_push(mhi_builder *b, mhi_list *list, size_t bytes);
/* New drafts with neutral values (identity transforms, unbounded range, NaN muscle parameters).
 * Names are kept, not copied. NULL when memory is out. */
mhi_body_draft *mhi_build_body(mhi_builder *b, const char *name, const char *parent, int32_t line);
mhi_coordinate_draft *mhi_build_coordinate(mhi_builder *b, const char *name, int32_t line);
void mhi_build_marker(mhi_builder *b, const char *name, const char *body, const double location[3],
                      int32_t line);
mhi_muscle_draft *mhi_build_muscle(mhi_builder *b, const char *name, int32_t line);
void mhi_build_point(mhi_builder *b, mhi_muscle_draft *muscle, const char *body,
                     const double location[3], int32_t line);
/* `coordinate` -1: the constant function(0). A motion that is always 0 is left out. */
void mhi_build_motion(mhi_builder *b, mhi_body_draft *body, int32_t kind, int32_t coordinate,
                      const double axis[3], mhe_function function, int32_t line);

/* Parts of mhi_build_finish. */

/* description_check.c: what no mechanics could use is refused. */
void mhi_build_check(mhi_builder *b);
/* Warns where the `range` of `whose` can only be degrees: angles are in rad. */
void mhi_build_warn_degrees(mhi_builder *b, int32_t line, const char *whose,
                            const mhe_coordinate *coordinate, const double range[2]);
/* Of it, the names of bodies: a reader whose joints name bodies asks before it reads them. */
void mhi_build_check_bodies(mhi_builder *b);
/* Index of the draft of the body `name`, -1: ground; -2 after an error that says `what` `whose`
 * wanted it. */
int32_t mhi_build_find_body(mhi_builder *b, const char *name, int32_t line, const char *what,
                            const char *whose);

/* description_coordinates.c: the coordinates of the description: free ones, locked ones among them,
 * then dependents behind what they depend on; number [drafts] gets their place there, -1: a
 * coordinate that moves nothing. */
void mhi_build_coordinates(mhi_builder *b, mhe_description *d, int32_t *number);

/* Where drafts have gone: bodies, coordinates; mirrored [of the description's bodies]. */
typedef struct mhi_places {
    int32_t *body, *mirrored, *coordinate;
} mhi_places;

/* description_path.c, description_force.c: everything that is fixed to bodies. */
void mhi_build_markers(mhi_builder *b, mhe_description *d, const mhi_places *places);
void mhi_build_paths(mhi_builder *b, mhe_description *d, const mhi_places *places);
void mhi_build_forces(mhi_builder *b, mhe_description *d, const mhi_places *places);
/* Place of a body by its name; `what` and `whose` for the message. */
int32_t mhi_build_place(mhi_builder *b, const mhi_places *places, const char *body, int32_t line,
                        const char *what, const char *whose);
/* n times `bytes` of zeroed memory; NULL with the status set when memory is out. */
void *mhi_build_take(mhi_builder *b, int32_t n, size_t bytes);

/* description_frames.c. Refuses a frame that is no rotation, within the
 * rounding of model files. */
void mhi_build_check_rotation(mhi_builder *b, const mhi_body_draft *draft, const double r[9]);
/* Turns the left-handed frames that some converters write (a pair of them cancels) into
 * right-handed ones by flipping z of bodies and of what they carry, so that every point is where
 * the file has it; mirrored [n] says which, for points on them. line [n]: of the file. */
void mhi_build_right_handed(mhi_builder *b, mhe_body *bodies, int32_t n, const int32_t *line,
                            int32_t *mirrored);

/* 1 where the two names are the same without regard to letter case. */
int32_t mhi_same_word(const char *a, const char *b);

/* Rigid transforms, rotation row-major [3 x 3]. */
typedef struct mhi_transform {
    double r[9], p[3];
} mhi_transform;

mhi_transform mhi_transform_identity(void);
mhi_transform mhi_transform_times(const mhi_transform *a, const mhi_transform *b);
mhi_transform mhi_transform_inverse(const mhi_transform *a);
void mhi_transform_point(const mhi_transform *a, const double point[3], double out[3]);
/* Turns about the body-fixed axes sequence[0..2] ('x' 'y' 'z') by angles[0..2], in this order. */
void mhi_rotation_sequence(const char *sequence, const double angles[3], double r[9]);

/* Functions; memory from the builder. Splines and broken lines need n >= 2 points with increasing
 * x: the reader checks. */
mhe_function mhi_function_polynomial(mhi_builder *b, const double *coef,
                                     int32_t n); /* c0 + c1 t + ... */
mhe_function mhi_function_constant(mhi_builder *b, double value);
mhe_function mhi_function_identity(mhi_builder *b);
mhe_function mhi_function_broken_line(mhi_builder *b, const double *x, const double *y, int32_t n);
/* The cubic spline of SIMM and OpenSim (SimmSpline): third derivatives at the ends are those of the
 * cubics through the four outermost points (Forsythe, Malcolm & Moler, Computer Methods for
 * Mathematical Computations, 1977, ch. 4); linear beyond the ends. */
mhe_function mhi_function_spline(mhi_builder *b, const double *x, const double *y, int32_t n);
/* y0 up to t0, y1 from t1 on, between them a quintic with level ends. */
mhe_function mhi_function_step(mhi_builder *b, double t0, double t1, double y0, double y1);
mhe_function mhi_function_scaled(mhi_builder *b, double scale, mhe_function function);
/* The natural spline of degree 2 half_order - 1 through n >= 2 half_order points: its derivatives
 * half_order .. 2 half_order - 2 are 0 at both ends; beyond them it goes on as a polynomial of
 * degree half_order - 1 (Woltring, Adv. Eng. Software 8, 1986, with no smoothing). half_order
 * 1 .. 4. */
mhe_function mhi_function_natural_spline(mhi_builder *b, const double *x, const double *y,
                                         int32_t n, int32_t half_order);
double mhi_function_value(const mhe_function *function, double t);
/* out [3] = f(t), f'(t), f''(t) */
void mhi_function_derivatives(const mhe_function *function, double t, double out[3]);
/* 1 where f is the same everywhere. */
int32_t mhi_function_is_constant(const mhe_function *function);

#endif
