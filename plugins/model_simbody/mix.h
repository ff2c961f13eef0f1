/* SPDX-License-Identifier: Apache-2.0 */
/* mix.h: lengths that one length goes over into: whole courses of a route, as variables of which
 * the route's length is a function. */
#ifndef SIMBODY_MIX_H
#define SIMBODY_MIX_H

#include "route.h"
#include "wrap/fade.h"

#define MIX_SAME 1e-12  /* m: lengths that differ by less are the same */
#define MIX_VARIABLES 4 /* of one level */
#define MIX_LEVELS 3    /* courses of which one goes over into another, which goes over ... */
#define MIX_NEAR 4      /* obstacles that let go at once */

/* Obstacles that a point of the path is about to enter. */
typedef struct mix_near {
    int32_t n;
    struct {
        int32_t wrap, point[2]; /* -1: that end is not near */
    } of[MIX_NEAR];
} mix_near;

/* What of the route and the pose everything here needs. */
typedef struct mix_case {
    const tree *t;
    const path_route *route;
    const path_pose *pose;
    const double *numbers;
    route_work *work;
    double *gradient, *hessian; /* of the route; NULL: not wanted */
    int32_t stride;             /* of the rows of hessian, as they are now */
    int level;                  /* whose variables are used */
} mix_case;

/* Variable k: a length whose derivatives stand in c->gradient and c->hessian. */
void mix_variable(const mix_case *c, int k, double value, jet *out);
/* Variable k: of the course that stands in work. */
void mix_course(mix_case *c, int k, jet *out);
/* The length x, of the variables, with derivatives by the own coordinates. */
double mix_result(mix_case *c, const jet *x);

/* Length of the course that OpenSim's rules give, obstacles in each other's way gone over
 * (rivals.c). Adds the obstacles that let go of what it is made of; `near` may be NULL. */
double rivals_length(mix_case *c, mix_near *near);

/* Adds the obstacles of the course that stands in work that a point is about to enter; `only`: of
 * that one alone, -1: of all. */
void near_add(const mix_case *c, int32_t only, mix_near *near);

#endif
