/* SPDX-License-Identifier: Apache-2.0 */
#include "model/anatomy.h"

#include "base/arena.h"
#include "plugin/instance.h"

#include <math.h>
#include <string.h>

#define AXES 3

struct mhi_anatomy {
    const mhe_plugin *plugin;
    const mhe_model_ops *ops;
    const void *config;
    mhe_host quiet;
    const mhe_description *given;
    int32_t insertions, masses; /* 1: are parameters */
    double *offset, *factor;    /* [n_m x 3], [n_b]: their values */
    double *wanted;             /* [n_m x 3 + n_b] to be set */
    mhe_description paths;
    double zero, *coef; /* of the functions that move the points [n_m x 3 x 2] */
    void *paths_self;
    mhe_description whole; /* with the masses */
    mhe_body *bodies;
    int32_t *part; /* [n_b]: which part is this body's; -1: it has no mass */
    mhe_description *parts;
    void **part_self;
    int32_t n_parts;
    mhi_anatomy_context *contexts;
};

int32_t mhi_insertion_is_fixed(const mhe_description *d, int32_t m) {
    const mhe_path *path = &d->paths[m];
    return path->n_points > 1 && path->points[path->n_points - 1].kind == MHE_POINT_FIXED &&
           path->points[path->n_points - 1].body >= 0;
}

int32_t mhi_anatomy_insertions(const mhi_anatomy *a) {
    return a != NULL && a->insertions ? AXES * a->given->n_muscles : 0;
}

int32_t mhi_anatomy_masses(const mhi_anatomy *a) {
    return a != NULL && a->masses ? a->given->n_bodies : 0;
}

/* ---- descriptions ---- */

#define COPY(arena, list, n) copied((arena), (list), sizeof *(list), (n))
static void *copied(mhi_arena *arena, const void *from, size_t size, int32_t n) {
    void *to = mhi_arena_take(arena, size * (size_t)n);
    if (to != NULL && n > 0) {
        memcpy(to, from, size * (size_t)n);
    }
    return to;
}

/* Numbers of dependent coordinates stand behind those of the free ones, of which there are more. */
static void shift(const mhe_description *d, int32_t *number) {
    *number += *number >= d->n_coordinates ? AXES : 0;
}

static void shift_all(const mhe_description *d, int32_t *numbers, int32_t n) {
    for (int32_t i = 0; i < n && numbers != NULL; i++) {
        shift(d, &numbers[i]);
    }
}

static void copy_bodies(const mhe_description *d, mhi_arena *arena, mhe_body *bodies) {
    for (int32_t b = 0; b < d->n_bodies && bodies != NULL; b++) {
        mhe_motion *motions = COPY(arena, bodies[b].motions, bodies[b].n_motions);
        for (int32_t i = 0; i < bodies[b].n_motions && motions != NULL; i++) {
            shift(d, &motions[i].coordinate);
        }
        bodies[b].motions = motions;
    }
}

static void copy_path(const mhe_description *d, mhi_arena *arena, mhe_path *path) {
    mhe_path_point *points = COPY(arena, path->points, path->n_points);
    for (int32_t i = 0; i < path->n_points && points != NULL; i++) {
        shift_all(d, points[i].coordinate, AXES);
    }
    path->points = points;
    mhe_polynomial *length = path->length == NULL ? NULL : COPY(arena, path->length, 1);
    if (length != NULL) {
        int32_t *numbers = COPY(arena, length->coordinate, length->n);
        shift_all(d, numbers, length->n);
        length->coordinate = numbers;
    }
    path->length = length;
}

/* The last point of muscle m's path moves with the three coordinates. */
static void loosen(mhi_anatomy *a, const mhe_path *path, int32_t m) {
    union {
        const mhe_path_point *read;
        mhe_path_point *write;
    } points = {.read = path->points};
    mhe_path_point *point = &points.write[path->n_points - 1];
    point->kind = MHE_POINT_MOVING;
    for (int32_t i = 0; i < AXES; i++) {
        double *coef = a->coef + 2 * (AXES * m + i);
        coef[0] = point->location[i];
        coef[1] = 1;
        point->coordinate[i] = a->given->n_coordinates + i;
        point->function[i] = (mhe_function){&a->zero, coef, 1, 2};
    }
}

