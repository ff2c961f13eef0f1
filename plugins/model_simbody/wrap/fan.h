/* SPDX-License-Identifier: Apache-2.0 */
/* fan.h: strings over an ellipsoid that stay in planes through both ends.
 *
 * Divided by the half axes, the ellipsoid is the unit sphere; straight lines, planes and tangency
 * stay what they are. There all planes through both ends make circles, whose tight strings are
 * known. A fan of them is taken, with their true lengths. */
#ifndef SIMBODY_FAN_H
#define SIMBODY_FAN_H

#include "wrap.h"

#define FAN 12 /* planes, as half planes about the straight line */

typedef struct fan {
    double size[3];
    double p[3], s[3];         /* scaled ends */
    double u[3], e[2][3];      /* along the line; towards it from the centre, and across both */
    double off, before, after; /* distance of the line; of the ends from its nearest point */
    double length;
} fan;

/* The tight string over the circle of one half plane, towards cos(angle) e0 + sin(angle) e1. */
typedef struct fan_string {
    double length, arc;
    double a[3]; /* scaled */
    double apex; /* of its middle, along the axis asked for */
} fan_string;

/* Two unit vectors across u and each other. */
void frame_across(const double *u, double *e0, double *e1);

/* WRAP_*: whether the straight line crosses the ellipsoid. */
int fan_of(const wrap_surface *surface, const double *p, const double *s, fan *f);

/* `half_plane`: cosine and sine of its angle. `axis`: whose apex is asked for; -1: of none. */
void fan_string_at(const fan *f, const double *half_plane, int axis, fan_string *out);

/* All of them [FAN]; the number of the shortest. */
void fan_spread(const fan *f, int axis, fan_string *strings);
int fan_lowest(const fan_string *strings);

/* The angle of the shortest, or longest, of the fan's strings near the k-th, by a parabola. */
double fan_angle(const fan_string *strings, int k);

#endif
