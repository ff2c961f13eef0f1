/* SPDX-License-Identifier: Apache-2.0 */
/* route.h: what of a path is not a straight line between points that stay where they are: moving
 * and conditional points, obstacles, lengths by a polynomial.
 *
 * A route is evaluated in two steps. Its course says which points are on and which obstacle the
 * path touches where (course.c); its pieces then give length and derivatives (strand.c). */
#ifndef SIMBODY_ROUTE_H
#define SIMBODY_ROUTE_H

#include "path.h"
#include "wrap/wrap.h"

#define POLYNOMIAL_POWERS 32 /* exponents are less */
#define POLYNOMIAL_FACTORS 8 /* coordinates that one term may depend on */

typedef struct route_point {
    const mhe_path_point *source;
    const tree_place *place; /* of the point's body */
    double at[3];            /* in the link's frame; of a moving one, without what moves */
    int32_t local[3];        /* of a moving one: place of each function's root in `own`; -1 */
} route_point;

typedef struct route_wrap {
    wrap_surface surface;
    int32_t link, first, last; /* points */
    double r[9], p[3];         /* frame in the link */
} route_wrap;

typedef struct path_route {
    int32_t path, n_points, n_wraps, n_own;
    const mhe_polynomial *length;   /* instead of points */
    const struct path_route *exact; /* of a fitted one (whose x^e are Chebyshev's T_e(x)): the path
                                     * itself; NULL */
    int32_t *length_local;          /* [length->n] places in own */
    int32_t degree;                 /* largest exponent */
    route_point *points;
    uint8_t *plain; /* [n_points]: 1 where the piece from this point to the next is a segment of the
                     * tree (and counted there) */
    route_wrap *wraps;
    int32_t *own;   /* [n_own]: free coordinates that the length depends on */
    int32_t *local; /* [n_q]: place in own; -1 */
} path_route;

/* One step of the way from an obstacle (or link) out to a point: how the point moves with a
 * coordinate, as seen from there, in ground axes. */
typedef struct strand_step {
    int32_t local;    /* of the coordinate */
    double change[3]; /* first derivative */
    double curve[3];  /* by f'' of the step's function */
    double turn[3];   /* slope times axis of a pin: turns the steps beyond; 0 of a slider */
} strand_step;

/* A stop of the course: a point that is on, or an end of a string on an obstacle. */
typedef struct course_stop {
    int32_t point, wrap; /* -1: not one */
    int32_t link;
    double at[3];
} course_stop;

/* Where the string passes between two obstacles: a point that is free across the string. */
typedef struct course_joint {
    int32_t link;
    double at[3], across[2][3];
} course_joint;

/* A straight piece between two points, or a string over an obstacle, which ends at points or
 * joints.
 */
typedef struct course_piece {
    int32_t wrap;     /* -1: straight; so it is also where work->state[wrap] <= 0 */
    int32_t point[2]; /* of the ends */
    int32_t joint[2]; /* instead of points; -1: none */
} course_piece;

/* Chebyshev's polynomials of a coordinate with two derivatives, as far as they are made. */
typedef struct shared_factors {
    int32_t degree;
    double centre, scale, row[3 * POLYNOMIAL_POWERS];
} shared_factors;

/* Scratch of one thread, large enough for every route of the model. */
typedef struct route_work {
    void *memory;
    int64_t left;       /* evaluations of fitted paths out of their range */
    double *places;     /* [n_points x 3] in ground */
    double *slopes;     /* [n_points x 3 x 4] of moving points */
    course_stop *stops; /* [n_points + 2 n_wraps] */
    int32_t n_stops;
    double *obstacles;    /* [n_wraps x 12]: rotation and origin in ground */
    wrap_string *strings; /* [n_wraps], in ground */
    int32_t *state;       /* [n_wraps] of wrap_solve() */
    double *tried;        /* [n_wraps x 6]: the ends that these are of */
    double *hopeless;     /* [n_wraps x 6]: ends between which none was found, NaN: none yet */
    int32_t *order;       /* [n_wraps]: those that may be on, in the order tried */
    int32_t n_order;
    uint8_t *without;         /* [n_wraps]: 1: that one is left out */
    uint8_t *out;             /* [n_wraps]: 1: of all courses; see release.c */
    uint8_t *whole;           /* [n_wraps]: 1: it does not let go of a point; see release.c */
    int32_t afresh;           /* 1: strings are looked for without a guess */
    int32_t deepest;          /* 1: single strings let go of points, as where there is one */
    int32_t *blocker;         /* [n_wraps]: whose string ends inside the obstacle; -1: none */
    int32_t lost;             /* the last wrap that held no string in a row; -1: none */
    int32_t pushes, pushed;   /* see wrap_try(): whether it may, whether it did */
    course_joint *joints;     /* [n_wraps] */
    course_joint *row_joints; /* [2 n_wraps]: kept while rows are tightened, as the next two */
    wrap_string *row_strings;
    int32_t *row_states;
    course_piece *pieces; /* [n_points + 2 n_wraps] */
    int32_t n_joints, n_pieces;
    double *newton; /* [(2 n_wraps) x (2 n_wraps + 1)] */
    strand_step *steps[2];
    double *gradient, *hessian; /* of a route, with the joints' freedoms */
    double *kept;               /* [12 x (n_own + n_own^2)]: of courses; see mix.h */
    double *polynomial;         /* scratch */
    const double **factors;     /* [n_factors] */
    shared_factors *shared;     /* [n_numbers] */
} route_work;

