/* SPDX-License-Identifier: Apache-2.0 */
/* wrap.c: derivatives of a string over an obstacle; spheres and cylinders in closed form. */
#include "wrap.h"

#include "../vector.h"
#include "fade.h"

#include <math.h>
#include <string.h>

#define FULL_TURN 6.283185307179586
#define TOUCHING 1e-9 /* turns: rounding where the string just touches is not a turn */

int wrap_solve(const wrap_surface *surface, const double *p, const double *s,
               const wrap_string *guess, wrap_string *out) {
    out->held = 0;
    out->other = 0;
    switch (surface->kind) {
    case MHE_OBSTACLE_SPHERE:
        return wrap_sphere(surface, p, s, out);
    case MHE_OBSTACLE_CYLINDER:
        return wrap_cylinder(surface, p, s, guess, out);
    case MHE_OBSTACLE_ELLIPSOID:
        return wrap_ellipsoid(surface, p, s, guess, out);
    default:
        return wrap_torus(surface, p, s, guess, out);
    }
}

double wrap_length(const wrap_string *string) {
    return string->straight[0] + string->arc + string->straight[1];
}

void wrap_curvature(const wrap_string *w, double *pp, double *ps, double *ss) {
    double d1 = w->straight[0], d2 = w->straight[1], across[2][3];
    const double *f = w->field;
    double c = f[0] + d2 * f[1];    /* C */
    double j = d1 * f[0] + f[2];    /* of (0, 1) at p: at b */
    double rate = d1 * f[1] + f[3]; /* S' */
    double s = j + d2 * rate;       /* S */
    for (int k = 0; k < 2; k++) {
        cross3(w->t[k], w->n[k], across[k]);
    }
    memset(pp, 0, 9 * sizeof *pp);
    memset(ps, 0, 9 * sizeof *ps);
    memset(ss, 0, 9 * sizeof *ss);
    add_outer3(pp, 1 / d1, w->n[0], w->n[0]);
    add_outer3(pp, c / s, across[0], across[0]);
    add_outer3(ps, -1 / s, across[0], across[1]);
    add_outer3(ss, 1 / d2, w->n[1], w->n[1]);
    add_outer3(ss, rate / s, across[1], across[1]);
}

/* Ends at the angles `from`, `to` and radii in a plane, seen from the centre of a circle; the
 * string leaves the first along the tangent on the side of growing angles (sense 1) or falling
 * ones (-1). */
typedef struct circle_string {
    double start, turn; /* angle where it comes onto the circle; angle on it, >= 0 */
    double straight[2];
} circle_string;

static void circle_tangents(double radius, const double *distance, const double *angle,
                            double sense, circle_string *out) {
    double open[2];
    for (int k = 0; k < 2; k++) {
        out->straight[k] = sqrt((distance[k] - radius) * (distance[k] + radius));
        open[k] = atan2(out->straight[k], radius);
    }
    out->start = angle[0] + sense * open[0];
    double turn = sense * (angle[1] - angle[0]) - open[0] - open[1];
    out->turn = turn - FULL_TURN * floor(turn / FULL_TURN + TOUCHING);
}

static int sign_of(double x) {
    return x < 0 ? -1 : 1;
}

/* ---- sphere ---- */

/* The string lies in the plane of the centre and both ends. */
static void sphere_string(double radius, const double *distance, const double *const axes[2],
                          double between, double sense, wrap_string *out) {
    double angle[2] = {0, between};
    circle_string ring;
    circle_tangents(radius, distance, angle, sense, &ring);
    double at[2] = {ring.start, ring.start + sense * ring.turn};
    double *points[2] = {out->a, out->b};
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < 3; i++) {
            out->n[k][i] = cos(at[k]) * axes[0][i] + sin(at[k]) * axes[1][i];
            out->t[k][i] = sense * (cos(at[k]) * axes[1][i] - sin(at[k]) * axes[0][i]);
            points[k][i] = radius * out->n[k][i];
        }
        out->straight[k] = ring.straight[k];
    }
    out->arc = radius * ring.turn;
    out->field[0] = out->field[3] = cos(ring.turn);
    out->field[1] = -sin(ring.turn) / radius;
    out->field[2] = radius * sin(ring.turn);
}

