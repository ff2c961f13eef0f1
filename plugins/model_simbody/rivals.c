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
#include "route.h"
#include "wrap/fade.h"

#include <string.h>

#define RIVALS 0.25
#define NEAR 1e-3  /* m */
#define SAME 1e-12 /* m */
#define VARIABLES 4

/* What of the route and the pose everything here needs. */
typedef struct rival_case {
    const tree *t;
    const path_route *route;
    const path_pose *pose;
    const double *numbers;
    route_work *work;
    double *gradient, *hessian; /* of the route; NULL: not wanted */
} rival_case;

/* ---- lengths as variables ---- */

static double *kept(const rival_case *c, int k) {
    size_t n = (size_t)c->route->n_own;
    return c->work->kept + (size_t)k * n * (n + 1);
}

/* Variable k: a length whose derivatives stand in c->gradient and c->hessian. */
static void variable(const rival_case *c, int k, double value, int32_t stride, jet *out) {
    int32_t n = c->route->n_own;
    double *to = kept(c, k);
    *out = (jet){.value = value};
    out->slope[k] = 1;
    if (c->gradient != NULL) {
        memcpy(to, c->gradient, sizeof *to * (size_t)n);
    }
    for (int32_t i = 0; i < n && c->hessian != NULL; i++) {
        memcpy(to + n * (i + 1), c->hessian + i * stride, sizeof *to * (size_t)n);
    }
}

/* Variable k: of the course that stands in work. */
static void course_variable(const rival_case *c, int k, jet *out) {
    int32_t stride;
    double value =
        strand_length(c->t, c->route, c->pose, c->work, &stride, c->gradient, c->hessian);
    variable(c, k, value, stride, out);
}

/* The length x, of the variables, with derivatives by the own coordinates. */
static double mixed(const rival_case *c, const jet *x) {
    int32_t n = c->route->n_own;
    if (c->gradient == NULL) {
        return x->value;
    }
    memset(c->gradient, 0, sizeof *c->gradient * (size_t)n);
    for (int k = 0; k < VARIABLES; k++) {
        for (int32_t i = 0; i < n && x->slope[k] != 0; i++) {
            c->gradient[i] += x->slope[k] * kept(c, k)[i];
        }
    }
    if (c->hessian == NULL) {
        return x->value;
    }
    memset(c->hessian, 0, sizeof *c->hessian * (size_t)(n * n));
    for (int k = 0; k < VARIABLES; k++) {
        const double *own = kept(c, k), *curve = own + n;
        for (int32_t i = 0; i < n * n && x->slope[k] != 0; i++) {
            c->hessian[i] += x->slope[k] * curve[i];
        }
        for (int l = 0; l < VARIABLES; l++) {
            const double *other = kept(c, l);
            for (int32_t i = 0; i < n && x->curve[k][l] != 0; i++) {
                for (int32_t j = 0; j < n; j++) {
                    c->hessian[i * n + j] += x->curve[k][l] * own[i] * other[j];
                }
            }
        }
    }
    return x->value;
}

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
static double mix_longer(const rival_case *c, const jet *a, const jet *b) {
    jet apart, share;
    jet_add(a, -1, b, &apart);
    jet_apply(&apart, 0.5 * (apart.value / NEAR + 1), 0.5 / NEAR, 0, &share);
    jet_rise(&share, &share);
    jet_multiply(&share, &apart, &apart);
    jet_add(b, 1, &apart, &apart);
    return mixed(c, &apart);
}

/* A is that without `lost`, which held no string in a row with the other one. */
static double mix_lost(const rival_case *c, int32_t lost, const jet *a) {
    route_work *work = c->work;
    jet b;
    if (!course_touches(c->route, lost, work)) {
        return mixed(c, a);
    }
    memset(work->without, 1, (size_t)c->route->n_wraps);
    work->without[lost] = 0;
    course_without(c->route, c->pose, c->numbers, work);
    if (work->state[lost] <= 0) {
        return mixed(c, a);
    }
    course_variable(c, 1, &b);
    return mix_longer(c, a, &b);
}

static double mix_rivals(const rival_case *c, int32_t on, int32_t off, const jet *a) {
    route_work *work = c->work;
    jet b, without, share, step;
    work->without[on] = 1;
    course_without(c->route, c->pose, c->numbers, work);
    course_variable(c, 1, &b);
    int over = work->state[off] > 0, free = over && !course_touches(c->route, on, work);
    if (over && !free && c->route->n_wraps == 2) {
        return mix_longer(c, a, &b);
    }
    if (free) {
        work->without[off] = 1;
        course_without(c->route, c->pose, c->numbers, work);
        course_variable(c, 2, &without);
        free = b.value - without.value > SAME &&
               a->value - without.value < RIVALS * (b.value - without.value);
    }
    if (!free) {
        return mixed(c, a);
    }
    jet_add(a, -1, &without, &share);
    jet_add(&b, -1, &without, &step);
    jet_apply(&step, RIVALS * step.value, RIVALS, 0, &step);
    jet_divide(&share, &step, &share);
    jet_rise(&share, &share);
    jet_add(a, -1, &b, &step);
    jet_multiply(&share, &step, &step);
    jet_add(&b, 1, &step, &b); /* B + S (A - B) */
    return mixed(c, &b);
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

static double mix_held(const rival_case *c, int32_t w, const jet *a) {
    route_work *work = c->work;
    jet alone, whole, least, share, step;
    course_without(c->route, c->pose, c->numbers, work);
    if (work->state[w] <= 0 || !work->strings[w].held) {
        return mixed(c, a);
    }
    course_variable(c, 1, &alone);
    work->strings[w].held = WRAP_HELD_WHOLE;
    course_variable(c, 2, &whole);
    work->strings[w].held = WRAP_HELD_NOT;
    course_variable(c, 3, &least);
    if (!(whole.value - alone.value > SAME) || !(whole.value - least.value > SAME)) {
        return mixed(c, a);
    }
    jet_add(&alone, -1, &least, &share);
    jet_add(&whole, -1, &least, &step);
    jet_divide(&share, &step, &share);
    jet_add(a, -1, &least, &step);
    jet_multiply(&share, &step, &step);
    jet_add(&least, 1, &step, &least);
    return mixed(c, &least);
}

double route_length(const tree *t, const path_route *route, const path_pose *pose,
                    const double *numbers, route_work *work, int32_t *stride, double *gradient,
                    double *hessian) {
    course_find(route, pose, numbers, work);
    double value = strand_length(t, route, pose, work, stride, gradient, hessian);
    int32_t off = -1, on = route->n_wraps > 1 ? rival_of(route, work, &off) : -1;
    int32_t held = route->n_wraps > 1 && on < 0 ? row_held(work) : -1;
    int32_t lost = route->n_wraps == 2 && on < 0 && held < 0 ? work->lost : -1;
    if (on < 0 && held < 0 && lost < 0) {
        return value;
    }
    rival_case c = {t, route, pose, numbers, work, gradient, hessian};
    jet a;
    variable(&c, 0, value, *stride, &a);
    *stride = route->n_own;
    if (lost >= 0) {
        return mix_lost(&c, lost, &a);
    }
    return on >= 0 ? mix_rivals(&c, on, off, &a) : mix_held(&c, held, &a);
}
