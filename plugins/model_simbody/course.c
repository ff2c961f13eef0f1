/* SPDX-License-Identifier: Apache-2.0 */
/* course.c: which points a path passes and which obstacles it touches, in which order.
 *
 * As OpenSim has it: the obstacles are taken in the order listed; each is tried with every piece of
 * the path as it is so far, within its range of points; the first piece that crosses it wraps, or
 * else the one that gets least longer. With several obstacles this is repeated until it stays the
 * same. Strings in a row then are pulled tight together (tighten.c). Nothing is remembered from
 * call to call. */
#include "numbers.h"
#include "route.h"
#include "vector.h"

#include <math.h>
#include <string.h>

#define MAX_PASSES 8

static void link_place(const path_pose *pose, int32_t link, const double *at, double *out) {
    if (link < 0) {
        memcpy(out, at, 3 * sizeof *out);
    } else {
        place3(pose->r + 9 * link, pose->p + 3 * link, at, out);
    }
}

static int point_is_on(const mhe_path_point *point, const double *numbers) {
    if (point->kind != MHE_POINT_CONDITIONAL) {
        return 1;
    }
    double value = numbers[4 * point->coordinate[0]];
    return value >= point->lower && value <= point->upper;
}

/* Places point k, and keeps the slopes of what moves it. */
static void place_point(const path_route *route, int32_t k, const path_pose *pose,
                        const double *numbers, route_work *work) {
    const route_point *point = &route->points[k];
    double at[3] = {point->at[0], point->at[1], point->at[2]};
    if (point->source->kind == MHE_POINT_MOVING) {
        double *slopes = work->slopes + 12 * k;
        memset(slopes, 0, 12 * sizeof *slopes);
        memcpy(at, point->source->location, sizeof at);
        for (int i = 0; i < 3; i++) {
            if (point->source->coordinate[i] >= 0) {
                function_compose(&point->source->function[i],
                                 numbers + 4 * point->source->coordinate[i], slopes + 4 * i);
                at[i] = slopes[4 * i];
            }
        }
        place3(point->place->r, point->place->p, at, at);
    }
    link_place(pose, point->place->link, at, work->places + 3 * k);
}

static void place_obstacle(const route_wrap *wrap, const path_pose *pose, double *out) {
    link_place(pose, wrap->link, wrap->p, out + 9);
    if (wrap->link < 0) {
        memcpy(out, wrap->r, sizeof wrap->r);
    } else {
        multiply3(pose->r + 9 * wrap->link, wrap->r, out);
    }
}

/* ---- which obstacle where ---- */

static void stops_remove(route_work *work, int32_t w) {
    int32_t n = 0;
    for (int32_t i = 0; i < work->n_stops; i++) {
        if (work->stops[i].wrap != w) {
            work->stops[n++] = work->stops[i];
        }
    }
    work->n_stops = n;
}

static void stops_insert(route_work *work, int32_t after, int32_t w, int32_t link) {
    memmove(work->stops + after + 3, work->stops + after + 1,
            sizeof *work->stops * (size_t)(work->n_stops - after - 1));
    for (int32_t k = 0; k < 2; k++) {
        course_stop *stop = &work->stops[after + 1 + k];
        *stop = (course_stop){.point = -1, .wrap = w, .link = link};
        memcpy(stop->at, k ? work->strings[w].b : work->strings[w].a, sizeof stop->at);
    }
    work->n_stops += 2;
}

/* First and last stop of the wrap's range of points; 0: there is a piece between them. */
static int stops_range(const route_wrap *wrap, const route_work *work, int32_t *from, int32_t *to) {
    *from = -1;
    *to = -1;
    for (int32_t i = 0; i < work->n_stops; i++) {
        int32_t point = work->stops[i].point;
        if (point < 0 || (wrap->first >= 0 && point < wrap->first) ||
            (wrap->last >= 0 && point > wrap->last)) {
            continue;
        }
        *from = *from < 0 ? i : *from;
        *to = i;
    }
    return *from >= 0 && *to > *from ? 0 : -1;
}

