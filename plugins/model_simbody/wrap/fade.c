/* SPDX-License-Identifier: Apache-2.0 */
/* fade.c: lengths of strings that let go, by arithmetic on values with two derivatives. */
#include "fade.h"

#include "../vector.h"
#include "hold.h"

#include <math.h>
#include <string.h>

#define CLEAR 0.02 /* of the radius */
#define DEEP 0.1   /* of the radius */
#define GONE 1e-5  /* of the way over which it fades: nothing that counts is left */

/* ---- how far it is to letting go ---- */

/* Distance of end e from the surface; from an ellipsoid roughly, 0 where it is 0. */
static void outside_jet(const wrap_surface *surface, const double *p, const double *s, int e,
                        jet *out) {
    jet x[3], sum = {0}, square;
    double size[3] = {1, 1, 1}, least = 1;
    if (surface->kind == MHE_OBSTACLE_ELLIPSOID) {
        memcpy(size, surface->size, sizeof size);
        least = fmin(size[0], fmin(size[1], size[2]));
    }
    for (int i = 0; i < 3; i++) {
        jet_coordinate(p, s, 3 * e + i, &x[i]);
        jet_multiply(&x[i], &x[i], &square);
        if (i < 2 || surface->kind == MHE_OBSTACLE_SPHERE ||
            surface->kind == MHE_OBSTACLE_ELLIPSOID) {
            jet_add(&sum, least * least / (size[i] * size[i]), &square, &sum);
        }
    }
    jet_root(&sum, out);
    if (surface->kind == MHE_OBSTACLE_TORUS) {
        out->value -= surface->size[1];
        jet_multiply(out, out, &sum);
        jet_add(&sum, 1, &square, &sum);
        jet_root(&sum, out);
    }
    out->value -= surface->kind == MHE_OBSTACLE_ELLIPSOID ? least : surface->size[0];
}

double wrap_outside(const wrap_surface *surface, const double *x) {
    const double *size = surface->size;
    switch (surface->kind) {
    case MHE_OBSTACLE_SPHERE:
        return sqrt(dot3(x, x)) - size[0];
    case MHE_OBSTACLE_CYLINDER:
        return sqrt(x[0] * x[0] + x[1] * x[1]) - size[0];
    case MHE_OBSTACLE_ELLIPSOID: {
        double y[3] = {x[0] / size[0], x[1] / size[1], x[2] / size[2]};
        return fmin(size[0], fmin(size[1], size[2])) * (sqrt(dot3(y, y)) - 1);
    }
    default: {
        double off = sqrt(x[0] * x[0] + x[1] * x[1]) - size[1];
        return sqrt(off * off + x[2] * x[2]) - size[0];
    }
    }
}

double wrap_outside_derivatives(const wrap_surface *surface, const double *x, double *g,
                                double *h) {
    jet off;
    outside_jet(surface, x, x, 0, &off);
    memcpy(g, off.slope, 3 * sizeof *g);
    for (int i = 0; i < 3; i++) {
        memcpy(h + 3 * i, off.curve[i], 3 * sizeof *h);
    }
    return off.value;
}

int wrap_clears(const wrap_surface *surface, double *x) {
    const double *size = surface->size;
    double middle[3] = {0, 0, 0}, d[3], weight[3] = {1, 1, 1}, square = 0;
    double rho = sqrt(x[0] * x[0] + x[1] * x[1]), radius = size[0];
    switch (surface->kind) {
    case MHE_OBSTACLE_CYLINDER:
        middle[2] = x[2];
        break;
    case MHE_OBSTACLE_TORUS:
        middle[0] = rho > 0 ? size[1] * x[0] / rho : size[1];
        middle[1] = rho > 0 ? size[1] * x[1] / rho : 0;
        break;
    case MHE_OBSTACLE_ELLIPSOID:
        radius = 1;
        for (int i = 0; i < 3; i++) {
            weight[i] = 1 / (size[i] * size[i]);
        }
        break;
    default:
        break;
    }
    for (int i = 0; i < 3; i++) {
        d[i] = x[i] - middle[i];
        square += weight[i] * d[i] * d[i];
    }
    double scaled = sqrt(square), wanted = radius * (1 + CLEAR);
    if (!(scaled < radius * (1 + 0.5 * CLEAR)) || !(scaled > radius * (1 - DEEP))) {
        return 0;
    }
    for (int i = 0; i < 3; i++) {
        x[i] = middle[i] + wanted / scaled * d[i];
    }
    return 1;
}

