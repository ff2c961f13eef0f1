/* SPDX-License-Identifier: Apache-2.0 */
/* route.c: routes of a description, their scratch, and their shares in the lengths. */
#include "route.h"

#include "mix.h"
#include "numbers.h"
#include "vector.h"

#include <stdlib.h>
#include <string.h>

static const tree_place ground = {.link = -1, .r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};

static int piece_may_wrap(const mhe_path *path, int32_t k) {
    for (int32_t w = 0; w < path->n_wraps; w++) {
        const mhe_path_wrap *wrap = &path->wraps[w];
        if ((wrap->first < 0 || wrap->first <= k) && (wrap->last < 0 || wrap->last >= k + 1)) {
            return 1;
        }
    }
    return 0;
}

int route_is_plain(const mhe_path *path, int32_t k) {
    return k + 1 < path->n_points && path->points[k].kind == MHE_POINT_FIXED &&
           path->points[k + 1].kind == MHE_POINT_FIXED && !piece_may_wrap(path, k);
}

static int path_is_route(const mhe_path *path) {
    if (path->length != NULL && path->n_points == 0) {
        return 1;
    }
    for (int32_t k = 0; k + 1 < path->n_points; k++) {
        if (!route_is_plain(path, k)) {
            return 1;
        }
    }
    return 0;
}

/* ---- what a length depends on ---- */

static void own_add(path_route *route, int32_t coordinate) {
    if (route->local[coordinate] < 0) {
        route->local[coordinate] = route->n_own;
        route->own[route->n_own++] = coordinate;
    }
}

static int32_t ancestor(const tree *t, int32_t a, int32_t b) {
    while (a != b) {
        if (a > b) {
            a = t->joints[a].parent;
        } else {
            b = t->joints[b].parent;
        }
    }
    return a;
}

static int32_t route_link(const path_route *route, int32_t i) {
    return i < route->n_points ? route->points[i].place->link
                               : route->wraps[i - route->n_points].link;
}

/* All coordinates between the links that it touches. */
static void own_find(const mhe_description *d, const tree *t, path_route *route) {
    int32_t n = route->n_points + route->n_wraps;
    int32_t meet = n > 0 ? route_link(route, 0) : -1;
    for (int32_t i = 0; i < t->n_q; i++) {
        route->local[i] = -1;
    }
    for (int32_t i = 1; i < n; i++) {
        meet = ancestor(t, meet, route_link(route, i));
    }
    for (int32_t i = 0; i < n; i++) {
        for (int32_t up = route_link(route, i); up != meet; up = t->joints[up].parent) {
            own_add(route, t->joints[up].coordinate);
        }
    }
    for (int32_t k = 0; k < route->n_points; k++) {
        route_point *point = &route->points[k];
        for (int i = 0; i < 3; i++) {
            int32_t number = point->source->coordinate[i];
            point->local[i] = -1;
            if (point->source->kind == MHE_POINT_MOVING && number >= 0) {
                int32_t root = number_root(d, number);
                own_add(route, root);
                point->local[i] = route->local[root];
            }
        }
    }
    for (int32_t k = 0; route->length != NULL && k < route->length->n; k++) {
        int32_t root = number_root(d, route->length->coordinate[k]);
        own_add(route, root);
        route->length_local[k] = route->local[root];
    }
}

/* ---- making ---- */

static void wrap_make(const mhe_description *d, const tree *t, const mhe_path_wrap *source,
                      route_wrap *out) {
    const mhe_obstacle *obstacle = &d->obstacles[source->obstacle];
    const tree_place *place = obstacle->body < 0 ? &ground : &t->bodies[obstacle->body];
    out->surface.kind = obstacle->kind;
    out->surface.side_axis = obstacle->side_axis;
    out->surface.side_sign = obstacle->side_sign;
    memcpy(out->surface.size, obstacle->size, sizeof out->surface.size);
    out->link = place->link;
    out->first = source->first;
    out->last = source->last;
    multiply3(place->r, obstacle->r, out->r);
    place3(place->r, place->p, obstacle->p, out->p);
}

static void points_make(const tree *t, const mhe_path *path, int whole, path_route *out) {
    for (int32_t k = 0; k < path->n_points; k++) {
        const mhe_path_point *source = &path->points[k];
        route_point *point = &out->points[k];
        point->source = source;
        point->place = source->body < 0 ? &ground : &t->bodies[source->body];
        place3(point->place->r, point->place->p, source->location, point->at);
        out->plain[k] = (uint8_t)(!whole && route_is_plain(path, k));
    }
}

