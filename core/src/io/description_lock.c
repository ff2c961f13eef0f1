/* SPDX-License-Identifier: Apache-2.0 */
/* description_lock.c: coordinates of a description become constants, and with them whatever
 * depends on nothing else. */
#include "io/description_builder.h"
#include "io/model_file.h"

#include <math.h>
#include <string.h>

/* What becomes of coordinate i: number[i], or, where that is -1, the constant at[i]. */
typedef struct lock {
    mhi_arena *arena;
    int32_t *number;
    double *at;
    int32_t failed; /* memory is out */
} lock;

static void *take(lock *l, int32_t n, size_t bytes) {
    void *memory = mhi_arena_take(l->arena, bytes * (size_t)n);
    l->failed |= memory == NULL;
    return memory;
}

static void *copy(lock *l, const void *items, int32_t n, size_t bytes) {
    void *memory = take(l, n, bytes);
    if (memory != NULL && n > 0) {
        memcpy(memory, items, bytes * (size_t)n);
    }
    return memory;
}

static mhe_function constant(lock *l, double value) {
    double *origin = take(l, 1, sizeof *origin), *coef = take(l, 1, sizeof *coef);
    if (origin == NULL || coef == NULL) {
        return (mhe_function){0};
    }
    coef[0] = value;
    return (mhe_function){.origin = origin, .coef = coef, .n_pieces = 1, .n_coef = 1};
}

/* Body that the coordinate moves; -1: none. */
static int32_t body_of(const mhe_description *d, int32_t coordinate) {
    for (int32_t i = 0; i < d->n_bodies; i++) {
        for (int32_t k = 0; k < d->bodies[i].n_motions; k++) {
            if (d->bodies[i].motions[k].coordinate == coordinate) {
                return i;
            }
        }
    }
    return -1;
}

/* Numbers and constants of all coordinates; the free ones and dependents that are left. */
static void lock_coordinates(lock *l, mhe_description *d, const double *at) {
    int32_t n = d->n_coordinates, all = n + d->n_dependents, kept = 0, dependents = 0;
    mhe_coordinate *coordinates = take(l, n, sizeof *coordinates);
    mhe_dependent *followers = take(l, d->n_dependents, sizeof *followers);
    mhe_constant *constants = take(l, d->n_constants + all, sizeof *constants);
    if (l->failed) {
        return;
    }
    if (d->n_constants > 0) {
        memcpy(constants, d->constants, sizeof *constants * (size_t)d->n_constants);
    }
    for (int32_t i = 0; i < all; i++) {
        const mhe_dependent *follower = i < n ? NULL : &d->dependents[i - n];
        const mhe_coordinate *c = i < n ? &d->coordinates[i] : &follower->coordinate;
        const int32_t leader = i < n ? -1 : l->number[follower->independent];
        const int32_t free = i < n ? !isfinite(at[i]) : leader >= 0;
        l->number[i] = -1;
        if (free && i < n) {
            l->number[i] = kept;
            coordinates[kept++] = *c;
        } else if (free) {
            l->number[i] = kept + dependents;
            followers[dependents] = *follower;
            followers[dependents++].independent = leader;
        } else {
            l->at[i] = i < n
                           ? at[i]
                           : mhi_function_value(&follower->function, l->at[follower->independent]);
            constants[d->n_constants++] = (mhe_constant){.name = c->name,
                                                         .rotational = c->rotational,
                                                         .value = l->at[i],
                                                         .body = body_of(d, i)};
        }
    }
    d->coordinates = coordinates;
    d->n_coordinates = kept;
    d->dependents = followers;
    d->n_dependents = dependents;
    d->constants = constants;
}

static void lock_motions(lock *l, mhe_description *d) {
    mhe_body *bodies = copy(l, d->bodies, d->n_bodies, sizeof *bodies);
    for (int32_t i = 0; bodies != NULL && i < d->n_bodies; i++) {
        mhe_motion *motions = copy(l, bodies[i].motions, bodies[i].n_motions, sizeof *motions);
        for (int32_t k = 0; motions != NULL && k < bodies[i].n_motions; k++) {
            const int32_t c = motions[k].coordinate;
            if (c >= 0) {
                motions[k].coordinate = l->number[c];
            }
            if (c >= 0 && l->number[c] < 0) {
                motions[k].function =
                    constant(l, mhi_function_value(&motions[k].function, l->at[c]));
            }
        }
        bodies[i].motions = motions;
    }
    d->bodies = bodies;
}

/* A moving point stands still along what a constant moves; a conditional one is part of the path
 * for good, or never: then 0. */
static int32_t lock_point(const lock *l, mhe_path_point *p) {
    int32_t moves = 0;
    for (int i = 0; i < 3 && p->kind != MHE_POINT_FIXED; i++) {
        const int32_t c = p->coordinate[i];
        if (c < 0) {
            continue;
        }
        p->coordinate[i] = l->number[c];
        moves |= l->number[c] >= 0;
        if (l->number[c] >= 0) {
            continue;
        }
        if (p->kind == MHE_POINT_CONDITIONAL) {
            p->kind = MHE_POINT_FIXED;
            return l->at[c] >= p->lower && l->at[c] <= p->upper;
        }
        p->location[i] = mhi_function_value(&p->function[i], l->at[c]);
    }
    p->kind = moves ? p->kind : MHE_POINT_FIXED;
    return 1;
}

/* Wraps between points that have moved up: `place` [n_points] of those that are left, and, of those
 * that are not, of the next one. */