static double distance_of(const double *p, const double *s) {
    double d[3] = {s[0] - p[0], s[1] - p[1], s[2] - p[2]};
    return sqrt(dot3(d, d));
}

/* How far the contacts are beyond the cylinder's end. */
static void beyond(const wrap_surface *surface, const wrap_string *string, double *out) {
    out[0] = fabs(string->a[2]) - 0.5 * surface->size[1];
    out[1] = fabs(string->b[2]) - 0.5 * surface->size[1];
}

int wrap_is_off(const wrap_surface *surface, const wrap_string *string) {
    double off[2], most = FADE_OFF * surface->size[0];
    beyond(surface, string, off);
    return off[0] >= most && off[1] >= most;
}

int wrap_fades(const wrap_surface *surface, const double *p, const double *s, const int *moves,
               int holds, const wrap_string *string) {
    double excess = wrap_length(string) - distance_of(p, s), off[2];
    if (hold_fades(surface, p, s, holds, excess)) {
        return 1;
    }
    if (string->held || string->other > 0) {
        return 1;
    }
    if ((moves[0] && wrap_outside(surface, p) < FADE_INSIDE * excess) ||
        (moves[1] && wrap_outside(surface, s) < FADE_INSIDE * excess)) {
        return 1;
    }
    beyond(surface, string, off);
    return surface->kind == MHE_OBSTACLE_CYLINDER && off[0] > 0 && off[1] > 0;
}

/* ---- length ---- */

static void jet_blocks(const double *pp, const double *ps, const double *ss, jet *out) {
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            out->curve[i][j] = pp[3 * i + j];
            out->curve[i][3 + j] = ps[3 * i + j];
            out->curve[3 + i][j] = ps[3 * j + i];
            out->curve[3 + i][3 + j] = ss[3 * i + j];
        }
    }
}

void wrap_jet(const wrap_string *string, jet *out) {
    double pp[9], ps[9], ss[9];
    wrap_curvature(string, pp, ps, ss);
    out->value = wrap_length(string);
    for (int i = 0; i < 3; i++) {
        out->slope[i] = -string->t[0][i];
        out->slope[3 + i] = string->t[1][i];
    }
    jet_blocks(pp, ps, ss, out);
}

static void straight_jet(const double *p, const double *s, jet *out) {
    jet sum = {0}, a, b;
    for (int i = 0; i < 3; i++) {
        jet_coordinate(p, s, i, &a);
        jet_coordinate(p, s, 3 + i, &b);
        jet_add(&b, -1, &a, &a);
        jet_multiply(&a, &a, &b);
        jet_add(&sum, 1, &b, &sum);
    }
    jet_root(&sum, out);
}

/* How far contact e is beyond the cylinder's end. Unrolled, the string is a straight line: the
 * contact's share of the way across is that of the way along. */
static void beyond_jet(const wrap_surface *surface, const double *p, const double *s, int e,
                       const jet *length, jet *out) {
    jet x, y, own, other, rise, across, leg;
    jet_coordinate(p, s, 3 * e + 2, &own);
    jet_coordinate(p, s, 3 * (1 - e) + 2, &other);
    jet_add(&other, -1, &own, &rise);
    jet_multiply(&rise, &rise, &x);
    jet_multiply(length, length, &y);
    jet_add(&y, -1, &x, &y);
    jet_root(&y, &across);
    jet_coordinate(p, s, 3 * e, &x);
    jet_coordinate(p, s, 3 * e + 1, &y);
    jet_multiply(&x, &x, &x);
    jet_multiply(&y, &y, &y);
    jet_add(&x, 1, &y, &x);
    x.value -= surface->size[0] * surface->size[0];
    jet_root(&x, &leg);
    jet_divide(&leg, &across, &leg);
    jet_multiply(&rise, &leg, &leg);
    jet_add(&own, 1, &leg, &leg);
    double sign = leg.value < 0 ? -1 : 1;
    jet_apply(&leg, sign * leg.value, sign, 0, out);
    out->value -= 0.5 * surface->size[1];
}

/* excess *= S(h / (k excess)) */
static void fade_inside(const jet *h, jet *excess) {
    jet share;
    jet_apply(excess, FADE_INSIDE * excess->value, FADE_INSIDE, 0, &share);
    jet_divide(h, &share, &share);
    jet_rise(&share, &share);
    jet_multiply(&share, excess, excess);
}