static mhe_status route_make(const mhe_description *d, const tree *t, int32_t index, int whole,
                             path_route *out) {
    const mhe_path *path = &d->paths[index];
    size_t n_factors = path->n_points == 0 ? (size_t)path->length->n : 0;
    *out = (path_route){.path = index, .n_points = path->n_points, .n_wraps = path->n_wraps};
    out->points = calloc((size_t)path->n_points + 1, sizeof *out->points);
    out->plain = calloc((size_t)path->n_points + 1, sizeof *out->plain);
    out->wraps = calloc((size_t)path->n_wraps + 1, sizeof *out->wraps);
    out->own = calloc((size_t)t->n_q + 1, sizeof *out->own);
    out->local = calloc((size_t)t->n_q + 1, sizeof *out->local);
    out->length_local = calloc(n_factors + 1, sizeof *out->length_local);
    if (out->points == NULL || out->plain == NULL || out->wraps == NULL || out->own == NULL ||
        out->local == NULL || out->length_local == NULL) {
        return MHE_E_MEMORY;
    }
    if (path->n_points == 0) {
        out->length = path->length;
        for (int32_t i = 0; i < out->length->n * out->length->n_terms; i++) {
            int32_t e = out->length->exponent[i];
            out->degree = e > out->degree ? e : out->degree;
        }
    }
    points_make(t, path, whole, out);
    for (int32_t w = 0; w < path->n_wraps; w++) {
        wrap_make(d, t, &path->wraps[w], &out->wraps[w]);
    }
    own_find(d, t, out);
    return MHE_OK;
}

static void most(int32_t *value, int32_t other) {
    *value = other > *value ? other : *value;
}

mhe_status routes_create(const mhe_description *d, const tree *t, const mhe_path *fitted,
                         route_set **out, mhe_error *err) {
    route_set *set = calloc(1, sizeof *set);
    *out = set;
    if (set == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for the paths");
    }
    set->routes = calloc((size_t)d->n_paths + 1, sizeof *set->routes);
    for (int32_t i = 0; i < d->n_paths && set->routes != NULL; i++) {
        int whole = fitted != NULL && fitted[i].n_points != d->paths[i].n_points;
        if (fitted != NULL ? !whole : !path_is_route(&d->paths[i])) {
            continue;
        }
        path_route *made = &set->routes[set->n++];
        if (route_make(d, t, i, whole, made) != MHE_OK) {
            return mhe_fail(err, MHE_E_MEMORY, "no memory for the paths");
        }
        most(&set->n_points, made->n_points);
        most(&set->n_wraps, made->n_wraps);
        most(&set->n_own, made->n_own + 2 * made->n_wraps);
        most(&set->n_factors, made->length != NULL ? made->length->n : 0);
        for (int32_t k = 0; made->length != NULL && k < made->length->n; k++) {
            most(&set->n_numbers, made->length->coordinate[k] + 1);
        }
    }
    for (int32_t i = 0; i < t->n_joints; i++) { /* way in, way out, and what moves a point */
        int32_t depth = 0;
        for (int32_t up = i; up >= 0; up = t->joints[up].parent) {
            depth++;
        }
        most(&set->n_steps, 2 * depth + 5);
    }
    return set->routes != NULL ? MHE_OK : mhe_fail(err, MHE_E_MEMORY, "no memory for the paths");
}

void routes_free(route_set *set) {
    if (set == NULL) {
        return;
    }
    for (int32_t i = 0; i < set->n && set->routes != NULL; i++) {
        path_route *r = &set->routes[i];
        free(r->points);
        free(r->plain);
        free(r->wraps);
        free(r->own);
        free(r->local);
        free(r->length_local);
    }
    free(set->routes);
    free(set);
}

void routes_join(route_set *set, const route_set *whole) {
    for (int32_t i = 0; i < set->n; i++) {
        for (int32_t k = 0; k < whole->n; k++) {
            if (whole->routes[k].path == set->routes[i].path) {
                set->routes[i].exact = &whole->routes[k];
            }
        }
    }
}

void routes_pattern(const route_set *set, int32_t n_q, uint8_t *pattern) {
    for (int32_t i = 0; i < set->n; i++) {
        for (int32_t k = 0; k < set->routes[i].n_own; k++) {
            pattern[set->routes[i].path * n_q + set->routes[i].own[k]] = 1;
        }
    }
}

/* ---- scratch ---- */

