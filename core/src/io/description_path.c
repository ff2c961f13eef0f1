/* SPDX-License-Identifier: Apache-2.0 */
/* description_path.c: markers, paths and what they wrap around, put on the description's bodies. */
#include "base/text.h"
#include "io/description_builder.h"

#include <string.h>

#define MUSCLE(b, i) ((mhi_muscle_draft *)(b)->muscles.items[i])
#define OBSTACLE(b, i) ((mhi_obstacle_draft *)(b)->obstacles.items[i])

static int32_t place_coordinate(const mhi_places *places, int32_t draft) {
    return draft < 0 ? -1 : places->coordinate[draft];
}

/* Points on a body whose frame was flipped are its mirror image (only .bioMod has such). */
static mhe_path_point place_point(mhi_builder *b, const mhi_places *places,
                                  const mhi_point_draft *draft, const char *what,
                                  const char *whose) {
    mhe_path_point out = draft->point;
    out.body = mhi_build_place(b, places, draft->body, draft->line, what, whose);
    if (out.body >= 0 && places->mirrored[out.body]) {
        out.location[2] = -out.location[2];
    }
    for (int i = 0; i < 3; i++) {
        out.coordinate[i] = place_coordinate(places, out.coordinate[i]);
    }
    if (out.kind == MHE_POINT_CONDITIONAL && !(out.lower <= out.upper)) {
        mhi_build_fail(b, draft->line,
                       "the range of a point of %s '%s' ends (%g) before it begins (%g)", what,
                       whose, out.upper, out.lower);
    }
    return out;
}

void mhi_build_markers(mhi_builder *b, mhe_description *d, const mhi_places *places) {
    mhe_marker *markers = mhi_build_take(b, b->markers.n, sizeof *markers);
    for (int32_t i = 0; markers != NULL && i < b->markers.n; i++) {
        const mhi_marker_draft *draft = b->markers.items[i];
        mhe_path_point point = place_point(b, places, &draft->point, "marker", draft->name);
        markers[i].name = draft->name;
        markers[i].body = point.body;
        memcpy(markers[i].location, point.location, sizeof markers[i].location);
    }
    d->markers = markers;
    d->n_markers = b->markers.n;
}

/* ---- obstacles ---- */

static mhi_obstacle_draft *find_obstacle(mhi_builder *b, const mhi_wrap_draft *wrap,
                                         const mhi_path_draft *path) {
    const char **names = mhi_build_take(b, b->obstacles.n, sizeof *names);
    for (int32_t i = 0; names != NULL && i < b->obstacles.n; i++) {
        names[i] = OBSTACLE(b, i)->obstacle.name;
        if (strcmp(names[i], wrap->obstacle) == 0) {
            return OBSTACLE(b, i);
        }
    }
    char hint[256] = "";
    if (names != NULL) {
        mhi_suggest(hint, sizeof hint, wrap->obstacle, names, b->obstacles.n);
    }
    mhi_build_fail(b, wrap->line, "%s '%s' wraps around '%s', which no body has%s", path->what,
                   path->name, wrap->obstacle, hint);
    return NULL;
}

/* Paths know obstacles by their names alone. */
static void warn_of_second(mhi_builder *b, const mhi_obstacle_draft *first) {
    for (int32_t i = 0; i < b->obstacles.n; i++) {
        const mhi_obstacle_draft *other = OBSTACLE(b, i);
        if (other != first && strcmp(other->obstacle.name, first->obstacle.name) == 0) {
            mhi_build_warn(b, other->line,
                           "wrap object '%s' is there twice: paths take the first, in line %d",
                           other->obstacle.name, (int)first->line);
        }
    }
}

static void check_obstacle(mhi_builder *b, const mhi_obstacle_draft *draft) {
    static const int32_t n_sizes[] = {1, 2, 3, 2};
    static const char *const kinds[] = {"sphere", "cylinder", "ellipsoid", "torus"};
    const mhe_obstacle *o = &draft->obstacle;
    for (int32_t i = 0; i < n_sizes[o->kind]; i++) {
        if (!(o->size[i] > 0)) {
            mhi_build_fail(b, draft->line, "%s '%s' needs a size > 0, not %g", kinds[o->kind],
                           o->name, o->size[i]);
        }
    }
    if (o->kind == MHE_OBSTACLE_TORUS && !(o->size[0] < o->size[1])) {
        mhi_build_fail(b, draft->line,
                       "torus '%s': the radius of its tube (%g) is not below that of its ring (%g)",
                       o->name, o->size[0], o->size[1]);
    }
}

/* Wraps of a path around active obstacles, in their order; 0 obstacle numbers are filled in when
 * all are known. */
static void check_wraps(mhi_builder *b, const mhi_path_draft *path) {
    for (int32_t i = 0; i < path->wraps.n; i++) {
        mhi_wrap_draft *draft = path->wraps.items[i];
        mhe_path_wrap *wrap = &draft->wrap;
        mhi_obstacle_draft *obstacle = find_obstacle(b, draft, path);
        if (obstacle == NULL) {
            return;
        }
        if (obstacle->unknown != NULL) {
            mhi_build_unsupported(b, draft->line, "%s '%s' goes straight past the %s '%s'",
                                  path->what, path->name, obstacle->unknown, draft->obstacle);
        }
        if (obstacle->active && !obstacle->used) {
            obstacle->used = 1;
            check_obstacle(b, obstacle);
            warn_of_second(b, obstacle);
        }
        if (wrap->first >= path->points.n || wrap->last >= path->points.n ||
            (wrap->first >= 0 && wrap->last >= 0 && wrap->first >= wrap->last)) {
            mhi_build_fail(b, draft->line,
                           "%s '%s' wraps around '%s' between its points %d and %d; it has %d",
                           path->what, path->name, draft->obstacle, (int)wrap->first + 1,
                           (int)wrap->last + 1, (int)path->points.n);
        }
    }
}