static mhe_status describe_paths(mhi_anatomy *a, mhi_arena *arena, mhe_error *err) {
    static const mhe_coordinate own[AXES] = {{.name = "insertion x", .lower = -1, .upper = 1},
                                             {.name = "insertion y", .lower = -1, .upper = 1},
                                             {.name = "insertion z", .lower = -1, .upper = 1}};
    const mhe_description *d = a->given;
    mhe_coordinate *coordinates = MHI_TAKE(arena, mhe_coordinate, d->n_coordinates + AXES);
    mhe_dependent *dependents = COPY(arena, d->dependents, d->n_dependents);
    mhe_body *bodies = COPY(arena, d->bodies, d->n_bodies);
    mhe_path *paths = COPY(arena, d->paths, d->n_paths);
    a->coef = MHI_TAKE(arena, double, 2 * AXES * d->n_muscles);
    if (coordinates == NULL || dependents == NULL || bodies == NULL || paths == NULL ||
        a->coef == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    memcpy(coordinates, d->coordinates, sizeof *coordinates * (size_t)d->n_coordinates);
    memcpy(coordinates + d->n_coordinates, own, sizeof own);
    for (int32_t i = 0; i < d->n_dependents; i++) {
        shift(d, &dependents[i].independent);
    }
    copy_bodies(d, arena, bodies);
    for (int32_t p = 0; p < d->n_paths; p++) {
        copy_path(d, arena, &paths[p]);
    }
    if (arena->failed) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t m = 0; m < d->n_muscles; m++) {
        if (mhi_insertion_is_fixed(d, m)) {
            loosen(a, &paths[m], m);
        }
    }
    a->paths = *d;
    a->paths.n_coordinates = d->n_coordinates + AXES;
    a->paths.coordinates = coordinates;
    a->paths.dependents = dependents;
    a->paths.bodies = bodies;
    a->paths.paths = paths;
    a->paths.n_loops = 0;
    return MHE_OK;
}

static mhe_status make_model(const mhi_anatomy *a, const mhe_description *d, void **self,
                             mhe_error *err) {
    return mhi_model_create(a->plugin, &a->quiet, d, a->config, self, err);
}

