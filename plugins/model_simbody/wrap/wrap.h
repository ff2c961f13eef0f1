/* SPDX-License-Identifier: Apache-2.0 */
/* wrap.h: a string between two points, pulled tight over one obstacle.
 *
 * Everything is in the obstacle's frame. The string runs straight from p to a, over the surface on
 * a geodesic from a to b, straight from b to s, and is tangent to the surface at a and b. Where it
 * is so, its length L(p, s) has the derivatives (t: direction of the string, n: outward normal,
 * b: t x n, each at the end named)
 *     L_p = -t1,    L_s = t2,
 *     L_pp = n1 n1^T / d1 + C/S b1 b1^T,  L_ss = n2 n2^T / d2 + S'/S b2 b2^T,  L_ps = -b1 b2^T / S:
 * a shift of p along n1 only unrolls the string in its own plane; one along b1 goes on along the
 * string as a Jacobi field j'' = -K j (K: Gauss curvature, 0 on the straight parts), S and C its
 * solutions over the whole string with (j, j') = (0, 1) and (1, 0) at p. Natural variations of a
 * geodesic as in Scholz, Sherman, Stavness, Delp & Kecskemethy (2016),
 * doi:10.1007/s11044-015-9451-1. */
#ifndef SIMBODY_WRAP_H
#define SIMBODY_WRAP_H

#include <mhe/description.h>

typedef struct wrap_surface {
    int32_t kind;                 /* MHE_OBSTACLE_* */
    int32_t side_axis, side_sign; /* as in mhe_obstacle */
    double size[3];
} wrap_surface;

typedef struct wrap_string {
    double a[3], b[3];       /* where it comes onto the surface, where it leaves */
    double t[2][3], n[2][3]; /* direction and outward normal at a and b */
    double straight[2];      /* d1, d2 */
    double arc;              /* length on the surface */
    double field[4];         /* j, j' at b of (1, 0) at a; of (0, 1) at a */
    int32_t held;            /* WRAP_HELD: a shorter one may lie on the other side than asked for */
    int32_t way;             /* round a cylinder: 1: of growing angles, -1: of falling ones */
    int32_t keeps;           /* of a guess: 1: the string goes that way */
    double other;            /* how much the other way round a cylinder counts, 0 .. 0.5 */
} wrap_string;

#define WRAP_HELD 1
#define WRAP_HELD_WHOLE 2 /* by however low a pass */
#define WRAP_HELD_NOT 3   /* by no pass: the shortest string counts instead */

#define WRAP_INSIDE (-1)   /* an end is inside: no wrap */
#define WRAP_NONE 0        /* the straight line is free */
#define WRAP_POSSIBLE 1    /* wraps though the straight line does not cross the obstacle */
#define WRAP_CROSSED 2     /* wraps, since the straight line crosses it */
#define WRAP_UNSOLVED (-2) /* no geodesic was found: no wrap */

/* The string from p to s, if it wraps (> 0). `guess`: a string between ends nearby, which is where
 * it is looked for; NULL: none is known. Depends on its arguments alone. [any] */
int wrap_solve(const wrap_surface *surface, const double *p, const double *s,
               const wrap_string *guess, wrap_string *out);

/* Of a string over an ellipsoid that is held on the side asked for: the shortest string of any side
 * and the one over the pass between both. 0: it is not held, or by no pass that is found. */
int wrap_slips(const wrap_surface *surface, const double *p, const double *s,
               const wrap_string *held, wrap_string *shortest, wrap_string *pass);

double wrap_length(const wrap_string *string);

/* Second derivatives pp, ps, ss [3 x 3 each]; row of ps: p. */
void wrap_curvature(const wrap_string *string, double *pp, double *ps, double *ss);

/* Of the kinds; as wrap_solve(). */
int wrap_sphere(const wrap_surface *surface, const double *p, const double *s, wrap_string *out);
int wrap_cylinder(const wrap_surface *surface, const double *p, const double *s,
                  const wrap_string *guess, wrap_string *out);
int wrap_ellipsoid(const wrap_surface *surface, const double *p, const double *s,
                   const wrap_string *guess, wrap_string *out);
int wrap_torus(const wrap_surface *surface, const double *p, const double *s,
               const wrap_string *guess, wrap_string *out);

#endif
