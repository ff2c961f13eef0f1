/* SPDX-License-Identifier: Apache-2.0 */
/* geodesic.c: the geodesic equation x'' = -II(x', x') n with its Jacobi fields, by extrapolation of
 * the modified midpoint rule (Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I,
 * II.9), and strings by shooting along it. */
#include "geodesic.h"

#include "../../clones.h"
#include "../vector.h"

#include <math.h>
#include <string.h>

#define STATES 10
#define LEVELS 8    /* of extrapolation: 2, 4 .. 16 substeps */
#define FINE 1e-10  /* error of a step less one order, relative to the surface's size */
#define COARSE 1e-5 /* likewise, while a string is far from its end */
#define STEP 0.7    /* longest step, as an angle by the curvature where it begins */
#define MAX_HALVINGS 12
#define MAX_STEPS 60
#define MAX_NEWTON 12
#define MAX_CUTS 4
#define NEAR 1e-3    /* miss, relative to the surface's size: from here on, fine steps */
#define LONGEST 7.0  /* sizes: no string is longer on its surface */
#define MAX_TURN 0.5 /* rad, sizes: longest step of Newton's method */
#define SOLVED 2e-13 /* miss, relative to the surface's size */

static void ellipsoid_shape(const double *size, const double *x, const double *t, const double *b,
                            surface_shape *out) {
    double w[3], g[3], bend = 0, twist = 0, cross = 0;
    for (int i = 0; i < 3; i++) {
        w[i] = 1 / (size[i] * size[i]);
        g[i] = x[i] * w[i];
        bend += t[i] * t[i] * w[i];
    }
    double square = dot3(g, g), inverse = 1 / sqrt(square);
    for (int i = 0; i < 3; i++) {
        out->normal[i] = g[i] * inverse;
    }
    out->gauss = w[0] * w[1] * w[2] / (square * square);
    out->bend = bend * inverse;
    if (b != NULL) {
        for (int i = 0; i < 3; i++) {
            twist += t[i] * b[i] * w[i];
            cross += b[i] * b[i] * w[i];
        }
        out->twist = twist * inverse;
        out->cross_bend = cross * inverse;
    }
}

/* size: radius of the tube, of the ring */
static void torus_shape(const double *size, const double *x, const double *t, const double *b,
                        surface_shape *out) {
    double rho = sqrt(x[0] * x[0] + x[1] * x[1]), e[2] = {x[0] / rho, x[1] / rho};
    double off = rho - size[1], distance = sqrt(off * off + x[2] * x[2]);
    double around = off / (distance * rho), meridian = 1 / distance; /* curvatures */
    out->normal[0] = off / distance * e[0];
    out->normal[1] = off / distance * e[1];
    out->normal[2] = x[2] / distance;
    out->gauss = around * meridian;
    double turn = e[0] * t[1] - e[1] * t[0]; /* share of t around the axis */
    out->bend = meridian + (around - meridian) * turn * turn;
    if (b != NULL) {
        double turn_b = e[0] * b[1] - e[1] * b[0];
        out->twist = (around - meridian) * turn * turn_b;
        out->cross_bend = meridian + (around - meridian) * turn_b * turn_b;
    }
}

void surface_shape_at(const wrap_surface *surface, const double *x, const double *t,
                      const double *b, surface_shape *out) {
    if (surface->kind == MHE_OBSTACLE_TORUS) {
        torus_shape(surface->size, x, t, b, out);
    } else {
        ellipsoid_shape(surface->size, x, t, b, out);
    }
}

#define INLINED static inline __attribute__((always_inline))

