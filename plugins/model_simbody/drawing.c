/* SPDX-License-Identifier: Apache-2.0 */
/* drawing.c: points along a path, also where it lies on an obstacle. */
#include "context.h"
#include "vector.h"
#include "wrap/geodesic.h"

#include <math.h>
#include <string.h>

#define ON_OBSTACLE 8 /* points between the two where a string comes on and leaves */
#define ACCURACY 1e-6

typedef struct point_list {
    double *points;
    int32_t room, n;
} point_list;

static void list_add(point_list *list, const double *at) {
    if (list->n < list->room) {
        memcpy(list->points + 3 * list->n, at, 3 * sizeof *at);
    }
    list->n++;
}

/* The point `along` the string from where it comes on, in the obstacle's frame. */
static void point_on(const wrap_surface *surface, const double *a, const double *t, double along,
                     double *out) {
    wrap_surface round = *surface;
    geodesic_state end;
    if (surface->kind == MHE_OBSTACLE_CYLINDER) {
        double radius = surface->size[0], slope = (a[0] * t[1] - a[1] * t[0]) / (radius * radius);
        double c = cos(slope * along), s = sin(slope * along);
        out[0] = c * a[0] - s * a[1];
        out[1] = s * a[0] + c * a[1];
        out[2] = a[2] + t[2] * along;
        return;
    }
    if (surface->kind == MHE_OBSTACLE_SPHERE) {
        round.kind = MHE_OBSTACLE_ELLIPSOID;
        round.size[1] = round.size[2] = round.size[0];
    }
    geodesic_follow(&round, a, t, along, ACCURACY, &end);
    memcpy(out, end.y, 3 * sizeof *out);
}

static void string_points(const path_route *route, const route_work *work, int32_t w,
                          point_list *list) {
    const double *frame = work->obstacles + 12 * w;
    const wrap_string *string = &work->strings[w];
    double a[3], t[3],
        from[3] = {string->a[0] - frame[9], string->a[1] - frame[10], string->a[2] - frame[11]};
    for (int i = 0; i < 3; i++) { /* into the obstacle's frame */
        a[i] = frame[i] * from[0] + frame[3 + i] * from[1] + frame[6 + i] * from[2];
        t[i] = frame[i] * string->t[0][0] + frame[3 + i] * string->t[0][1] +
               frame[6 + i] * string->t[0][2];
    }
    list_add(list, string->a);
    for (int k = 1; k <= ON_OBSTACLE; k++) {
        double at[3];
        point_on(&route->wraps[w].surface, a, t, string->arc * k / (ON_OBSTACLE + 1), at);
        place3(frame, frame + 9, at, at);
        list_add(list, at);
    }
    list_add(list, string->b);
}

int32_t route_points(const path_route *route, const path_pose *pose, const double *numbers,
                     route_work *work, double *points, int32_t n) {
    point_list list = {.points = points, .room = n};
    course_find(route, pose, numbers, work);
    for (int32_t i = 0; i < work->n_stops; i++) {
        const course_stop *stop = &work->stops[i];
        if (stop->point >= 0) {
            list_add(&list, stop->at);
        } else if (i > 0 && work->stops[i - 1].wrap != stop->wrap && work->state[stop->wrap] > 0) {
            string_points(route, work, stop->wrap, &list);
        }
    }
    return list.n;
}

int32_t simbody_path_points(void *context, int32_t path, double *points, int32_t n) {
    simbody_context *c = context;
    path_pose pose = {.r = c->r, .p = c->p, .slopes = c->slopes};
    if (!c->placed || path < 0 || path >= c->description->n_paths) {
        return 0;
    }
    for (int32_t i = 0; i < c->routes->n; i++) {
        if (c->routes->routes[i].path == path) {
            const path_route *route = &c->routes->routes[i];
            return route_points(route->exact != NULL ? route->exact : route, &pose, c->numbers,
                                &c->route_work, points, n);
        }
    }
    const mhe_path *source = &c->description->paths[path];
    point_list list = {.points = points, .room = n};
    for (int32_t k = 0; k < source->n_points; k++) {
        double r[9], p[3], at[3];
        bodies_pose(c, source->points[k].body, r, p);
        place3(r, p, source->points[k].location, at);
        list_add(&list, at);
    }
    return list.n;
}
