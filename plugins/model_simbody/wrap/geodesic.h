/* SPDX-License-Identifier: Apache-2.0 */
/* geodesic.h: geodesics on surfaces without a closed form, and strings that they are a part of. */
#ifndef SIMBODY_GEODESIC_H
#define SIMBODY_GEODESIC_H

#include "wrap.h"

/* Local shape at a point on (or, by rounding, near) the surface. */
typedef struct surface_shape {
    double normal[3];
    double gauss;                   /* Gauss curvature */
    double bend, twist, cross_bend; /* II(t, t), II(t, b), II(b, b); > 0: the surface falls away */
} surface_shape;

/* t: a tangent direction. With `b` NULL the last two are not set. */
void surface_shape_at(const wrap_surface *surface, const double *x, const double *t,
                      const double *b, surface_shape *out);

/* x, t, then the Jacobi fields as in wrap_string */
typedef struct geodesic_state {
    double y[10];
} geodesic_state;

/* Follows the geodesic by `length`, from x on the surface along the unit tangent t; `accuracy`: of
 * a step, relative to the surface's size. */
void geodesic_follow(const wrap_surface *surface, const double *x, const double *t, double length,
                     double accuracy, geodesic_state *end);

/* A string from p that comes onto the surface at contact(turn): the points where lines from p are
 * tangent are a curve. */
typedef struct string_start {
    void (*contact)(const void *data, double turn, double *a, double *a_turn);
    const void *data;
    double turn, arc; /* where to begin */
    int near;         /* that is known to be close */
    int passes;       /* a string is wanted that is shortest along itself and longest across: over
                       * a pass between two that are tight */
} string_start;

/* Newton for (turn, arc) such that the string hits s. 0: solved; then *turn is the solution's. */
int string_shoot(const wrap_surface *surface, const double *p, const double *s,
                 const string_start *start, double *turn, wrap_string *out);

#endif
