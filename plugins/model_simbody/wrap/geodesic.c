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
#define FINE 1e-10  /* error of a step less one order, relative to the surface's size */
#define COARSE 1e-5 /* likewise, while a string is far from its end */
#define STEP 0.7    /* longest step, as an angle by the curvature where it begins */
#define MAX_HALVINGS 12
#define MAX_STEPS 60
#define MAX_NEWTON 12
#define MAX_FIRED 16 /* strings tried: there are none where that does not do */
#define MAX_CUTS 4
#define NEAR 1e-3     /* miss, relative to the surface's size: from here on, fine steps */
#define MIRRORED 0.05 /* of the size: straight parts beyond which a string has passed its end */
#define LONGEST 7.0   /* sizes: no string is longer on its surface */
#define MAX_TURN 0.5  /* rad, sizes: longest step of Newton's method */
#define SOLVED 1e-12  /* miss, relative to the surface's size */

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

/* Four levels of the extrapolation at a time, one in each lane. */
#define LANES 4
typedef double lanes __attribute__((vector_size(LANES * sizeof(double))));

/* (a function that took or gave vectors by value would have another calling convention with AVX) */
INLINED void lanes_root(lanes *x) {
    for (int i = 0; i < LANES; i++) {
        (*x)[i] = sqrt((*x)[i]);
    }
}