/* 1 where a wrap before this one has its obstacle and a piece between two points with it. */
static int32_t wraps_again(const mhe_path *path, const mhe_path_wrap *wrap) {
    for (int32_t k = 0; k < path->n_wraps && wrap->obstacle >= 0; k++) {
        const mhe_path_wrap *other = &path->wraps[k];
        const int32_t after_it = other->last >= 0 && wrap->first >= other->last;
        const int32_t before_it = wrap->last >= 0 && other->first >= wrap->last;
        if (other->obstacle == wrap->obstacle && !after_it && !before_it) {
            return 1;
        }
    }
    return 0;
}

static int32_t obstacle_number(const mhe_obstacle *obstacles, int32_t n, const char *name) {
    for (int32_t i = 0; i < n; i++) {
        if (strcmp(obstacles[i].name, name) == 0) {
            return i;
        }
    }
    return -1; /* not active */
}

static void place_obstacles(mhi_builder *b, mhe_description *d, const mhi_places *places) {
    mhe_obstacle *obstacles = mhi_build_take(b, b->obstacles.n, sizeof *obstacles);
    for (int32_t i = 0; obstacles != NULL && i < b->obstacles.n; i++) {
        const mhi_obstacle_draft *draft = OBSTACLE(b, i);
        if (draft->used) {
            mhe_obstacle *out = &obstacles[d->n_obstacles++];
            *out = draft->obstacle;
            out->body = mhi_build_place(b, places, draft->body, draft->line, "obstacle", out->name);
        }
    }
    d->obstacles = obstacles;
}

/* ---- paths ---- */

static void place_path(mhi_builder *b, mhe_description *d, const mhi_places *places,
                       const mhi_path_draft *draft, mhe_path *out) {
    mhe_path_point *points = mhi_build_take(b, draft->points.n, sizeof *points);
    mhe_path_wrap *wraps = mhi_build_take(b, draft->wraps.n, sizeof *wraps);
    if (points == NULL || wraps == NULL) {
        return;
    }
    *out = (mhe_path){.name = draft->name,
                      .n_points = draft->points.n,
                      .points = points,
                      .wraps = wraps,
                      .length = draft->length,
                      .line = draft->line};
    for (int32_t k = 0; k < draft->points.n; k++) {
        points[k] = place_point(b, places, draft->points.items[k], draft->what, draft->name);
    }
    for (int32_t k = 0; k < draft->wraps.n; k++) {
        const mhi_wrap_draft *wrap = draft->wraps.items[k];
        wraps[out->n_wraps] = wrap->wrap;
        wraps[out->n_wraps].obstacle =
            obstacle_number(d->obstacles, d->n_obstacles, wrap->obstacle);
        if (wraps_again(out, &wraps[out->n_wraps])) {
            mhi_build_warn(b, wrap->line,
                           "%s '%s' wraps around '%s' once more between the same points: left out",
                           draft->what, draft->name, wrap->obstacle);
            continue;
        }
        out->n_wraps += wraps[out->n_wraps].obstacle >= 0;
    }
    if (draft->length != NULL) {
        int32_t *coordinate = mhi_build_take(b, draft->length->n, sizeof *coordinate);
        for (int32_t k = 0; coordinate != NULL && k < draft->length->n; k++) {
            coordinate[k] = place_coordinate(places, draft->length->coordinate[k]);
        }
        draft->length->coordinate = coordinate;
    } else if (draft->points.n < 2) {
        mhi_build_fail(b, draft->line, "%s '%s' has %d path points; it needs at least 2",
                       draft->what, draft->name, (int)draft->points.n);
    }
}

/* All paths, muscles' first. */
static const mhi_path_draft **all_paths(mhi_builder *b, int32_t n) {
    const mhi_path_draft **all = mhi_build_take(b, n, sizeof *all);
    int32_t at = 0;
    for (int32_t i = 0; all != NULL && i < b->muscles.n; i++) {
        all[at++] = &MUSCLE(b, i)->path;
    }
    for (int32_t i = 0; all != NULL && i < b->path_springs.n; i++) {
        all[at++] = &((mhi_path_spring_draft *)b->path_springs.items[i])->path;
    }
    for (int32_t i = 0; all != NULL && i < b->ligaments.n; i++) {
        all[at++] = &((mhi_ligament_draft *)b->ligaments.items[i])->path;
    }
    return all;
}

void mhi_build_paths(mhi_builder *b, mhe_description *d, const mhi_places *places) {
    int32_t n = b->muscles.n + b->path_springs.n + b->ligaments.n;
    mhe_muscle *muscles = mhi_build_take(b, b->muscles.n, sizeof *muscles);
    mhe_path *paths = mhi_build_take(b, n, sizeof *paths);
    const mhi_path_draft **drafts = all_paths(b, n);
    if (muscles == NULL || paths == NULL || drafts == NULL) {
        return;
    }
    for (int32_t i = 0; i < n; i++) {
        check_wraps(b, drafts[i]);
    }
    place_obstacles(b, d, places);
    for (int32_t i = 0; i < n && b->status == MHE_OK; i++) {
        place_path(b, d, places, drafts[i], &paths[i]);
    }
    for (int32_t i = 0; i < b->muscles.n; i++) {
        muscles[i] = MUSCLE(b, i)->muscle;
        muscles[i].line = MUSCLE(b, i)->line;
    }
    d->muscles = muscles;
    d->n_muscles = b->muscles.n;
    d->paths = paths;
    d->n_paths = n;
}
