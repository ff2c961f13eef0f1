/* SPDX-License-Identifier: Apache-2.0 */
/* side.c: the way round a cylinder. */
#include "side.h"

#include <math.h>

#define HALF_TURN 3.141592653589793

/* Tangent point of end e, of the way of growing angles (0) or falling ones (1): how far on the side
 * asked for, as a share of the radius. */
static void tangent_point(const wrap_surface *surface, const double *p, const double *s, int e,
                          int way, jet *out) {
    double radius = surface->size[0], turn = way == 0 ? 1 : -1;
    jet own, other, square, leg, product;
    int axis = surface->side_axis; /* of x r - y d, or y r + x d, d being the leg */
    jet_coordinate(p, s, 3 * e + axis, &own);
    jet_coordinate(p, s, 3 * e + 1 - axis, &other);
    jet_multiply(&own, &own, &square);
    jet_multiply(&other, &other, &product);
    jet_add(&square, 1, &product, &square);
    leg = square;
    leg.value -= radius * radius;
    jet_root(&leg, &leg);
    jet_multiply(&other, &leg, &product);
    jet_apply(&own, radius * own.value, radius, 0, &own);
    jet_add(&own, axis == 0 ? -turn : turn, &product, &own);
    jet_divide(&own, &square, out);
    jet_apply(out, surface->side_sign * out->value, surface->side_sign, 0, out);
}

/* The longer way about, where no tangent point is on the side. */
static double longer_way(const wrap_surface *surface, const double *p, const double *s) {
    double angle = atan2(s[1], s[0]) - atan2(p[1], p[0]);
    double open =
        acos(surface->size[0] / hypot(p[0], p[1])) + acos(surface->size[0] / hypot(s[0], s[1]));
    return cos(angle - open) < cos(angle + open) ? 1 : 0;
}

/* OpenSim's rule: 1: of growing angles. */
static double rule(const int *p_there, const int *s_there, double longer) {
    if (p_there[0] != p_there[1]) {
        return p_there[0];
    }
    if (p_there[0]) {
        return !s_there[0];
    }
    return s_there[0] || s_there[1] ? !s_there[0] : longer;
}

/* How wide the band is: nothing where the ways differ by half a turn or more. */
static void side_band(const wrap_surface *surface, const jet *rising, const jet *falling,
                      jet *out) {
    jet apart;
    jet_add(rising, -1, falling, &apart);
    double sign = apart.value < 0 ? -1 : 1, scale = sign / (HALF_TURN * surface->size[0]);
    jet_apply(&apart, scale * apart.value, scale, 0, &apart);
    jet_rise(&apart, &apart);
    jet_apply(&apart, SIDE_BAND * (1 - apart.value), -SIDE_BAND, 0, out);
}

void side_rising_jet(const wrap_surface *surface, const double *p, const double *s,
                     const jet *rising, const jet *falling, jet *share) {
    jet weight[4], sum = {0}, band;
    double longer = longer_way(surface, p, s);
    side_band(surface, rising, falling, &band);
    for (int k = 0; k < 4; k++) {
        jet x;
        tangent_point(surface, p, s, k / 2, k % 2, &x);
        if (fabs(x.value) >= band.value) {
            weight[k] = (jet){.value = x.value > 0};
            continue;
        }
        jet_divide(&x, &band, &x);
        jet_apply(&x, 0.5 * (x.value + 1), 0.5, 0, &x);
        jet_rise(&x, &weight[k]);
    }
    for (int k = 0; k < 16; k++) {
        const int there[4] = {k & 1, k >> 1 & 1, k >> 2 & 1, k >> 3 & 1};
        jet product = {.value = rule(there, there + 2, longer)};
        for (int i = 0; i < 4 && product.value > 0; i++) {
            jet factor = weight[i];
            if (!there[i]) {
                jet_apply(&factor, 1 - factor.value, -1, 0, &factor);
            }
            jet_multiply(&product, &factor, &product);
        }
        jet_add(&sum, 1, &product, &sum);
    }
    *share = sum;
}

double side_rising(const wrap_surface *surface, const double *p, const double *s, int *between) {
    const double *ends[2] = {p, s};
    double radius = surface->size[0];
    int axis = surface->side_axis, there[4];
    *between = 0;
    for (int k = 0; k < 4; k++) {
        const double *x = ends[k / 2];
        double square = x[0] * x[0] + x[1] * x[1], leg = sqrt(square - radius * radius);
        double across = (k % 2 == 0) == (axis == 0) ? -leg : leg;
        double at = (radius * x[axis] + across * x[1 - axis]) / square * surface->side_sign;
        *between |= fabs(at) < SIDE_BAND;
        there[k] = at > 0;
    }
    return rule(there, there + 2, longer_way(surface, p, s));
}