static void lock_wraps(lock *l, mhe_path *path, const int32_t *place) {
    mhe_path_wrap *wraps = copy(l, path->wraps, path->n_wraps, sizeof *wraps);
    for (int32_t i = 0; wraps != NULL && i < path->n_wraps; i++) {
        wraps[i].first = wraps[i].first < 0 ? -1 : place[wraps[i].first];
        wraps[i].last = wraps[i].last < 0 ? -1 : place[wraps[i].last];
        if (wraps[i].last >= path->n_points) {
            wraps[i].last = path->n_points - 1;
        }
    }
    path->wraps = wraps;
}

static void lock_points(lock *l, mhe_path *path) {
    mhe_path_point *points = copy(l, path->points, path->n_points, sizeof *points);
    int32_t *place = take(l, path->n_points, sizeof *place), kept = 0;
    for (int32_t i = 0; points != NULL && place != NULL && i < path->n_points; i++) {
        mhe_path_point point = points[i];
        place[i] = kept;
        if (lock_point(l, &point)) {
            points[kept++] = point;
        }
    }
    path->points = points;
    if (kept == path->n_points || l->failed) {
        return;
    }
    path->n_points = kept;
    lock_wraps(l, path, place);
    if (kept < 2) { /* no path is left, as OpenSim has it: its length is 0 */
        mhe_polynomial *nothing = take(l, 1, sizeof *nothing);
        path->n_points = path->n_wraps = 0;
        path->length = nothing;
    }
}

/* Terms keep their place; a constant's power goes into the coefficient. */
static void lock_polynomial(lock *l, mhe_path *path) {
    const mhe_polynomial *old = path->length;
    mhe_polynomial *out = copy(l, old, 1, sizeof *out);
    int32_t *coordinate = take(l, old->n, sizeof *coordinate);
    double *centre = take(l, old->n, sizeof *centre), *scale = take(l, old->n, sizeof *scale);
    double *coef = copy(l, old->coef, old->n_terms, sizeof *coef);
    uint8_t *exponent = take(l, old->n_terms * old->n, sizeof *exponent);
    if (l->failed) {
        return;
    }
    out->n = 0;
    for (int32_t k = 0; k < old->n; k++) {
        if (l->number[old->coordinate[k]] >= 0) {
            coordinate[out->n] = l->number[old->coordinate[k]];
            centre[out->n] = old->centre[k];
            scale[out->n++] = old->scale[k];
        }
    }
    for (int32_t t = 0; t < old->n_terms; t++) {
        for (int32_t k = 0, at = 0; k < old->n; k++) {
            const int32_t c = old->coordinate[k], power = old->exponent[t * old->n + k];
            if (l->number[c] >= 0) {
                exponent[t * out->n + at++] = (uint8_t)power;
            } else {
                coef[t] *= pow((l->at[c] - old->centre[k]) / old->scale[k], power);
            }
        }
    }
    out->coordinate = coordinate;
    out->centre = centre;
    out->scale = scale;
    out->coef = coef;
    out->exponent = exponent;
    path->length = out;
}

static void lock_paths(lock *l, mhe_description *d) {
    mhe_path *paths = copy(l, d->paths, d->n_paths, sizeof *paths);
    for (int32_t i = 0; paths != NULL && i < d->n_paths; i++) {
        if (paths[i].length != NULL) {
            lock_polynomial(l, &paths[i]);
        } else {
            lock_points(l, &paths[i]);
        }
    }
    d->paths = paths;
}

/* What acts on a constant alone does no work and goes. */
static void lock_forces(lock *l, mhe_description *d) {
    mhe_coordinate_limit *limits = copy(l, d->limits, d->n_limits, sizeof *limits);
    mhe_coordinate_spring *springs =
        copy(l, d->coordinate_springs, d->n_coordinate_springs, sizeof *springs);
    mhe_actuator *actuators = copy(l, d->actuators, d->n_actuators, sizeof *actuators);
    int32_t n = 0;
    if (l->failed) {
        return;
    }
    for (int32_t i = 0; i < d->n_limits; i++) {
        limits[n] = limits[i];
        limits[n].coordinate = l->number[limits[i].coordinate];
        n += limits[n].coordinate >= 0;
    }
    d->limits = limits;
    d->n_limits = n;
    n = 0;
    for (int32_t i = 0; i < d->n_coordinate_springs; i++) {
        springs[n] = springs[i];
        springs[n].coordinate = l->number[springs[i].coordinate];
        n += springs[n].coordinate >= 0;
    }
    d->coordinate_springs = springs;
    d->n_coordinate_springs = n;
    n = 0;
    for (int32_t i = 0; i < d->n_actuators; i++) {
        const int32_t c = actuators[i].coordinate;
        actuators[n] = actuators[i];
        actuators[n].coordinate = c < 0 ? -1 : l->number[c];
        n += c < 0 || actuators[n].coordinate >= 0;
    }
    d->actuators = actuators;
    d->n_actuators = n;
}

double *mhi_description_take(mhe_description *d, int32_t n) {
    return MHI_TAKE(&((mhi_owned_description *)(void *)d)->arena, double, n);
}

mhe_status mhi_description_lock(mhe_description *d, const double *at, mhe_error *err) {
    lock l = {.arena = &((mhi_owned_description *)(void *)d)->arena};
    l.number = take(&l, d->n_coordinates + d->n_dependents, sizeof *l.number);
    l.at = take(&l, d->n_coordinates + d->n_dependents, sizeof *l.at);
    void (*const steps[])(lock *, mhe_description *) = {lock_motions, lock_paths, lock_forces};
    if (!l.failed) {
        lock_coordinates(&l, d, at);
    }
    for (size_t i = 0; i < sizeof steps / sizeof *steps && !l.failed; i++) {
        steps[i](&l, d);
    }
    return l.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}
