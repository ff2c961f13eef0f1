/* SPDX-License-Identifier: Apache-2.0 */
/* release.c: paths with several obstacles of which one lets go, since a point is about to enter it.
 *
 * What fades there is what the path would be longer by than without that obstacle: with A its
 * length with it, C without (other obstacles may come on then), h how far the point is outside,
 * and S and k as in fade.h,
 *     L = C + S(h / (k (A - C))) (A - C).
 * Where the obstacle is alone, C is the straight line and this is what fade.h does. In a row of
 * strings it has to be whole courses: a string that fades pulls less than one that does not, so
 * that a joint between both would slide along, and soon slip off. */
#include "mix.h"
#include "vector.h"

#include <math.h>
#include <string.h>

#define GONE 1e-5 /* of the way over which it fades: nothing that counts is left */
#define FULL_TURN 6.283185307179586

/* How much longer the row of strings is, of which piece i is one, than a straight line; no less. */
static double row_excess(const path_route *route, const route_work *work, int32_t i) {
    int32_t first = i, last = i;
    double longer = 0, d[3];
    while (work->pieces[first].joint[0] >= 0) {
        first--;
    }
    while (work->pieces[last].joint[1] >= 0) {
        last++;
    }
    for (int32_t k = first; k <= last; k++) {
        int32_t w = work->pieces[k].wrap;
        if (work->state[w] > 0) {
            longer += wrap_length(&work->strings[w]);
            longer += work->strings[w].other > 0 ? FULL_TURN * route->wraps[w].surface.size[0] : 0;
        }
    }
    const double *p = work->places + 3 * work->pieces[first].point[0];
    const double *s = work->places + 3 * work->pieces[last].point[1];
    for (int k = 0; k < 3; k++) {
        d[k] = s[k] - p[k];
    }
    return longer - sqrt(dot3(d, d));
}

void near_add(const mix_case *c, int32_t only, mix_near *near) {
    const path_route *route = c->route;
    const route_work *work = c->work;
    for (int32_t i = 0; i < work->n_pieces && near != NULL && near->n < MIX_NEAR; i++) {
        const course_piece *piece = &work->pieces[i];
        int32_t w = piece->wrap, point[2] = {-1, -1};
        if (w < 0 || work->state[w] <= 0 || work->whole[w] || (only >= 0 && w != only)) {
            continue;
        }
        for (int e = 0; e < 2; e++) {
            int32_t k = piece->point[e];
            if (piece->joint[e] < 0 && route->points[k].place->link != route->wraps[w].link &&
                string_off(route, w, work, work->places + 3 * k) <
                    FADE_INSIDE * row_excess(route, work, i)) {
                point[e] = k;
            }
        }
        if (point[0] >= 0 || point[1] >= 0) {
            near->of[near->n].wrap = w;
            memcpy(near->of[near->n].point, point, sizeof point);
            near->n++;
        }
    }
}

static double whole_length(mix_case *c);

/* Of the next level, while `mark` of a wrap is set: work->out, the length is without it;
 * work->whole, its excess counts whole. */
static double length_while(mix_case *c, uint8_t *mark) {
    *mark = 1;
    c->level++;
    double value = whole_length(c);
    c->level--;
    *mark = 0;
    return value;
}

static double whole_length(mix_case *c) {
    mix_near near = {.n = 0};
    c->work->deepest = c->level + 1 == MIX_LEVELS;
    double value = rivals_length(c, c->work->deepest ? NULL : &near);
    c->work->deepest = 0;
    if (near.n == 0) {
        return value;
    }
    int32_t w = near.of[0].wrap;
    jet with, without, excess, most, share = {.value = 1}, h[2];
    if (near.n > 1) {
        value = length_while(c, &c->work->whole[w]);
    }
    mix_variable(c, 0, value, &with);
    for (int e = 0; e < 2; e++) {
        int32_t point = near.of[0].point[e];
        if (point >= 0) {
            double off =
                strand_outside(c->t, c->route, c->pose, c->work, w, point, c->gradient, c->hessian);
            c->stride = c->route->n_own;
            mix_variable(c, 1 + e, off, &h[e]);
        }
    }
    value = length_while(c, &c->work->out[w]);
    if (!(with.value - value > MIX_SAME)) {
        return mix_result(c, &with);
    }
    for (int e = 0; e < 2; e++) {
        if (near.of[0].point[e] >= 0 && h[e].value < GONE * FADE_INSIDE * (with.value - value)) {
            return value; /* the string's derivatives need not be finite */
        }
    }
    mix_variable(c, 3, value, &without);
    jet_add(&with, -1, &without, &excess);
    jet_apply(&excess, FADE_INSIDE * excess.value, FADE_INSIDE, 0, &most);
    for (int e = 0; e < 2; e++) {
        if (near.of[0].point[e] >= 0) {
            jet_divide(&h[e], &most, &h[e]);
            jet_rise(&h[e], &h[e]);
            jet_multiply(&share, &h[e], &share);
        }
    }
    jet_multiply(&share, &excess, &excess);
    jet_add(&without, 1, &excess, &without);
    return mix_result(c, &without);
}

double route_length(const tree *t, const path_route *route, const path_pose *pose,
                    const double *numbers, route_work *work, int32_t *stride, double *gradient,
                    double *hessian) {
    double value;
    if (route->n_wraps < 2) {
        course_find(route, pose, numbers, work);
        return strand_length(t, route, pose, work, stride, gradient, hessian);
    }
    mix_case c = {.t = t,
                  .route = route,
                  .pose = pose,
                  .numbers = numbers,
                  .work = work,
                  .gradient = gradient,
                  .hessian = hessian};
    value = whole_length(&c);
    *stride = c.stride;
    return value;
}