/* Rates of a state on the ellipsoid whose inverse squared half axes are w. */
INLINED void ellipsoid_rate(const double *w, const double *y, double *rate) {
    double g[3] = {y[0] * w[0], y[1] * w[1], y[2] * w[2]};
    double inverse = 1 / (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    double bend = (y[3] * y[3] * w[0] + y[4] * y[4] * w[1] + y[5] * y[5] * w[2]) * inverse;
    double gauss = w[0] * w[1] * w[2] * inverse * inverse;
    for (int i = 0; i < 3; i++) {
        rate[i] = y[3 + i];
        rate[3 + i] = -bend * g[i];
    }
    rate[6] = y[7];
    rate[7] = -gauss * y[6];
    rate[8] = y[9];
    rate[9] = -gauss * y[8];
}

/* On the torus; w: curvature of the tube, radius of the ring. */
INLINED void torus_rate(const double *w, const double *y, double *rate) {
    double inverse = 1 / sqrt(y[0] * y[0] + y[1] * y[1]), e[2] = {y[0] * inverse, y[1] * inverse};
    double out = 1 - w[1] * inverse; /* share of the distance from the axis */
    double around = out * w[0], turn = e[0] * y[4] - e[1] * y[3];
    double bend = w[0] + (around - w[0]) * turn * turn, gauss = around * w[0];
    double k = -bend * w[0];
    rate[0] = y[3];
    rate[1] = y[4];
    rate[2] = y[5];
    rate[3] = k * out * y[0];
    rate[4] = k * out * y[1];
    rate[5] = k * y[2];
    rate[6] = y[7];
    rate[7] = -gauss * y[6];
    rate[8] = y[9];
    rate[9] = -gauss * y[8];
}

INLINED void geodesic_rate(int torus, const double *w, const double *y, double *rate) {
    if (torus) {
        torus_rate(w, y, rate);
    } else {
        ellipsoid_rate(w, y, rate);
    }
}

/* One step of the midpoint rule in n substeps, without the last smoothing. */
INLINED void midpoint_step(int torus, const double *w, const double *y, double h, int n,
                           double *out) {
    double last[STATES], rate[STATES], sub = h / n, at[STATES];
    geodesic_rate(torus, w, y, rate);
    for (int i = 0; i < STATES; i++) {
        last[i] = y[i];
        at[i] = y[i] + sub * rate[i];
    }
    for (int k = 1; k < n; k++) {
        geodesic_rate(torus, w, at, rate);
        for (int i = 0; i < STATES; i++) {
            double next = last[i] + 2 * sub * rate[i];
            last[i] = at[i];
            at[i] = next;
        }
    }
    memcpy(out, at, sizeof at);
}

CLONES static void midpoint_ellipsoid(const double *w, const double *y, double h, int n,
                                      double *out) {
    midpoint_step(0, w, y, h, n, out);
}

CLONES static void midpoint_torus(const double *w, const double *y, double h, int n, double *out) {
    midpoint_step(1, w, y, h, n, out);
}

/* Extrapolated step; returns its error in units of what is allowed. */
static double geodesic_step(int torus, const double *w, const double *y, double h, double scale,
                            double accuracy, double *out) {
    double table[LEVELS][STATES], error = INFINITY;
    for (int k = 0; k < LEVELS && !(error < 1); k++) {
        if (torus) {
            midpoint_torus(w, y, h, 2 * (k + 1), out);
        } else {
            midpoint_ellipsoid(w, y, h, 2 * (k + 1), out);
        }
        for (int m = 1; m <= k; m++) { /* table[m - 1]: of the coarser row, then of this one */
            double ratio = (double)(k + 1) / (double)(k + 1 - m);
            double factor = 1 / (ratio * ratio - 1);
            for (int i = 0; i < STATES; i++) {
                double off = out[i] - table[m - 1][i];
                table[m - 1][i] = out[i];
                out[i] += off * factor;
            }
        }
        memcpy(table[k], out, sizeof table[k]);
        if (k < 1) {
            continue;
        }
        error = 0;
        for (int i = 0; i < 6; i++) {
            double off = fabs(out[i] - table[k - 1][i]) / (i < 3 ? scale : 1);
            error = off > error || isnan(off) ? off : error;
        }
        error /= accuracy;
    }
    return error;
}

/* What lengths on the surface are compared with: the tube of a torus, else the longest half axis.
 */
static double surface_scale(const wrap_surface *surface) {
    return surface->kind == MHE_OBSTACLE_TORUS
               ? surface->size[0]
               : fmax(surface->size[0], fmax(surface->size[1], surface->size[2]));
}

void geodesic_follow(const wrap_surface *surface, const double *x, const double *t, double length,
                     double accuracy, geodesic_state *end) {
    double y[STATES] = {x[0], x[1], x[2], t[0], t[1], t[2], 1, 0, 0, 1};
    double scale = surface_scale(surface), left = length;
    double w[3] = {1 / surface->size[0], surface->size[1], 0};
    int torus = surface->kind == MHE_OBSTACLE_TORUS;
    for (int i = 0; i < 3 && !torus; i++) {
        w[i] = 1 / (surface->size[i] * surface->size[i]);
    }
    for (int step = 0; step < MAX_STEPS && left != 0; step++) {
        double next[STATES];
        surface_shape shape;
        surface_shape_at(surface, y, y + 3, NULL, &shape);
        double curvature = fmax(fabs(shape.bend), sqrt(fabs(shape.gauss)));
        double h = left, longest = STEP / curvature;
        if (!(fabs(h) <= longest)) {
            h = copysign(longest, left);
        }
        for (int k = 0; k < MAX_HALVINGS; k++, h /= 2) {
            if (geodesic_step(torus, w, y, h, scale, accuracy, next) < 1) {
                break;
            }
        }
        memcpy(y, next, sizeof y);
        left = h == left ? 0 : left - h;
    }
    if (left != 0) { /* too long for any string */
        y[0] = NAN;
    }
    memcpy(end->y, y, sizeof y);
}

/* ---- strings ---- */

/* What the string misses s by, across and off the surface, and how (turn, arc) change that. */
typedef struct shot {
    double miss[2]; /* w . n, w . b, of w = s - its end of the geodesic; m */
    double by_turn[2], by_arc[2];
    double ahead;  /* w . t */
    double spread; /* S over its value on a flat surface: < 0 beyond a conjugate point */
} shot;

static void across3(const double *t, const double *n, double *out) {
    cross3(t, n, out);
    double norm = sqrt(dot3(out, out));
    for (int i = 0; i < 3; i++) {
        out[i] /= norm;
    }
}

/* 0: done; the string is written but for what concerns s. */
static int string_fire(const wrap_surface *surface, const double *p, const double *s,
                       const string_start *start, double turn, double arc, double accuracy,
                       wrap_string *out, shot *result) {
    double a_turn[3], side[3], w[3];
    surface_shape shape;
    geodesic_state end;
    start->contact(start->data, turn, out->a, a_turn);
    for (int i = 0; i < 3; i++) {
        out->t[0][i] = out->a[i] - p[i];
    }
    double d1 = sqrt(dot3(out->t[0], out->t[0]));
    if (!(d1 > 0)) {
        return -1;
    }
    for (int i = 0; i < 3; i++) {
        out->t[0][i] /= d1;
    }
    surface_shape_at(surface, out->a, out->t[0], NULL, &shape);
    memcpy(out->n[0], shape.normal, sizeof out->n[0]);
    across3(out->t[0], out->n[0], side);
    double along = dot3(a_turn, out->t[0]), beside = dot3(a_turn, side);
    geodesic_follow(surface, out->a, out->t[0], arc, accuracy, &end);
    memcpy(out->b, end.y, sizeof out->b);
    memcpy(out->t[1], end.y + 3, sizeof out->t[1]);
    memcpy(out->field, end.y + 6, sizeof out->field);
    out->straight[0] = d1;
    out->arc = arc;
    surface_shape_at(surface, out->b, out->t[1], NULL, &shape);
    memcpy(out->n[1], shape.normal, sizeof out->n[1]);
    across3(out->t[1], out->n[1], side);
    surface_shape_at(surface, out->b, out->t[1], side, &shape);
    for (int i = 0; i < 3; i++) {
        w[i] = s[i] - out->b[i];
    }
    double g = dot3(w, out->n[1]), h = dot3(w, side), d2 = dot3(w, out->t[1]);
    double j = beside * (out->field[0] + out->field[2] / d1);
    double rate = beside * (out->field[1] + out->field[3] / d1);
    result->miss[0] = g;
    result->miss[1] = h;
    result->by_arc[0] = d2 * shape.bend + h * shape.twist;
    result->by_arc[1] = -shape.twist * g;
    result->by_turn[0] = along * result->by_arc[0] + j * (d2 * shape.twist + h * shape.cross_bend);
    result->by_turn[1] = along * result->by_arc[1] - j - d2 * rate - g * shape.cross_bend * j;
    result->ahead = d2;
    result->spread = (j + d2 * rate) / (beside == 0 ? 1 : beside);
    out->straight[1] = d2;
    return isfinite(g) && isfinite(h) ? 0 : -1;
}

/* Newton's step for (turn, arc), shortened to what its linear model may be trusted with. */
static double newton_step(const shot *now, double scale, double *step) {
    double det = now->by_turn[0] * now->by_arc[1] - now->by_turn[1] * now->by_arc[0];
    step[0] = (now->miss[1] * now->by_arc[0] - now->miss[0] * now->by_arc[1]) / det;
    step[1] = (now->miss[0] * now->by_turn[1] - now->miss[1] * now->by_turn[0]) / det;
    double size = fmax(fabs(step[0]), fabs(step[1]) / scale) / MAX_TURN;
    return size > 1 ? 1 / size : 1;
}

int string_shoot(const wrap_surface *surface, const double *p, const double *s,
                 const string_start *start, double *turn, wrap_string *out) {
    double scale = surface_scale(surface), limit = SOLVED * scale;
    double arc = start->arc, accuracy = start->near ? FINE : COARSE, step[2];
    shot now;
    *turn = start->turn;
    if (string_fire(surface, p, s, start, *turn, arc, accuracy, out, &now) != 0) {
        return -1;
    }
    double miss = hypot(now.miss[0], now.miss[1]);
    for (int k = 0; k < MAX_NEWTON; k++) {
        if (accuracy > FINE && miss < NEAR * scale) {
            accuracy = FINE;
            (void)string_fire(surface, p, s, start, *turn, arc, accuracy, out, &now);
            miss = hypot(now.miss[0], now.miss[1]);
        }
        int done = accuracy == FINE && miss < limit, better = done;
        double share = newton_step(&now, scale, step), before = miss;
        int whole = share == 1;
        for (int half = 0; half < MAX_CUTS && !better; half++, share /= 2) {
            if (string_fire(surface, p, s, start, *turn + share * step[0], arc + share * step[1],
                            accuracy, out, &now) != 0) {
                continue;
            }
            miss = hypot(now.miss[0], now.miss[1]);
            better = miss < before || (half == 0 && !whole);
            if (better) {
                *turn += share * step[0];
                arc += share * step[1];
            }
        }
        if (done || !better) { /* not better: the digits end here, or no solution */
            int solved = done || (accuracy == FINE && before < 1e3 * limit);
            return solved && now.ahead > 0 && now.spread > 0 && arc > -limit &&
                           arc < LONGEST * scale
                       ? 0
                       : -1;
        }
    }
    return -1;
}