/* excess *= 1 - S(x / (m r)) S(y / (m r)) */
static void fade_off(const wrap_surface *surface, const double *p, const double *s,
                     const jet *length, jet *excess) {
    jet share[2];
    double most = FADE_OFF * surface->size[0];
    for (int e = 0; e < 2; e++) {
        beyond_jet(surface, p, s, e, length, &share[e]);
        jet_apply(&share[e], share[e].value / most, 1 / most, 0, &share[e]);
        jet_rise(&share[e], &share[e]);
    }
    jet_multiply(&share[0], &share[1], &share[0]);
    jet_multiply(&share[0], excess, &share[0]);
    jet_add(excess, -1, &share[0], excess);
}

/* The string's length, less what a pass that is low no longer holds. */
static void fade_over(const wrap_surface *surface, const double *p, const double *s,
                      const wrap_string *string, jet *length) {
    wrap_string strings[2];
    jet shortest, pass, excess, share;
    if (string->held == WRAP_HELD_WHOLE ||
        !wrap_slips(surface, p, s, string, &strings[0], &strings[1])) {
        return;
    }
    wrap_jet(&strings[0], &shortest);
    if (string->held == WRAP_HELD_NOT) {
        *length = shortest;
        return;
    }
    jet_add(length, -1, &shortest, &excess);
    double most = FADE_PASS * excess.value, high = wrap_length(&strings[1]) - length->value;
    if (high >= most) {
        return;
    }
    if (high < GONE * most) {
        *length = shortest;
        return;
    }
    wrap_jet(&strings[1], &pass);
    jet_add(&pass, -1, length, &pass);
    jet_apply(&excess, most, FADE_PASS, 0, &share);
    jet_divide(&pass, &share, &share);
    jet_rise(&share, &share);
    jet_multiply(&share, &excess, &excess);
    jet_add(&shortest, 1, &excess, length);
}

static void jet_out(const jet *x, double *g, double *pp, double *ps, double *ss) {
    if (g != NULL) {
        memcpy(g, x->slope, sizeof x->slope);
        for (int i = 0; i < 3; i++) {
            memcpy(pp + 3 * i, x->curve[i], 3 * sizeof *pp);
            memcpy(ps + 3 * i, x->curve[i] + 3, 3 * sizeof *ps);
            memcpy(ss + 3 * i, x->curve[3 + i] + 3, 3 * sizeof *ss);
        }
    }
}

/* What is left of what the string is longer than the straight line. */
static void fade_excess(const wrap_surface *surface, const double *p, const double *s,
                        const int *moves, const wrap_string *string, const jet *straight,
                        jet *excess) {
    jet length, h;
    double off[2];
    wrap_jet(string, &length);
    fade_over(surface, p, s, string, &length);
    jet_add(&length, -1, straight, excess);
    beyond(surface, string, off);
    if (surface->kind == MHE_OBSTACLE_CYLINDER && off[0] > 0 && off[1] > 0) {
        fade_off(surface, p, s, &length, excess);
    }
    for (int e = 0; e < 2; e++) {
        double most = FADE_INSIDE * excess->value;
        if (moves[e] && most > 0 && wrap_outside(surface, e ? s : p) < most) {
            outside_jet(surface, p, s, e, &h);
            fade_inside(&h, excess);
        }
    }
}

double wrap_faded(const wrap_surface *surface, const double *p, const double *s, const int *moves,
                  int holds, const wrap_string *string, double *g, double *pp, double *ps,
                  double *ss) {
    jet length, straight, excess;
    double most = FADE_INSIDE * (wrap_length(string) - distance_of(p, s));
    straight_jet(p, s, &straight);
    if ((moves[0] && wrap_outside(surface, p) < GONE * most) ||
        (moves[1] &&
         wrap_outside(surface, s) < GONE * most)) { /* its derivatives need not be finite */
        jet_out(&straight, g, pp, ps, ss);
        return straight.value;
    }
    if (string->other > 0) { /* falling + share (rising - falling) */
        wrap_string ways[2];
        jet share, other;
        wrap_both_ways(surface, p, s, &ways[0], &ways[1], &share);
        fade_excess(surface, p, s, moves, &ways[1], &straight, &excess);
        fade_excess(surface, p, s, moves, &ways[0], &straight, &other);
        jet_add(&other, -1, &excess, &other);
        jet_multiply(&share, &other, &other);
        jet_add(&excess, 1, &other, &excess);
    } else {
        fade_excess(surface, p, s, moves, string, &straight, &excess);
    }
    if (hold_fades(surface, p, s, holds, excess.value)) {
        jet share;
        hold_jet(surface, p, s, holds, &excess, &share);
        jet_multiply(&share, &excess, &excess);
    }
    jet_add(&straight, 1, &excess, &length);
    jet_out(&length, g, pp, ps, ss);
    return length.value;
}
