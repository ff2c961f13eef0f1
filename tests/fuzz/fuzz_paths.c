/* SPDX-License-Identifier: Apache-2.0 */
/* Any path on a two-link arm, around any obstacles, in any pose: no crash, no endless search, and
 * what is finite in comes out finite and not shorter than the straight way between its ends. */
#include "fuzz.h"

#include "dynamics.h"
#include "numbers.h"
#include "route.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define N_POINTS 6
#define N_WRAPS 4
#define N_Q 3

static const double zero[] = {0};
static const double line[] = {0, 1};

/* Bytes of the input, as numbers: most within a metre, some anything. */
typedef struct bytes {
    const uint8_t *data;
    size_t size, at;
} bytes;

static uint32_t take(bytes *b, uint32_t below) {
    uint32_t value = b->at < b->size ? b->data[b->at] : 0;
    b->at++;
    return value % below;
}

static double take_number(bytes *b) {
    if (take(b, 16) == 15) {
        double any = 0;
        if (b->at + sizeof any <= b->size) {
            memcpy(&any, b->data + b->at, sizeof any);
        }
        b->at += sizeof any;
        return any;
    }
    return ((double)take(b, 256) + take(b, 256) / 256.0) / 256 - 0.5;
}

typedef struct arm {
    mhe_motion motions[N_Q];
    mhe_body bodies[2];
    mhe_coordinate coordinates[N_Q];
    mhe_path_point points[N_POINTS];
    mhe_obstacle obstacles[N_WRAPS];
    mhe_path_wrap wraps[N_WRAPS];
    mhe_path path;
    mhe_description d;
} arm;

static const double unit[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

static void take_point(bytes *b, mhe_path_point *point) {
    const mhe_function as_it_is = {zero, line, 1, 2};
    point->kind = (int32_t)take(b, 3);
    point->body = (int32_t)take(b, 3) - 1;
    for (int i = 0; i < 3; i++) {
        point->location[i] = take_number(b);
        point->coordinate[i] = (int32_t)take(b, N_Q + 1) - 1;
        point->function[i] = as_it_is;
    }
    point->lower = take_number(b);
    point->upper = take_number(b);
}

static void take_obstacle(bytes *b, mhe_obstacle *obstacle, mhe_path_wrap *wrap, int32_t index) {
    obstacle->name = "obstacle";
    obstacle->kind = (int32_t)take(b, 4);
    obstacle->body = (int32_t)take(b, 3) - 1;
    memcpy(obstacle->r, unit, sizeof unit);
    for (int i = 0; i < 3; i++) {
        obstacle->p[i] = take_number(b);
        obstacle->size[i] = fabs(take_number(b));
    }
    obstacle->side_axis = (int32_t)take(b, 4) - 1;
    obstacle->side_sign = take(b, 2) ? 1 : -1;
    wrap->obstacle = index;
    wrap->first = (int32_t)take(b, N_POINTS + 1) - 1;
    wrap->last = (int32_t)take(b, N_POINTS + 1) - 1;
}

static void take_arm(bytes *b, arm *a) {
    memset(a, 0, sizeof *a);
    for (int32_t i = 0; i < N_Q; i++) {
        a->motions[i].kind = MHE_MOTION_ROTATION;
        a->motions[i].coordinate = i;
        a->motions[i].axis[i] = 1;
        a->motions[i].function = (mhe_function){zero, line, 1, 2};
        a->coordinates[i].name = "q";
    }
    for (int i = 0; i < 2; i++) {
        mhe_body *body = &a->bodies[i];
        body->name = "body";
        body->parent = i - 1;
        body->n_motions = i == 0 ? 2 : 1;
        body->motions = a->motions + 2 * i;
        memcpy(body->joint_r, unit, sizeof unit);
        memcpy(body->body_r, unit, sizeof unit);
        body->joint_p[1] = i == 0 ? 0 : -0.3;
        body->mass = 1;
        body->com[1] = -0.1;
    }
    a->path = (mhe_path){.name = "path",
                         .n_points = 2 + (int32_t)take(b, N_POINTS - 1),
                         .n_wraps = (int32_t)take(b, N_WRAPS + 1),
                         .points = a->points,
                         .wraps = a->wraps};
    for (int i = 0; i < N_POINTS; i++) {
        take_point(b, &a->points[i]);
    }
    for (int32_t i = 0; i < N_WRAPS; i++) {
        take_obstacle(b, &a->obstacles[i], &a->wraps[i], i);
    }
    a->d = (mhe_description){.size = sizeof a->d,
                             .name = "arm",
                             .n_bodies = 2,
                             .n_coordinates = N_Q,
                             .bodies = a->bodies,
                             .coordinates = a->coordinates,
                             .n_paths = 1,
                             .n_obstacles = N_WRAPS,
                             .paths = &a->path,
                             .obstacles = a->obstacles};
}

/* Of a finite length of points that are all on and within a metre. */
static void check_length(const arm *a, const double *ends, double length) {
    double d[3] = {ends[3] - ends[0], ends[4] - ends[1], ends[5] - ends[2]};
    double straight = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (straight < 100 && a->path.n_points == 2 && !(length > straight - 1e-7)) {
        abort();
    }
}

static void evaluate(bytes *b, const arm *a, const tree *t, const route_set *routes,
                     route_work *work) {
    double q[N_Q], numbers[4 * N_Q], slopes[4 * N_Q], angle[N_Q], r[9 * N_Q], p[3 * N_Q];
    double length = 0, length_q[N_Q] = {0}, length_qq[N_Q * N_Q] = {0};
    for (int i = 0; i < N_Q; i++) {
        q[i] = 4 * take_number(b);
    }
    numbers_evaluate(&a->d, q, numbers);
    for (int32_t i = 0; i < t->n_joints; i++) {
        function_compose(t->joints[i].function, numbers + 4 * t->joints[i].number, slopes + 4 * i);
        angle[i] = slopes[4 * i];
    }
    dynamics_place(t, angle, r, p);
    path_pose pose = {.r = r, .p = p, .slopes = slopes};
    routes_lengths(t, routes, &pose, numbers, work, &length, length_q, length_qq);
    if (routes->n == 1 && isfinite(length) && work->n_stops >= 2 && work->stops[0].point == 0 &&
        work->stops[work->n_stops - 1].point == a->path.n_points - 1) {
        double ends[6];
        memcpy(ends, work->stops[0].at, 3 * sizeof *ends);
        memcpy(ends + 3, work->stops[work->n_stops - 1].at, 3 * sizeof *ends);
        int plain = 0; /* pieces between fixed points are counted elsewhere */
        for (int32_t k = 0; k < a->path.n_points; k++) {
            plain |= routes->routes[0].plain[k];
        }
        if (!plain) {
            check_length(a, ends, length);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    bytes b = {.data = data, .size = size};
    arm a;
    tree *t = NULL;
    route_set *routes = NULL;
    route_work work;
    take_arm(&b, &a);
    if (tree_create(&a.d, &t, NULL) != MHE_OK) {
        return 0;
    }
    if (routes_create(&a.d, t, NULL, &routes, NULL) == MHE_OK &&
        route_work_create(routes, NULL, &work) == MHE_OK) {
        for (int pose = 0; pose < 3; pose++) {
            evaluate(&b, &a, t, routes, &work);
        }
        route_work_free(&work);
    }
    routes_free(routes);
    tree_free(t);
    return 0;
}
