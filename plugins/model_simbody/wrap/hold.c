/* SPDX-License-Identifier: Apache-2.0 */
/* hold.c: how much of a string over a cylinder counts that only the side asked for holds there.
 *
 * Where the straight line is free, OpenSim has a string go round on the side asked for if two of
 * three are on the other one: both ends and the place where the line is nearest to the axis. Each
 * counts by a weight that rises from 0 to 1 with its distance h from the border: of an end over
 * h / (k E), E being what the string is longer than the line; of the nearest place over h / (k c),
 * c being how far that is from the surface, so that nothing is left to fade where the line comes to
 * touch. With x, y, z these weights, x y + z (x + y - 2 x y) counts. */
#include "hold.h"

#include "fade.h"

#include <math.h>

/* On the side that is not asked for: distance from the border. */
static void beyond_border(const wrap_surface *surface, const jet *x, jet *out) {
    jet_apply(x, -surface->side_sign * x->value, -surface->side_sign, 0, out);
}

/* How far across the border end p, end s and the nearest place are, and how far this is from the
 * surface; 0: the line is free. */
static int places(const wrap_surface *surface, const double *p, const double *s, jet *h, jet *c) {
    jet own[2], other[2], way[2], square = {0}, along = {0}, cross, x;
    int axis = surface->side_axis;
    for (int i = 0; i < 2; i++) {
        jet_coordinate(p, s, i, &own[i]);
        jet_coordinate(p, s, 3 + i, &other[i]);
        jet_add(&other[i], -1, &own[i], &way[i]);
        jet_multiply(&way[i], &way[i], &x);
        jet_add(&square, 1, &x, &square);
        jet_multiply(&own[i], &way[i], &x);
        jet_add(&along, -1, &x, &along);
    }
    if (!(square.value > 0)) {
        return -1;
    }
    jet_divide(&along, &square, &along);
    jet_multiply(&own[0], &other[1], &cross);
    jet_multiply(&own[1], &other[0], &x);
    jet_add(&cross, -1, &x, &cross);
    double sign = cross.value < 0 ? -1 : 1;
    jet_apply(&cross, sign * cross.value, sign, 0, &cross);
    jet_root(&square, &x);
    jet_divide(&cross, &x, c);
    c->value -= surface->size[0];
    if (c->value < 0 && along.value > 0 && along.value < 1) {
        return -1;
    }
    jet_multiply(&along, &way[axis], &x);
    jet_add(&own[axis], 1, &x, &x);
    beyond_border(surface, &own[axis], &h[0]);
    beyond_border(surface, &other[axis], &h[1]);
    beyond_border(surface, &x, &h[2]);
    return 0;
}

static double reach(double h, double most) {
    return most > 0 ? h / most : h > 0 ? 1 : 0;
}

int hold_fades(const wrap_surface *surface, const double *p, const double *s, int holds,
               double excess) {
    int axis = surface->side_axis;
    double h[3], x = p[0], y = p[1], dx = s[0] - x, dy = s[1] - y, square = dx * dx + dy * dy;
    if (!holds || surface->kind != MHE_OBSTACLE_CYLINDER || axis < 0 || axis > 1 || !(square > 0)) {
        return 0;
    }
    double at = -(x * dx + y * dy) / square, off = fabs(x * s[1] - y * s[0]) / sqrt(square);
    if (off < surface->size[0] && at > 0 && at < 1) {
        return 0;
    }
    h[0] = reach(-surface->side_sign * p[axis], holds & HOLD_P ? FADE_HOLD * excess : 0);
    h[1] = reach(-surface->side_sign * s[axis], holds & HOLD_S ? FADE_HOLD * excess : 0);
    h[2] = reach(-surface->side_sign * (p[axis] + at * (s[axis] - p[axis])),
                 FADE_HOLD * (off - surface->size[0]));
    return (h[0] >= 1) + (h[1] >= 1) + (h[2] >= 1) < 2;
}

void hold_jet(const wrap_surface *surface, const double *p, const double *s, int holds,
              const jet *excess, jet *share) {
    jet h[3], c, most[2], both, one;
    if (places(surface, p, s, h, &c) != 0) {
        *share = (jet){.value = 1};
        return;
    }
    jet_apply(excess, FADE_HOLD * excess->value, FADE_HOLD, 0, &most[0]);
    jet_apply(&c, FADE_HOLD * c.value, FADE_HOLD, 0, &most[1]);
    for (int k = 0; k < 3; k++) {
        const jet *band = &most[k == 2];
        int stays = k < 2 && !(holds & (k == 0 ? HOLD_P : HOLD_S));
        double at = reach(h[k].value, stays ? 0 : band->value);
        if (at <= 0 || at >= 1) {
            h[k] = (jet){.value = at >= 1};
            continue;
        }
        jet_divide(&h[k], band, &h[k]);
        jet_rise(&h[k], &h[k]);
    }
    jet_multiply(&h[0], &h[1], &both);
    jet_add(&h[0], 1, &h[1], &one);
    jet_add(&one, -2, &both, &one);
    jet_multiply(&h[2], &one, &one);
    jet_add(&both, 1, &one, share);
}