static double distance3(const double *a, const double *b) {
    double d[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    return sqrt(dot3(d, d));
}

/* One piece that wrap w may go over: what became of it in `string`. */
static int32_t wrap_try(const path_route *route, int32_t w, int32_t before, const course_stop *a,
                        const course_stop *b, route_work *work, wrap_string *string) {
    const double *tried = work->tried + 6 * w;
    const wrap_string *last = before > 0 ? &work->strings[w] : NULL;
    const wrap_string *guess = work->afresh ? NULL : last;
    if (last != NULL && memcmp(tried, a->at, sizeof a->at) == 0 &&
        memcmp(tried + 3, b->at, sizeof b->at) == 0) {
        *string = *last;
        return before;
    }
    if (work->pushes && (a->wrap >= 0 || b->wrap >= 0)) {
        /* where another string ends inside, the two may push each other aside */
        double ends[2][3];
        memcpy(ends[0], a->at, sizeof ends[0]);
        memcpy(ends[1], b->at, sizeof ends[1]);
        int pushed = a->wrap >= 0 && string_clears(route, w, work, ends[0]);
        pushed |= b->wrap >= 0 && string_clears(route, w, work, ends[1]);
        work->pushed |= pushed;
        return string_between(route, w, ends[0], ends[1], guess, work, string);
    }
    double *hopeless = work->hopeless + 6 * w;
    if (last == NULL && memcmp(hopeless, a->at, sizeof a->at) == 0 &&
        memcmp(hopeless + 3, b->at, sizeof b->at) == 0) {
        return WRAP_UNSOLVED;
    }
    int32_t state = string_between(route, w, a->at, b->at, guess, work, string);
    if (state == WRAP_UNSOLVED) { /* which takes longest to find out */
        memcpy(hopeless, a->at, sizeof a->at);
        memcpy(hopeless + 3, b->at, sizeof b->at);
    }
    return state;
}

/* Puts wrap w where it belongs in the course without it. 1: there it was. */
static int wrap_insert(const path_route *route, int32_t w, route_work *work) {
    const route_wrap *wrap = &route->wraps[w];
    int32_t from, to, best = -1, before = work->state[w], now = WRAP_NONE, which = 0;
    int32_t blocker = -1;
    double least = INFINITY;
    wrap_string strings[2]; /* the one tried, the best one */
    if (before > 0) {
        stops_remove(work, w);
    }
    work->state[w] = WRAP_NONE;
    work->blocker[w] = -1;
    if (stops_range(wrap, work, &from, &to) != 0) {
        return before <= 0;
    }
    for (int32_t i = from; i < to; i++) {
        const course_stop *a = &work->stops[i], *b = &work->stops[i + 1];
        if (a->wrap >= 0 && a->wrap == b->wrap) {
            continue;
        }
        int32_t state = wrap_try(route, w, before, a, b, work, &strings[which]);
        if (best < 0 && now != WRAP_INSIDE) {
            now = state; /* of what does not wrap, the first that is inside is told */
            if (state == WRAP_INSIDE) {
                blocker = string_off(route, w, work, a->at) < 0 ? a->wrap : b->wrap;
            }
        }
        double longer =
            state > 0 ? wrap_length(&strings[which]) - distance3(a->at, b->at) : INFINITY;
        if (state == WRAP_CROSSED || longer < least) {
            least = longer;
            best = i;
            now = state;
            which = 1 - which;
        }
        if (state == WRAP_CROSSED) {
            break;
        }
    }
    work->state[w] = now;
    work->blocker[w] = blocker;
    if (best < 0) {
        return before <= 0;
    }
    double *tried = work->tried + 6 * w;
    int same = before == now && memcmp(tried, work->stops[best].at, 3 * sizeof *tried) == 0 &&
               memcmp(tried + 3, work->stops[best + 1].at, 3 * sizeof *tried) == 0;
    if (!same) {
        work->strings[w] = strings[1 - which];
        memcpy(tried, work->stops[best].at, 3 * sizeof *tried);
        memcpy(tried + 3, work->stops[best + 1].at, 3 * sizeof *tried);
    }
    stops_insert(work, best, w, wrap->link);
    return same;
}

/* A number that tells one order of stops from another. */
static uint64_t stops_digest(const route_work *work) {
    uint64_t digest = 1469598103934665603u;
    for (int32_t i = 0; i < work->n_stops; i++) {
        digest ^= (uint64_t)(uint32_t)(work->stops[i].point + 1) * 257u +
                  (uint64_t)(uint32_t)(work->stops[i].wrap + 1);
        digest *= 1099511628211u;
    }
    return digest;
}

/* Strings that follow each other without a point between them. */
static int stop_joins(const route_work *work, int32_t i) {
    return i + 1 < work->n_stops && work->stops[i].wrap >= 0 && work->stops[i + 1].wrap >= 0 &&
           work->stops[i].wrap != work->stops[i + 1].wrap;
}

static int course_has_joints(const route_work *work) {
    for (int32_t i = 0; i < work->n_stops; i++) {
        if (stop_joins(work, i)) {
            return 1;
        }
    }
    return 0;
}

static void wraps_insert(const path_route *route, route_work *work) {
    uint64_t last = 0;
    int32_t calm = 0; /* wraps in turn that stayed where they were: all of them, and it is done */
    for (int32_t pass = 0; pass < MAX_PASSES; pass++) {
        for (int32_t k = 0; k < work->n_order; k++) {
            calm = wrap_insert(route, work->order[k], work) ? calm + 1 : 0;
            if (pass > 0 && calm >= work->n_order) {
                return;
            }
        }
        uint64_t digest = stops_digest(work);
        if (work->n_order < 2 || (digest == last && (pass > 1 || !course_has_joints(work)))) {
            return;
        }
        last = digest;
        if (pass == 0 && work->state[0] == WRAP_NONE && work->state[1] == WRAP_INSIDE &&
            work->n_order == route->n_wraps) {
            work->order[0] = 1; /* what the first is in the way of comes first */
            work->order[1] = 0;
        } else if (calm >= work->n_order) {
            return;
        }
    }
}

/* The course as pieces between points and joints. */
static void pieces_make(const path_route *route, route_work *work) {
    int32_t joint = -1; /* where the next piece begins, unless at a point */
    work->n_pieces = work->n_joints = 0;
    for (int32_t i = 0; i + 1 < work->n_stops; i++) {
        const course_stop *a = &work->stops[i], *b = &work->stops[i + 1];
        course_piece piece = {.wrap = -1, .point = {a->point, b->point}, .joint = {-1, -1}};
        if (a->point >= 0 && b->point >= 0) {
            if (b->point != a->point + 1 || !route->plain[a->point]) {
                work->pieces[work->n_pieces++] = piece;
            }
            continue;
        }
        if (b->wrap < 0 || (i + 2 < work->n_stops && work->stops[i + 2].wrap != b->wrap)) {
            continue; /* from a string's end: part of its piece */
        }
        const course_stop *after = &work->stops[i + 3];
        piece.wrap = b->wrap;
        piece.joint[0] = a->point >= 0 ? -1 : joint;
        piece.point[1] = after->point;
        if (after->point < 0) {
            joint = work->n_joints++;
            piece.joint[1] = joint;
            joint_begin(work, i + 2, &work->joints[joint]);
        }
        work->pieces[work->n_pieces++] = piece;
        i++; /* to the string's first end; the loop goes on at its second */
    }
}

/* Where the passes never came to rest, a string may be that of other ends: of these, then. */
static void strings_renew(const path_route *route, route_work *work) {
    for (int32_t i = 0; i < work->n_pieces; i++) {
        const course_piece *piece = &work->pieces[i];
        const double *ends[2], *tried = work->tried + 6 * (piece->wrap < 0 ? 0 : piece->wrap);
        if (piece->wrap < 0 || piece->joint[0] >= 0 || piece->joint[1] >= 0) {
            continue;
        }
        piece_ends(work, piece, ends);
        if (memcmp(tried, ends[0], 3 * sizeof *tried) != 0 ||
            memcmp(tried + 3, ends[1], 3 * sizeof *tried) != 0) {
            work->state[piece->wrap] = string_between(route, piece->wrap, ends[0], ends[1], NULL,
                                                      work, &work->strings[piece->wrap]);
        }
    }
}

/* The points that are on, and no wraps. */
static void points_insert(const path_route *route, const path_pose *pose, const double *numbers,
                          route_work *work) {
    work->n_stops = 0;
    for (int32_t k = 0; k < route->n_points; k++) {
        if (!point_is_on(route->points[k].source, numbers)) {
            continue;
        }
        place_point(route, k, pose, numbers, work);
        course_stop *stop = &work->stops[work->n_stops++];
        *stop = (course_stop){.point = k, .wrap = -1, .link = route->points[k].place->link};
        memcpy(stop->at, work->places + 3 * k, sizeof stop->at);
    }
}

void course_lay(const path_route *route, const path_pose *pose, const double *numbers,
                route_work *work) {
    for (int32_t w = 0; w < route->n_wraps; w++) {
        work->state[w] = WRAP_NONE;
        work->blocker[w] = -1;
    }
    points_insert(route, pose, numbers, work);
    wraps_insert(route, work);
    pieces_make(route, work);
    if (route->n_wraps > 1) {
        strings_renew(route, work);
    }
}

void course_drop(const path_route *route, int32_t w, route_work *work) {
    stops_remove(work, w);
    work->state[w] = WRAP_NONE;
    for (int32_t k = 0; k < route->n_wraps; k++) {
        work->blocker[k] = -1;
        work->tried[6 * k] = NAN; /* the strings are those of the row */
    }
    work->afresh = 1;
    wraps_insert(route, work);
    work->afresh = 0;
    pieces_make(route, work);
    strings_renew(route, work);
}

int course_touches(const path_route *route, int32_t w, route_work *work) {
    (void)wrap_insert(route, w, work);
    return work->state[w] > 0;
}

void course_obstacles(const path_route *route, const path_pose *pose, route_work *work) {
    for (int32_t w = 0; w < route->n_wraps; w++) {
        place_obstacle(&route->wraps[w], pose, work->obstacles + 12 * w);
        work->hopeless[6 * w] = NAN;
    }
}