/* One model for each body that has a mass, which is its alone. */
static mhe_status make_parts(mhi_anatomy *a, mhi_arena *arena, mhe_error *err) {
    const mhe_description *d = a->given;
    a->part = MHI_TAKE(arena, int32_t, d->n_bodies);
    a->parts = MHI_TAKE(arena, mhe_description, d->n_bodies);
    a->part_self = MHI_TAKE(arena, void *, d->n_bodies);
    a->bodies = COPY(arena, d->bodies, d->n_bodies);
    mhe_status status = arena->failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    a->whole = *d;
    a->whole.bodies = a->bodies;
    for (int32_t b = 0; b < d->n_bodies && status == MHE_OK; b++) {
        mhe_body *bodies = COPY(arena, d->bodies, d->n_bodies);
        a->part[b] = -1;
        if (bodies == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        if (!(d->bodies[b].mass > 0)) {
            continue;
        }
        for (int32_t other = 0; other < d->n_bodies; other++) {
            if (other != b) {
                bodies[other].mass = 0;
                memset(bodies[other].inertia, 0, sizeof bodies[other].inertia);
            }
        }
        mhe_description *part = &a->parts[a->n_parts];
        *part = *d;
        part->bodies = bodies;
        part->n_paths = part->n_muscles = part->n_obstacles = part->n_loops = 0;
        part->n_path_springs = part->n_ligaments = 0;
        status = make_model(a, part, &a->part_self[a->n_parts], err);
        if (status == MHE_OK) {
            a->part[b] = a->n_parts++;
        }
    }
    return status;
}

/* ---- life ---- */

mhe_status mhi_anatomy_create(const mhi_system_setup *setup, mhi_arena *arena, mhi_anatomy **out,
                              mhe_error *err) {
    const mhe_description *d = setup->description;
    int32_t insertions = 0, masses = 0;
    for (int32_t i = 0; i < setup->n_parameters; i++) {
        insertions |= strcmp(setup->parameters[i], MHI_INSERTION) == 0;
        masses |= strcmp(setup->parameters[i], MHI_MASS) == 0;
    }
    *out = NULL;
    if (!insertions && !masses) {
        return MHE_OK;
    }
    mhi_anatomy *a = MHI_TAKE(arena, mhi_anatomy, 1);
    if (a == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    *out = a;
    a->plugin = setup->model;
    a->ops = setup->model->ops;
    a->config = setup->model_config;
    a->quiet = mhi_host_quiet(setup->host); /* the system's own model has told all */
    a->given = d;
    a->insertions = insertions;
    a->masses = masses;
    a->offset = MHI_TAKE(arena, double, AXES * d->n_muscles);
    a->factor = MHI_TAKE(arena, double, d->n_bodies);
    a->wanted = MHI_TAKE(arena, double, AXES * d->n_muscles + d->n_bodies);
    if (a->offset == NULL || a->factor == NULL || a->wanted == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t b = 0; b < d->n_bodies; b++) {
        a->factor[b] = 1;
    }
    mhe_status status = insertions ? describe_paths(a, arena, err) : MHE_OK;
    if (status == MHE_OK && insertions) {
        status = make_model(a, &a->paths, &a->paths_self, err);
    }
    return status == MHE_OK && masses ? make_parts(a, arena, err) : status;
}

void mhi_anatomy_free(mhi_anatomy *a) {
    if (a == NULL) {
        return;
    }
    if (a->paths_self != NULL) {
        a->ops->destroy(a->paths_self);
    }
    for (int32_t i = 0; i < a->n_parts; i++) {
        a->ops->destroy(a->part_self[i]);
    }
}

/* ---- contexts ---- */

mhe_status mhi_anatomy_enter(mhi_anatomy *a, mhi_arena *arena, void **model,
                             mhi_anatomy_context **out, mhe_error *err) {
    const int32_t n_m = a->given->n_muscles, n_q = a->given->n_coordinates, n = n_q + AXES;
    const int32_t n_p = a->insertions ? a->given->n_paths : 0;
    mhi_anatomy_context *c = MHI_TAKE(arena, mhi_anatomy_context, 1);
    *out = c;
    if (c == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    c->model = model;
    c->parts = MHI_TAKE(arena, void *, a->n_parts + 1);
    c->state = MHI_TAKE(arena, double, 2 * n);
    c->length_q = MHI_TAKE(arena, double, n_p *n);
    c->length_qq = MHI_TAKE(arena, double, n_p *n *n);
    c->length_d = MHI_TAKE(arena, double, AXES *n_m);
    c->length_dq = MHI_TAKE(arena, double, AXES *n_m *n_q);
    c->velocity_d = MHI_TAKE(arena, double, AXES *n_m);
    c->tau = MHI_TAKE(arena, double, n_q);
    mhe_status status = arena->failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    if (status == MHE_OK && a->insertions) {
        status = a->ops->context_create(a->paths_self, &c->paths, err);
    }
    c->anatomy = a;
    for (int32_t i = 0; i < a->n_parts && status == MHE_OK; i++) {
        status = a->ops->context_create(a->part_self[i], &c->parts[i], err);
    }
    c->next = a->contexts;
    a->contexts = c;
    return status;
}

void mhi_anatomy_leave(mhi_anatomy_context *c) {
    if (c == NULL || c->anatomy == NULL) {
        return;
    }
    mhi_anatomy *a = c->anatomy;
    if (c->paths != NULL) {
        a->ops->context_destroy(c->paths);
    }
    for (int32_t i = 0; i < a->n_parts; i++) {
        if (c->parts[i] != NULL) {
            a->ops->context_destroy(c->parts[i]);
        }
    }
    mhi_anatomy_context **at = &a->contexts;
    while (*at != c) {
        at = &(*at)->next;
    }
    *at = c->next;
}

/* ---- values ---- */

void mhi_anatomy_values(const mhi_anatomy *a, double *p) {
    const int32_t n = mhi_anatomy_insertions(a);
    memcpy(p, a->offset, sizeof *p * (size_t)n);
    memcpy(p + n, a->factor, sizeof *p * (size_t)mhi_anatomy_masses(a));
}

/* The descriptions as the values say. */
static void describe(mhi_anatomy *a) {
    const mhe_description *d = a->given;
    for (int32_t m = 0; m < d->n_muscles && a->insertions; m++) {
        for (int32_t i = 0; i < AXES && mhi_insertion_is_fixed(d, m); i++) {
            a->coef[2 * (AXES * m + i)] =
                d->paths[m].points[d->paths[m].n_points - 1].location[i] + a->offset[AXES * m + i];
        }
    }
    for (int32_t b = 0; b < d->n_bodies && a->masses; b++) {
        a->bodies[b].mass = d->bodies[b].mass * a->factor[b];
        for (int32_t i = 0; i < 9; i++) {
            a->bodies[b].inertia[i] = d->bodies[b].inertia[i] * a->factor[b];
        }
    }
}

/* Contexts of new models beside the old ones; all of them or none. */
static mhe_status renew_contexts(mhi_anatomy *a, const void *paths, const void *model,
                                 mhe_error *err) {
    mhe_status status = MHE_OK;
    for (mhi_anatomy_context *c = a->contexts; c != NULL; c = c->next) {
        c->new_model = c->new_paths = NULL;
    }
    for (mhi_anatomy_context *c = a->contexts; c != NULL && status == MHE_OK; c = c->next) {
        status = paths == NULL ? MHE_OK : a->ops->context_create(paths, &c->new_paths, err);
        if (status == MHE_OK && model != NULL) {
            status = a->ops->context_create(model, &c->new_model, err);
        }
    }
    for (mhi_anatomy_context *c = a->contexts; c != NULL; c = c->next) {
        if (c->new_paths != NULL) {
            a->ops->context_destroy(status == MHE_OK ? c->paths : c->new_paths);
            c->paths = status == MHE_OK ? c->new_paths : c->paths;
        }
        if (c->new_model != NULL) {
            a->ops->context_destroy(status == MHE_OK ? *c->model : c->new_model);
            *c->model = status == MHE_OK ? c->new_model : *c->model;
        }
    }
    return status;
}

static void swap(double *a, double *b, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        const double value = a[i];
        a[i] = b[i];
        b[i] = value;
    }
}

mhe_status mhi_anatomy_set(mhi_anatomy *a, const double *p, void **model, mhe_error *err) {
    const int32_t n_i = mhi_anatomy_insertions(a), n_b = mhi_anatomy_masses(a);
    const int32_t moved = memcmp(a->offset, p, sizeof *p * (size_t)n_i) != 0;
    const int32_t weighed = memcmp(a->factor, p + n_i, sizeof *p * (size_t)n_b) != 0;
    void *paths = NULL, *whole = NULL;
    memcpy(a->wanted, p, sizeof *p * (size_t)(n_i + n_b));
    swap(a->offset, a->wanted, n_i);
    swap(a->factor, a->wanted + n_i, n_b);
    describe(a);
    mhe_status status = moved ? make_model(a, &a->paths, &paths, err) : MHE_OK;
    if (status == MHE_OK && weighed) {
        status = make_model(a, &a->whole, &whole, err);
    }
    if (status == MHE_OK) {
        status = renew_contexts(a, paths, whole, err);
    }
    const int32_t kept = status == MHE_OK;
    if (paths != NULL) {
        a->ops->destroy(kept ? a->paths_self : paths);
        a->paths_self = kept ? paths : a->paths_self;
    }
    if (whole != NULL) {
        a->ops->destroy(kept ? *model : whole);
        *model = kept ? whole : *model;
    }
    if (!kept) {
        swap(a->offset, a->wanted, n_i);
        swap(a->factor, a->wanted + n_i, n_b);
        describe(a);
    }
    return status;
}

/* ---- evaluation ---- */

mhe_status mhi_anatomy_lengths(mhi_anatomy_context *c, const double *q, const double *v,
                               double *length, double *length_q, double *length_qq,
                               mhe_error *err) {
    const mhe_description *d = c->anatomy->given;
    const int32_t n_q = d->n_coordinates, n = n_q + AXES;
    memcpy(c->state, q, sizeof *q * (size_t)n_q);
    memcpy(c->state + n, v, sizeof *v * (size_t)n_q);
    const mhe_kinematics out = {.size = sizeof out,
                                .length = length,
                                .length_q = c->length_q,
                                .length_qq = length_qq == NULL ? NULL : c->length_qq};
    const mhe_status status =
        c->anatomy->ops->kinematics(c->paths, c->state, c->state + n, &out, err);
    for (int32_t p = 0; p < d->n_paths && status == MHE_OK; p++) {
        memcpy(length_q + p * n_q, c->length_q + p * n, sizeof *q * (size_t)n_q);
        for (int32_t i = 0; i < n_q && length_qq != NULL; i++) {
            memcpy(length_qq + (p * n_q + i) * n_q, c->length_qq + (p * n + i) * n,
                   sizeof *q * (size_t)n_q);
        }
    }
    for (int32_t m = 0; m < d->n_muscles && status == MHE_OK && length_qq != NULL; m++) {
        memcpy(c->length_d + AXES * m, c->length_q + m * n + n_q, AXES * sizeof *q);
        for (int32_t i = 0; i < AXES; i++) {
            memcpy(c->length_dq + (AXES * m + i) * n_q, c->length_qq + (m * n + n_q + i) * n,
                   sizeof *q * (size_t)n_q);
        }
    }
    return status;
}

mhe_status mhi_anatomy_weigh(mhi_anatomy_context *c, int32_t b, const double *q, const double *v,
                             const double *vdot, mhe_error *err) {
    const mhi_anatomy *a = c->anatomy;
    const mhe_kinematics none = {.size = sizeof none};
    if (a->part[b] < 0) {
        memset(c->tau, 0, sizeof *q * (size_t)a->given->n_coordinates);
        return MHE_OK;
    }
    void *part = c->parts[a->part[b]];
    const mhe_status status = a->ops->kinematics(part, q, v, &none, err);
    return status == MHE_OK ? a->ops->inverse_dynamics(part, vdot, c->tau, NULL, NULL, err)
                            : status;
}
