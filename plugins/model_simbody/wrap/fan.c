/* SPDX-License-Identifier: Apache-2.0 */
#include "fan.h"

#include "../vector.h"

#include <math.h>

#define SAMPLES 4 /* of an arc's length */
#define HALF_TURN 3.141592653589793

void frame_across(const double *u, double *e0, double *e1) {
    double least[3] = {0, 0, 0};
    int k = fabs(u[0]) <= fabs(u[1]) ? (fabs(u[0]) <= fabs(u[2]) ? 0 : 2)
                                     : (fabs(u[1]) <= fabs(u[2]) ? 1 : 2);
    least[k] = 1;
    cross3(u, least, e0);
    double norm = sqrt(dot3(e0, e0));
    for (int i = 0; i < 3; i++) {
        e0[i] /= norm;
    }
    cross3(u, e0, e1);
}

int fan_of(const wrap_surface *surface, const double *p, const double *s, fan *f) {
    double d[3], foot[3];
    for (int i = 0; i < 3; i++) {
        f->size[i] = surface->size[i];
        f->p[i] = p[i] / surface->size[i];
        f->s[i] = s[i] / surface->size[i];
        d[i] = f->s[i] - f->p[i];
    }
    if (dot3(f->p, f->p) < 1 || dot3(f->s, f->s) < 1) {
        return WRAP_INSIDE;
    }
    f->length = sqrt(dot3(d, d));
    f->before = -dot3(f->p, d) / f->length;
    f->after = dot3(f->s, d) / f->length;
    if (!(f->before > 0) || !(f->after > 0)) {
        return WRAP_NONE;
    }
    for (int i = 0; i < 3; i++) {
        f->u[i] = d[i] / f->length;
        foot[i] = f->p[i] + f->before * f->u[i];
    }
    f->off = sqrt(dot3(foot, foot));
    if (f->off >= 1) {
        return WRAP_NONE;
    }
    if (f->off > 1e-12) {
        for (int i = 0; i < 3; i++) {
            f->e[0][i] = foot[i] / f->off;
        }
        cross3(f->u, f->e[0], f->e[1]);
    } else {
        frame_across(f->u, f->e[0], f->e[1]);
    }
    return WRAP_CROSSED;
}

/* out = a b, or a conj(b), of complex numbers */
static void complex_multiply(const double *a, const double *b, double sign, double *out) {
    double x = a[0] * b[0] - sign * a[1] * b[1], y = a[1] * b[0] + sign * a[0] * b[1];
    out[0] = x;
    out[1] = y;
}

void fan_string_at(const fan *f, const double *half_plane, int axis, fan_string *out) {
    static const double node[SAMPLES / 2] = {0.339981043584856, 0.861136311594053};
    static const double weight[SAMPLES / 2] = {0.652145154862546, 0.347854845137454};
    double w[3], centre[3], depth = f->off * half_plane[0];
    double radius = sqrt(1 - f->off * f->off + depth * depth);
    for (int i = 0; i < 3; i++) {
        w[i] = half_plane[0] * f->e[0][i] + half_plane[1] * f->e[1][i];
        centre[i] = f->p[i] + f->before * f->u[i] - depth * w[i];
    }
    /* directions from the centre as complex numbers, u + i w: of the ends, then of the contacts,
     * which are turned towards each other by acos(radius / distance) */
    double ends[2][2] = {{-f->before, depth}, {f->after, depth}}, at[2][2], between[2];
    for (int e = 0; e < 2; e++) {
        double square = ends[e][0] * ends[e][0] + depth * depth;
        double open[2] = {radius / square, sqrt(fmax(0, square - radius * radius)) / square};
        complex_multiply(ends[e], open, e == 0 ? -1 : 1, at[e]);
    }
    complex_multiply(at[0], at[1], -1, between);
    double turn = atan2(between[1], between[0]), arc = 0;
    double half = 0.5 * (turn < -0.5 * HALF_TURN ? turn + 2 * HALF_TURN : turn);
    double back[2] = {cos(half), -sin(half)}, middle[2];
    complex_multiply(at[0], back, 1, middle);
    for (int k = 0; k < SAMPLES; k++) {
        double x = half * node[k / 2], aside[2] = {cos(x), k % 2 ? sin(x) : -sin(x)}, on[2];
        double rate = 0;
        complex_multiply(middle, aside, 1, on);
        for (int i = 0; i < 3; i++) {
            double v = f->size[i] * (on[0] * w[i] - on[1] * f->u[i]);
            rate += v * v;
        }
        arc += weight[k / 2] * sqrt(rate);
    }
    out->arc = arc * half * radius;
    double d1 = 0, d2 = 0;
    for (int i = 0; i < 3; i++) {
        out->a[i] = centre[i] + radius * (at[0][0] * f->u[i] + at[0][1] * w[i]);
        double b = centre[i] + radius * (at[1][0] * f->u[i] + at[1][1] * w[i]);
        double from = f->size[i] * (out->a[i] - f->p[i]), to = f->size[i] * (b - f->s[i]);
        d1 += from * from;
        d2 += to * to;
    }
    out->length = sqrt(d1) + sqrt(d2) + out->arc;
    out->apex =
        axis < 0 ? 0 : centre[axis] + radius * (middle[0] * f->u[axis] + middle[1] * w[axis]);
}

double fan_angle(const fan_string *strings, int k) {
    double before = strings[(k + FAN - 1) % FAN].length, here = strings[k].length;
    double after = strings[(k + 1) % FAN].length, curve = before - 2 * here + after;
    double shift = curve != 0 ? 0.5 * (before - after) / curve : 0;
    return (k + fmax(-0.5, fmin(0.5, shift))) * (2 * HALF_TURN / FAN);
}

void fan_spread(const fan *f, int axis, fan_string *strings) {
    static const double half_planes[FAN][2] = {
        {1, 0},  {0.8660254037844386, 0.5},   {0.5, 0.8660254037844386},
        {0, 1},  {-0.5, 0.8660254037844386},  {-0.8660254037844386, 0.5},
        {-1, 0}, {-0.8660254037844386, -0.5}, {-0.5, -0.8660254037844386},
        {0, -1}, {0.5, -0.8660254037844386},  {0.8660254037844386, -0.5}};
    for (int k = 0; k < FAN; k++) {
        fan_string_at(f, half_planes[k], axis, &strings[k]);
    }
}

int fan_lowest(const fan_string *strings) {
    int lowest = 0;
    for (int k = 1; k < FAN; k++) {
        lowest = strings[k].length < strings[lowest].length ? k : lowest;
    }
    return lowest;
}