/* Any direction across u, the same for the same u. */
static void any_across(const double *u, double *out) {
    double least[3] = {0, 0, 0};
    int k = fabs(u[0]) <= fabs(u[1]) ? (fabs(u[0]) <= fabs(u[2]) ? 0 : 2)
                                     : (fabs(u[1]) <= fabs(u[2]) ? 1 : 2);
    least[k] = 1;
    cross3(u, least, out);
    double norm = sqrt(dot3(out, out));
    for (int i = 0; i < 3; i++) {
        out[i] /= norm;
    }
}

int wrap_sphere(const wrap_surface *surface, const double *p, const double *s, wrap_string *out) {
    double radius = surface->size[0], d[3], axes[2][3], normal[3];
    double distance[2] = {sqrt(dot3(p, p)), sqrt(dot3(s, s))};
    if (distance[0] <= radius || distance[1] <= radius) {
        return WRAP_INSIDE;
    }
    for (int i = 0; i < 3; i++) {
        d[i] = s[i] - p[i];
        axes[0][i] = p[i] / distance[0];
    }
    cross3(p, s, normal);
    double twice = sqrt(dot3(normal, normal)), length = sqrt(dot3(d, d));
    if (dot3(p, d) >= 0 || dot3(s, d) <= 0 || twice >= radius * length) {
        return WRAP_NONE;
    }
    if (twice > 1e-14 * distance[0] * distance[1]) {
        for (int i = 0; i < 3; i++) {
            normal[i] /= twice;
        }
        cross3(normal, axes[0], axes[1]);
    } else {
        any_across(axes[0], axes[1]);
    }
    const double *frame[2] = {axes[0], axes[1]};
    double between = atan2(twice, dot3(p, s));
    sphere_string(radius, distance, frame, between, 1, out);
    int axis = surface->side_axis;
    if (axis < 0) {
        return WRAP_CROSSED;
    }
    int p_there = sign_of(p[axis]) == surface->side_sign,
        s_there = sign_of(s[axis]) == surface->side_sign;
    if (!p_there || !s_there) { /* the legs of the string have to point to that side */
        double legs = out->a[axis] - p[axis] + out->b[axis] - s[axis];
        if (legs * surface->side_sign < 0) {
            sphere_string(radius, distance, frame, between, -1, out);
        }
    }
    return p_there || s_there ? WRAP_CROSSED : WRAP_POSSIBLE;
}

/* ---- cylinder ---- */

/* WRAP_*: whether the path between p and s touches a cylinder without end. `cross` and `along`:
 * of the plane. */
static int cylinder_needs(const wrap_surface *surface, const double *p, const double *s) {
    double radius = surface->size[0], dx = s[0] - p[0], dy = s[1] - p[1];
    double square = dx * dx + dy * dy, cross = p[0] * s[1] - p[1] * s[0];
    double at = square > 0 ? -(p[0] * dx + p[1] * dy) / square : 0; /* nearest to the axis */
    int crossed = cross * cross < radius * radius * square && at > 0 && at < 1;
    int axis = surface->side_axis;
    if (axis < 0 || axis > 1) {
        return crossed ? WRAP_CROSSED : WRAP_NONE;
    }
    int sign = surface->side_sign;
    int p_there = sign_of(p[axis]) == sign, s_there = sign_of(s[axis]) == sign;
    if (!p_there && !s_there) {
        return WRAP_POSSIBLE;
    }
    if (crossed) {
        return WRAP_CROSSED;
    }
    double nearest = p[axis] + at * (s[axis] - p[axis]);
    return p_there != s_there && sign_of(nearest) != sign ? WRAP_POSSIBLE : WRAP_NONE;
}

