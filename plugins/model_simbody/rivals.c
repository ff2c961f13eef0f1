/* SPDX-License-Identifier: Apache-2.0 */
/* rivals.c: lengths of paths whose obstacles are in each other's way.
 *
 * Where OpenSim's rules take one obstacle or the other, a path's length would jump. With A the
 * length that they give, S as in fade.h, and k = RIVALS:
 *
 * - A string that ends inside another obstacle keeps that one off the path. As long as it hardly
 *   touches its own, the path would go over the other one alone, and be longer: with C without both
 *   and B without the one in the way, by itself not touched then,
 *       L = A + (1 - S((A - C) / (k (B - C)))) (B - A).
 * - Where of two obstacles the one that is off would be touched by the course over the other, and
 *   they have no course over both, the path is as long as the longer of both alone, rounded where
 *   they differ by less than NEAR: with D = A - B, L = B + S((D / NEAR + 1) / 2) D.
 * - Of strings in a row one may be held on the side asked for. Where it would not be without the
 *   others they do not hold it either: with C without them, D that of the string held then and E
 *   of the shortest one,
 *       L = E + (C - E) / (D - E) (A - E).
 *
 * All of them are lengths of courses and have exact derivatives; so has L. */
#include "mix.h"

#include <string.h>

#define RIVALS 0.25
#define NEAR 1e-3 /* m */

/* ---- one or the other ---- */

/* A wrap on the course whose string ends inside the obstacle of *kept_off; -1. */
static int32_t rival_of(const path_route *route, const route_work *work, int32_t *kept_off) {
    for (int32_t w = 0; w < route->n_wraps; w++) {
        int32_t u = work->blocker[w];
        if (work->state[w] == WRAP_INSIDE && u >= 0 && work->state[u] > 0) {
            *kept_off = w;
            return u;
        }
    }
    return -1;
}

/* The longer one. */
static double mix_longer(mix_case *c, const jet *a, const jet *b) {
    jet apart, share;
    jet_add(a, -1, b, &apart);
    jet_apply(&apart, 0.5 * (apart.value / NEAR + 1), 0.5 / NEAR, 0, &share);
    jet_rise(&share, &share);
    jet_multiply(&share, &apart, &apart);
    jet_add(b, 1, &apart, &apart);
    return mix_result(c, &apart);
}

/* A is that without `lost`, which held no string in a row with the other one. */
static double mix_lost(mix_case *c, int32_t lost, const jet *a, mix_near *near) {
    route_work *work = c->work;
    jet b;
    if (!course_touches(c->route, lost, work)) {
        return mix_result(c, a);
    }
    memset(work->without, 1, (size_t)c->route->n_wraps);
    work->without[lost] = work->out[lost];
    course_without(c->route, c->pose, c->numbers, work);
    if (work->state[lost] <= 0) {
        return mix_result(c, a);
    }
    near_add(c, lost, near);
    mix_course(c, 1, &b);
    return mix_longer(c, a, &b);
}

static double mix_rivals(mix_case *c, int32_t on, int32_t off, const jet *a, mix_near *near) {
    route_work *work = c->work;
    jet b, without, share, step;
    work->without[on] = 1;
    course_without(c->route, c->pose, c->numbers, work);
    near_add(c, off, near);
    mix_course(c, 1, &b);
    int over = work->state[off] > 0, free = over && !course_touches(c->route, on, work);
    if (over && !free && c->route->n_wraps == 2) {
        return mix_longer(c, a, &b);
    }
    if (free) {
        work->without[off] = 1;
        course_without(c->route, c->pose, c->numbers, work);
        mix_course(c, 2, &without);
        free = b.value - without.value > MIX_SAME &&
               a->value - without.value < RIVALS * (b.value - without.value);
    }
    if (!free) {
        return mix_result(c, a);
    }
    jet_add(a, -1, &without, &share);
    jet_add(&b, -1, &without, &step);
    jet_apply(&step, RIVALS * step.value, RIVALS, 0, &step);
    jet_divide(&share, &step, &share);
    jet_rise(&share, &share);
    jet_add(a, -1, &b, &step);
    jet_multiply(&share, &step, &step);
    jet_add(&b, 1, &step, &b); /* B + S (A - B) */
    return mix_result(c, &b);
}

/* ---- held in a row ---- */

/* A wrap of a row that is held on its side; marks the others of its row. -1: none. */
static int32_t row_held(route_work *work) {
    for (int32_t i = 0; i < work->n_pieces; i++) {
        int32_t w = work->pieces[i].wrap, first = i, last = i;
        if (w < 0 || work->state[w] <= 0 || !work->strings[w].held) {
            continue;
        }
        while (work->pieces[first].joint[0] >= 0) {
            first--;
        }
        while (work->pieces[last].joint[1] >= 0) {
            last++;
        }
        for (int32_t k = first; k <= last && first < last; k++) {
            work->without[work->pieces[k].wrap] = work->pieces[k].wrap != w;
        }
        if (first < last) {
            return w;
        }
    }
    return -1;
}

static double mix_held(mix_case *c, int32_t w, const jet *a) {
    route_work *work = c->work;
    jet alone, whole, least, share, step;
    course_without(c->route, c->pose, c->numbers, work);
    if (work->state[w] <= 0 || !work->strings[w].held) {
        return mix_result(c, a);
    }
    mix_course(c, 1, &alone);
    work->strings[w].held = WRAP_HELD_WHOLE;
    mix_course(c, 2, &whole);
    work->strings[w].held = WRAP_HELD_NOT;
    mix_course(c, 3, &least);
    if (!(whole.value - alone.value > MIX_SAME) || !(whole.value - least.value > MIX_SAME)) {
        return mix_result(c, a);
    }
    jet_add(&alone, -1, &least, &share);
    jet_add(&whole, -1, &least, &step);
    jet_divide(&share, &step, &share);
    jet_add(a, -1, &least, &step);
    jet_multiply(&share, &step, &step);
    jet_add(&least, 1, &step, &least);
    return mix_result(c, &least);
}

double rivals_length(mix_case *c, mix_near *near) {
    const path_route *route = c->route;
    route_work *work = c->work;
    course_find(route, c->pose, c->numbers, work);
    near_add(c, -1, near);
    double value = strand_length(c->t, route, c->pose, work, &c->stride, c->gradient, c->hessian);
    int32_t off = -1, on = rival_of(route, work, &off);
    int32_t held = on < 0 ? row_held(work) : -1;
    int32_t lost = route->n_wraps == 2 && on < 0 && held < 0 ? work->lost : -1;
    if (on < 0 && held < 0 && lost < 0) {
        return value;
    }
    jet a;
    mix_variable(c, 0, value, &a);
    if (lost >= 0) {
        return mix_lost(c, lost, &a, near);
    }
    return on >= 0 ? mix_rivals(c, on, off, &a, near) : mix_held(c, held, &a);
}