typedef struct route_set {
    /* routes; most of each in one of them */
    int32_t n, n_points, n_wraps, n_own, n_steps, n_factors;
    int32_t n_numbers; /* coordinates up to the last one that a polynomial has */
    path_route *routes;
} route_set;

/* The routes of a description whose tree is made. With `fitted` (paths in the same order) they are
 * those of the paths that are a polynomial there and not here, with all their pieces. MHE_E_MEMORY.
 * [cold] */
mhe_status routes_create(const mhe_description *description, const tree *tree,
                         const mhe_path *fitted, route_set **out, mhe_error *err);
/* Tells the polynomials among `routes` which of `whole` they were fitted to. */
void routes_join(route_set *routes, const route_set *whole);
void routes_free(route_set *routes);
/* Whether the piece between points k and k + 1 of a path is straight and between fixed points. */
int route_is_plain(const mhe_path *path, int32_t k);

/* Marks what the routes depend on in pattern [n_p x n_q]. */
void routes_pattern(const route_set *routes, int32_t n_q, uint8_t *pattern);

/* `other` may be NULL. */
mhe_status route_work_create(const route_set *routes, const route_set *other, route_work *out);
void route_work_free(route_work *work);

/* Adds the routes to what path_lengths() wrote; NULL: not wanted. `numbers`: as
 * numbers_evaluate(). */
void routes_lengths(const tree *tree, const route_set *routes, const path_pose *pose,
                    const double *numbers, route_work *work, double *length, double *length_q,
                    double *length_qq);

/* Points of a path as it runs, for mhe_model_ops.path_points(). */
int32_t route_points(const path_route *route, const path_pose *pose, const double *numbers,
                     route_work *work, double *points, int32_t n);

/* ---- between the files of this part ---- */

/* Places the obstacles and the points and finds the course: work->stops, strings, joints. */
void course_find(const path_route *route, const path_pose *pose, const double *numbers,
                 route_work *work);
/* Again, without those of work->without. */
void course_without(const path_route *route, const path_pose *pose, const double *numbers,
                    route_work *work);

/* The obstacles in ground. */
void course_obstacles(const path_route *route, const path_pose *pose, route_work *work);

/* The course of the points that are on and of the wraps of work->order, not tightened. */
void course_lay(const path_route *route, const path_pose *pose, const double *numbers,
                route_work *work);

/* Takes wrap w off the course, and lays the others from where they are. */
void course_drop(const path_route *route, int32_t w, route_work *work);

/* Whether wrap w, that is not on the course, would be if it were tried (which leaves the course
 * of no use). */
int course_touches(const path_route *route, int32_t w, route_work *work);

/* Length of a route that is no polynomial, with gradient and hessian (NULL: not wanted; rows of
 * *stride) by the own coordinates. */
double route_length(const tree *tree, const path_route *route, const path_pose *pose,
                    const double *numbers, route_work *work, int32_t *stride, double *gradient,
                    double *hessian);

/* Ends of a piece in ground. */
void piece_ends(const route_work *work, const course_piece *piece, const double *ends[2]);

/* Length of a piece between its ends, with gradient [6] and second derivatives by them, all in
 * ground; NULL: not wanted. */
double piece_length(const path_route *route, const route_work *work, const course_piece *piece,
                    const double *const ends[2], double *g, double *pp, double *ps, double *ss);

/* The string of wrap w between two points of ground, in ground; `before`: as it was in a step
 * before of the same pose, or NULL. WRAP_*. */
int string_between(const path_route *route, int32_t w, const double *p, const double *s,
                   const wrap_string *before, const route_work *work, wrap_string *out);

/* A joint between the strings that end at this stop and begin at the next. */
void joint_begin(const route_work *work, int32_t stop, course_joint *joint);

/* Distance of a point of ground from the obstacle of wrap w, as wrap_outside(). */
double string_off(const path_route *route, int32_t w, const route_work *work, const double *at);

/* That with gradient [3] and second derivatives [9] by the point, in ground. */
double string_off_derivatives(const path_route *route, int32_t w, const route_work *work,
                              const double *at, double *g, double *h);

/* Moves a point of ground that is inside the obstacle of wrap w to beside it; 1: it did. */
int string_clears(const path_route *route, int32_t w, const route_work *work, double *at);

/* Moves the joints until the strings are tight. A wrap for which there is no string, or -1. */
int32_t joints_tighten(const path_route *route, route_work *work);

/* Length of the course found, with gradient and hessian (NULL: not wanted; rows of *stride) by the
 * own coordinates. */
double strand_length(const tree *tree, const path_route *route, const path_pose *pose,
                     route_work *work, int32_t *stride, double *gradient, double *hessian);

/* How far a point is outside the obstacle of wrap w, as wrap_outside(), with gradient [n_own] and
 * second derivatives (NULL: not wanted) by the own coordinates. */
double strand_outside(const tree *tree, const path_route *route, const path_pose *pose,
                      route_work *work, int32_t w, int32_t point, double *gradient,
                      double *hessian);

/* Whether a coordinate is out of centre +- scale. */
int polynomial_is_left(const path_route *route, const double *numbers);

/* Length, gradient [n_own] and hessian [n_own x n_own] (both NULL: not wanted). */
double polynomial_length(const path_route *route, const double *numbers, route_work *work,
                         double *gradient, double *hessian);

#endif