mhe_status route_work_create(const route_set *routes, const route_set *other, route_work *out) {
    route_set both = *routes, *set = &both;
    if (other != NULL) {
        most(&both.n_points, other->n_points);
        most(&both.n_wraps, other->n_wraps);
        most(&both.n_own, other->n_own);
    }
    size_t n_p = (size_t)set->n_points, n_w = (size_t)set->n_wraps, n = (size_t)set->n_own;
    size_t n_s = n_p + 2 * n_w + 1, n_f = (size_t)set->n_factors;
    memset(out, 0, sizeof *out);
    struct {
        void *field;
        size_t bytes;
    } parts[] = {{&out->places, sizeof(double) * 3 * n_p},
                 {&out->slopes, sizeof(double) * 12 * n_p},
                 {&out->obstacles, sizeof(double) * 12 * n_w},
                 {&out->tried, sizeof(double) * 6 * n_w},
                 {&out->hopeless, sizeof(double) * 6 * n_w},
                 {&out->newton, sizeof(double) * 2 * n_w * (2 * n_w + 1)},
                 {&out->gradient, sizeof(double) * n},
                 {&out->hessian, sizeof(double) * n * n},
                 {&out->kept, sizeof(double) * MIX_LEVELS * MIX_VARIABLES * n * (n + 1)},
                 {&out->polynomial, sizeof(double) * n_f * (3 * POLYNOMIAL_POWERS + 1 + n_f)},
                 {&out->factors, sizeof(double *) * n_f},
                 {&out->shared, sizeof(shared_factors) * (size_t)set->n_numbers},
                 {&out->strings, sizeof(wrap_string) * n_w},
                 {&out->joints, sizeof(course_joint) * n_w},
                 {&out->row_joints, sizeof(course_joint) * 2 * n_w},
                 {&out->row_strings, sizeof(wrap_string) * 2 * n_w},
                 {&out->row_states, sizeof(int32_t) * 2 * n_w},
                 {&out->steps[0], sizeof(strand_step) * (size_t)set->n_steps},
                 {&out->steps[1], sizeof(strand_step) * (size_t)set->n_steps},
                 {&out->stops, sizeof(course_stop) * n_s},
                 {&out->pieces, sizeof(course_piece) * n_s},
                 {&out->state, sizeof(int32_t) * n_w},
                 {&out->blocker, sizeof(int32_t) * n_w},
                 {&out->order, sizeof(int32_t) * n_w},
                 {&out->without, n_w},
                 {&out->out, n_w},
                 {&out->whole, n_w}};
    size_t total = 64, n_parts = sizeof parts / sizeof parts[0];
    for (size_t i = 0; i < n_parts; i++) {
        parts[i].bytes = (parts[i].bytes + 15) / 16 * 16;
        total += parts[i].bytes;
    }
    out->memory = calloc(1, total);
    if (out->memory == NULL) {
        return MHE_E_MEMORY;
    }
    char *next = out->memory;
    for (size_t i = 0; i < n_parts; i++) {
        memcpy(parts[i].field, &next, sizeof next); /* all object pointers are alike here */
        next += parts[i].bytes;
    }
    return MHE_OK;
}

void route_work_free(route_work *work) {
    free(work->memory);
    memset(work, 0, sizeof *work);
}

/* ---- evaluation ---- */

void routes_lengths(const tree *t, const route_set *set, const path_pose *pose,
                    const double *numbers, route_work *work, double *length, double *length_q,
                    double *length_qq) {
    size_t n_q = (size_t)t->n_q;
    int derive = length_q != NULL || length_qq != NULL;
    double *gradient = derive ? work->gradient : NULL, *hessian = derive ? work->hessian : NULL;
    for (int32_t i = 0; i < set->n_numbers; i++) {
        work->shared[i].degree = -1;
    }
    for (int32_t i = 0; i < set->n; i++) {
        const path_route *route = &set->routes[i];
        double value;
        if (route->exact != NULL && polynomial_is_left(route, numbers)) {
            route = route->exact;
            work->left++;
        }
        int32_t stride = route->n_own;
        if (route->length != NULL) {
            value = polynomial_length(route, numbers, work, gradient, hessian);
        } else {
            value = route_length(t, route, pose, numbers, work, &stride, gradient,
                                 length_qq != NULL ? hessian : NULL);
        }
        size_t row = (size_t)route->path;
        if (length != NULL) {
            length[row] += value;
        }
        for (int32_t a = 0; a < route->n_own && derive; a++) {
            size_t at = (size_t)route->own[a];
            if (length_q != NULL) {
                length_q[row * n_q + at] += gradient[a];
            }
            for (int32_t b = 0; b < route->n_own && length_qq != NULL; b++) {
                length_qq[(row * n_q + at) * n_q + (size_t)route->own[b]] +=
                    hessian[a * stride + b];
            }
        }
    }
}