/* Rates of states on the ellipsoid whose inverse squared half axes are w. */
INLINED void ellipsoid_rate(const double *w, const lanes *y, lanes *rate) {
    lanes g[3] = {y[0] * w[0], y[1] * w[1], y[2] * w[2]};
    lanes inverse = 1 / (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    lanes bend = (y[3] * y[3] * w[0] + y[4] * y[4] * w[1] + y[5] * y[5] * w[2]) * inverse;
    lanes gauss = w[0] * w[1] * w[2] * inverse * inverse;
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
INLINED void torus_rate(const double *w, const lanes *y, lanes *rate) {
    lanes inverse = y[0] * y[0] + y[1] * y[1];
    lanes_root(&inverse);
    inverse = 1 / inverse;
    lanes out = 1 - w[1] * inverse; /* share of the distance from the axis */
    lanes around = out * w[0], turn = (y[0] * y[4] - y[1] * y[3]) * inverse;
    lanes bend = w[0] + (around - w[0]) * turn * turn, gauss = around * w[0];
    lanes k = -bend * w[0];
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

INLINED void geodesic_rate(int torus, const double *w, const lanes *y, lanes *rate) {
    if (torus) {
        torus_rate(w, y, rate);
    } else {
        ellipsoid_rate(w, y, rate);
    }
}

/* A step by the midpoint rule in 2, 4, 6, 8 (and, `block` 1, 10 .. 16) substeps, without the last
 * smoothing; ends [STATES x LANES]. */
INLINED void midpoint_step(int torus, const double *w, const double *y, double h, int block,
                           lanes *ends) {
    lanes last[STATES] = {{0}}, at[STATES], rate[STATES], sub;
    for (int l = 0; l < LANES; l++) {
        sub[l] = h / (2 * (l + 1 + block * LANES));
    }
    for (int i = 0; i < STATES; i++) {
        last[i] = y[i] - (lanes){0};
    }
    geodesic_rate(torus, w, last, rate);
    for (int i = 0; i < STATES; i++) {
        at[i] = last[i] + sub * rate[i];
    }
    int lane = 0;
    for (int k = 1; lane < LANES; k++) {
        geodesic_rate(torus, w, at, rate);
        for (int i = 0; i < STATES; i++) {
            lanes next = last[i] + 2 * sub * rate[i];
            last[i] = at[i];
            at[i] = next;
        }
        if (k + 1 == 2 * (lane + 1 + block * LANES)) { /* this lane has come to its end */
            for (int i = 0; i < STATES; i++) {
                ends[i][lane] = at[i][lane];
            }
            lane++;
        }
    }
}

/* Extrapolated step; returns its error in units of what is allowed. */
INLINED double geodesic_step(int torus, const double *w, const double *y, double h, double scale,
                             double accuracy, double *out) {
    /* Richardson's weights for n_j = 1 .. 4 (or 8) pairs of substeps: product of
     * n_j^2 / (n_j^2 - n_i^2) over all others; and without the first */
    static const double whole[2][2 * LANES] = {
        {-0.002777777777777778, 0.35555555555555557, -2.6035714285714286, 3.250793650793651, 0, 0,
         0, 0},
        {-1.0935444136502338e-09, 5.01665686850872e-05, -0.01797351866883117, 0.747208237578608,
         -8.168052081716723, 32.36023405166262, -50.82753227078777, 26.90606541645695}};
    static const double less[2][2 * LANES] = {
        {0, 0.26666666666666666, -2.3142857142857145, 3.0476190476190474, 0, 0, 0, 0},
        {0, 3.76249265138154e-05, -0.01597646103896104, 0.700507722729945, -7.841329998448054,
         31.46133866133866, -49.79023569383292, 26.485658144324812}};
    lanes ends[2][STATES];
    double error = INFINITY;
    for (int block = 0; block < 2 && !(error < 1); block++) {
        midpoint_step(torus, w, y, h, block, ends[block]);
        error = 0;
        for (int i = 0; i < STATES; i++) {
            double best = 0, other = 0;
            for (int l = 0; l < LANES * (block + 1); l++) {
                double end = ends[l / LANES][i][l % LANES];
                best += whole[block][l] * end;
                other += less[block][l] * end;
            }
            out[i] = best;
            double off = i < 6 ? fabs(best - other) / (i < 3 ? scale : 1) : 0;
            error = off > error || isnan(off) ? off : error;
        }
        error /= accuracy;
    }
    return error;
}

CLONES static double step_ellipsoid(const double *w, const double *y, double h, double scale,
                                    double accuracy, double *out) {
    return geodesic_step(0, w, y, h, scale, accuracy, out);
}

CLONES static double step_torus(const double *w, const double *y, double h, double scale,
                                double accuracy, double *out) {
    return geodesic_step(1, w, y, h, scale, accuracy, out);
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
        double next[STATES] = {0};
        surface_shape shape;
        surface_shape_at(surface, y, y + 3, NULL, &shape);
        double curvature = fmax(fabs(shape.bend), sqrt(fabs(shape.gauss)));
        double h = left, longest = STEP / curvature;
        if (!(fabs(h) <= longest)) {
            h = copysign(longest, left);
        }
        for (int k = 0; k < MAX_HALVINGS; k++, h /= 2) {
            double error = torus ? step_torus(w, y, h, scale, accuracy, next)
                                 : step_ellipsoid(w, y, h, scale, accuracy, next);
            if (error < 1) {
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
    int fired = 0, mirrored = 0;
    out->held = 0;
    out->other = 0;
    *turn = start->turn;
    if (string_fire(surface, p, s, start, *turn, arc, accuracy, out, &now) != 0) {
        return -1;
    }
    double miss = hypot(now.miss[0], now.miss[1]);
    for (int k = 0; k < MAX_NEWTON; k++) {
        int done = accuracy == FINE && miss < limit, better = done;
        int finer = accuracy > FINE && miss < NEAR * scale; /* from the next one on */
        accuracy = finer ? FINE : accuracy;
        double share = newton_step(&now, scale, step), before = miss;
        int whole = share == 1;
        for (int half = 0; half < MAX_CUTS && !better; half++, share /= 2) {
            if (++fired > MAX_FIRED) {
                return -1;
            }
            if (string_fire(surface, p, s, start, *turn + share * step[0], arc + share * step[1],
                            accuracy, out, &now) != 0) {
                continue;
            }
            miss = hypot(now.miss[0], now.miss[1]);
            better = miss < before || (half == 0 && (!whole || finer));
            if (better) {
                *turn += share * step[0];
                arc += share * step[1];
            }
        }
        if (done || !better) { /* not better: the digits end here, or no solution */
            int solved = done || (accuracy == FINE && before < 1e3 * limit);
            if (solved && now.ahead <= 0 && now.ahead > -MIRRORED * scale && !mirrored) {
                mirrored = 1; /* it has passed the end, which the line behind it meets */
                arc += 2 * now.ahead;
                if (string_fire(surface, p, s, start, *turn, arc, accuracy, out, &now) != 0) {
                    return -1;
                }
                miss = hypot(now.miss[0], now.miss[1]);
                continue;
            }
            return solved && now.ahead > 0 && (now.spread > 0) == !start->passes && arc > -limit &&
                           arc < LONGEST * scale
                       ? 0
                       : -1;
        }
    }
    return -1;
}