/* The string between ends outside, on the way of growing angles (sense 1) or falling ones (-1). */
static void cylinder_string(const wrap_surface *surface, const double *p, const double *s,
                            double sense, wrap_string *out) {
    double radius = surface->size[0];
    double distance[2] = {sqrt(p[0] * p[0] + p[1] * p[1]), sqrt(s[0] * s[0] + s[1] * s[1])};
    double angle[2] = {atan2(p[1], p[0]), atan2(s[1], s[0])};
    circle_string ring;
    circle_tangents(radius, distance, angle, sense, &ring);
    /* unrolled, the string is one straight line */
    double across = ring.straight[0] + radius * ring.turn + ring.straight[1];
    double rise = s[2] - p[2], length = sqrt(across * across + rise * rise),
           stretch = length / across;
    double at[2] = {ring.start, ring.start + sense * ring.turn}, *points[2] = {out->a, out->b};
    out->way = sense > 0 ? 1 : -1;
    points[0][2] = p[2] + rise * ring.straight[0] / across;
    points[1][2] = s[2] - rise * ring.straight[1] / across;
    for (int k = 0; k < 2; k++) {
        double c = cos(at[k]), w = sin(at[k]);
        points[k][0] = radius * c;
        points[k][1] = radius * w;
        out->n[k][0] = c;
        out->n[k][1] = w;
        out->n[k][2] = 0;
        out->t[k][0] = -sense * w / stretch;
        out->t[k][1] = sense * c / stretch;
        out->t[k][2] = rise / length;
        out->straight[k] = ring.straight[k] * stretch;
    }
    out->arc = radius * ring.turn * stretch;
    out->field[0] = out->field[3] = 1;
    out->field[1] = 0;
    out->field[2] = out->arc;
}

void wrap_both_ways(const wrap_surface *surface, const double *p, const double *s,
                    wrap_string *rising, wrap_string *falling, jet *share) {
    jet lengths[2];
    rising->held = falling->held = 0;
    rising->other = falling->other = 0;
    cylinder_string(surface, p, s, 1, rising);
    cylinder_string(surface, p, s, -1, falling);
    wrap_jet(rising, &lengths[0]);
    wrap_jet(falling, &lengths[1]);
    side_rising_jet(surface, p, s, &lengths[0], &lengths[1], share);
}

int wrap_cylinder(const wrap_surface *surface, const double *p, const double *s,
                  const wrap_string *guess, wrap_string *out) {
    double square = surface->size[0] * surface->size[0];
    if (p[0] * p[0] + p[1] * p[1] <= square || s[0] * s[0] + s[1] * s[1] <= square) {
        return WRAP_INSIDE;
    }
    int needs = cylinder_needs(surface, p, s), between = 0;
    if (needs == WRAP_NONE) {
        return WRAP_NONE;
    }
    if (guess != NULL && guess->keeps) {
        cylinder_string(surface, p, s, guess->way, out);
        return wrap_is_off(surface, out) ? WRAP_NONE : needs;
    }
    double rising = p[0] * s[1] - p[1] * s[0] < 0 ? 0 : 1; /* the short way */
    if (surface->side_axis == 0 || surface->side_axis == 1) {
        rising = side_rising(surface, p, s, &between);
    }
    if (between) {
        wrap_string falling;
        jet share;
        wrap_both_ways(surface, p, s, out, &falling, &share);
        int off[2] = {wrap_is_off(surface, &falling), wrap_is_off(surface, out)};
        int way = share.value > 0.5;
        if (!way) {
            *out = falling;
        }
        out->other = fmin(share.value, 1 - share.value);
        return off[way] && (out->other == 0 || off[1 - way]) ? WRAP_NONE : needs;
    }
    cylinder_string(surface, p, s, rising > 0.5 ? 1 : -1, out);
    return wrap_is_off(surface, out) ? WRAP_NONE : needs;
}
