/* SPDX-License-Identifier: Apache-2.0 */
/* fade.h: strings that let go of their obstacle.
 *
 * A string stops wrapping where one of its ends enters the obstacle, and where it slips over the
 * end of a cylinder. It is longer than the straight line there, by E; so that no length jumps, this
 * excess fades first. With S a polynomial that rises from 0 to 1 with two vanishing derivatives at
 * both (its arguments are cut to 0 .. 1),
 *     an end that moves, h outside the surface:    E S(h / (k E))
 *     both contacts beyond the cylinder's end,
 *     by x and y, its radius r:                    E (1 - S(x / (m r)) S(y / (m r)))
 *     held on the side asked for, where the
 *     string of any side is shorter, by F, and
 *     the pass between both higher, by b:          E - F + F S(b / (l F))
 *     held by its side alone, by weights
 *     x, y, z (hold.c):                        E (x y + z (x + y - 2 x y))
 * so that what ends inside fades the faster the less it is; the slope does not exceed 15 / (8 k).
 * Where the way round a cylinder turns about, both excesses fade so and their mean counts (side.h).
 * An end that stays where it is on the obstacle's body never comes in, and fades nothing. The first
 * of these is done here where a path has one obstacle, else of whole courses (release.c). */
#ifndef SIMBODY_FADE_H
#define SIMBODY_FADE_H

#include "hold.h"
#include "side.h"
#include "wrap.h"

#define FADE_INSIDE 0.25 /* k */
#define FADE_OFF 0.25    /* m */
#define FADE_PASS 0.25   /* l */

/* Whether a string between p and s, in the obstacle's frame, is fading; `moves`: of either end;
 * `holds`: HOLD_*. */
int wrap_fades(const wrap_surface *surface, const double *p, const double *s, const int *moves,
               int holds, const wrap_string *string);

/* The length of one that is, with gradient g [6] and second derivatives by p and s; both NULL: not
 * wanted. */
double wrap_faded(const wrap_surface *surface, const double *p, const double *s, const int *moves,
                  int holds, const wrap_string *string, double *g, double *pp, double *ps,
                  double *ss);

/* A string's length by its ends. */
void wrap_jet(const wrap_string *string, jet *out);

/* Strings both ways round a cylinder, and how much that of growing angles counts. */
void wrap_both_ways(const wrap_surface *surface, const double *p, const double *s,
                    wrap_string *rising, wrap_string *falling, jet *share);

/* Distance of a point from the surface, < 0 inside; from an ellipsoid roughly, 0 where it is 0. */
double wrap_outside(const wrap_surface *surface, const double *x);

/* That with gradient [3] and second derivatives [9]. */
double wrap_outside_derivatives(const wrap_surface *surface, const double *x, double *g, double *h);

/* Moves a point that is inside the obstacle, or hardly outside, to beside it, along the shortest
 * way or nearly so; 1: it was. */
int wrap_clears(const wrap_surface *surface, double *x);

/* Whether anything is left of a string over a cylinder. */
int wrap_is_off(const wrap_surface *surface, const wrap_string *string);

#endif
