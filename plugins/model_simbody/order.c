/* SPDX-License-Identifier: Apache-2.0 */
/* order.c: which obstacles may be on a path's course: those that hold no string are not, so that
 * others are where they would be without them. */
#include "route.h"
#include "vector.h"

#include <math.h>
#include <string.h>

#define FULL_TURN 6.283185307179586

/* The wrap is not tried again. */
static void order_bar(route_work *work, int32_t w) {
    int32_t n = 0;
    for (int32_t k = 0; k < work->n_order; k++) {
        if (work->order[k] != w) {
            work->order[n++] = work->order[k];
        }
    }
    work->n_order = n;
}

/* Whether no string of a row ends inside the next one's obstacle. */
static int course_is_clear(const path_route *route, const route_work *work) {
    for (int32_t i = 0; i + 1 < work->n_pieces; i++) {
        int32_t u = work->pieces[i].wrap, w = work->pieces[i + 1].wrap;
        if (work->pieces[i].joint[1] < 0 || work->pieces[i + 1].joint[0] < 0) {
            continue;
        }
        if ((work->state[u] > 0 && string_off(route, w, work, work->strings[u].b) < 0) ||
            (work->state[w] > 0 && string_off(route, u, work, work->strings[w].a) < 0)) {
            return 0;
        }
    }
    return 1;
}

/* A wrap that is on the course but without a string, or was in the way of one without being on it;
 * -1: none. The last in the order goes first. */
static int32_t order_idle(const route_work *work) {
    for (int32_t k = work->n_order - 1; k >= 0; k--) {
        int32_t u = work->order[k];
        if (work->state[u] > 0) {
            continue;
        }
        for (int32_t i = 0; i < work->n_stops; i++) {
            if (work->stops[i].wrap == u) {
                return u;
            }
        }
        for (int32_t m = 0; m < work->n_order; m++) {
            int32_t w = work->order[m];
            if (work->state[w] == WRAP_INSIDE && work->blocker[w] == u) {
                return u;
            }
        }
    }
    return -1;
}

/* A wrap beside other strings that only its side, and not the way, makes go a whole turn about. */
static int32_t order_about(const path_route *route, const route_work *work) {
    for (int32_t i = 0; i < work->n_pieces; i++) {
        const course_piece *piece = &work->pieces[i];
        int32_t w = piece->wrap;
        if (w < 0 || work->state[w] != WRAP_POSSIBLE ||
            (piece->joint[0] < 0 && piece->joint[1] < 0)) {
            continue;
        }
        const double *ends = work->tried + 6 * w;
        double d[3] = {ends[3] - ends[0], ends[4] - ends[1], ends[5] - ends[2]};
        double longer = wrap_length(&work->strings[w]) - sqrt(dot3(d, d));
        if (longer > FULL_TURN * route->wraps[w].surface.size[0]) {
            return w;
        }
    }
    return -1;
}

/* The course without what holds no string. 0: each string of a row is clear of the others. */
static int course_try(const path_route *route, const path_pose *pose, const double *numbers,
                      int pushes, route_work *work) {
    int32_t idle = -1;
    work->lost = -1;
    work->pushes = pushes;
    work->pushed = 0;
    work->n_order = 0;
    for (int32_t w = 0; w < route->n_wraps; w++) {
        if (!work->without[w]) {
            work->order[work->n_order++] = w;
        }
    }
    do {
        course_lay(route, pose, numbers, work);
        idle = route->n_wraps > 1 ? order_about(route, work) : -1;
        if (idle < 0 && work->n_joints > 0) {
            idle = joints_tighten(route, work);
        }
        idle = idle < 0 ? order_idle(work) : idle;
        if (idle >= 0) {
            work->lost = work->n_joints > 0 ? idle : work->lost;
            order_bar(work, idle);
        }
    } while (idle >= 0);
    return course_is_clear(route, work) ? 0 : -1;
}

void course_without(const path_route *route, const path_pose *pose, const double *numbers,
                    route_work *work) {
    if (course_try(route, pose, numbers, route->n_wraps > 1, work) != 0 && work->pushed) {
        (void)course_try(route, pose, numbers, 0, work);
    }
}

void course_find(const path_route *route, const path_pose *pose, const double *numbers,
                 route_work *work) {
    memcpy(work->without, work->out, (size_t)route->n_wraps);
    course_obstacles(route, pose, work);
    course_without(route, pose, numbers, work);
}
