/* SPDX-License-Identifier: Apache-2.0 */
#include "model/joints.h"

#include "config/options_table.h"

#include <math.h>
#include <string.h>

#define SIX 6
#define REACH 0.01 /* m: over which a path may be fitted to tell its direction at 0 */

static const double one[2] = {0, 1}, zero[1] = {0};

/* Motion k of those that a joint gets: three shifts, then three turns. */
static mhe_motion more_motion(int32_t k, int32_t coordinate) {
    mhe_motion motion = {.kind = k < 3 ? MHE_MOTION_TRANSLATION : MHE_MOTION_ROTATION,
                         .coordinate = coordinate,
                         .function = {.origin = zero, .coef = one, .n_pieces = 1, .n_coef = 2}};
    motion.axis[k % 3] = 1;
    return motion;
}

/* Copy of body i, whose joint gets `more` motions of the coordinates from `first` on, behind its
 * own or before them. Numbers of dependents, from n on, move up by n_more. */
static mhe_status loosen_body(const mhe_body *from, int32_t more, int32_t first, int32_t before,
                              int32_t n, int32_t n_more, mhi_arena *arena, mhe_body *to,
                              mhe_error *err) {
    const int32_t own = from->n_motions;
    mhe_motion *motions = MHI_TAKE(arena, mhe_motion, own + more);
    if (motions == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t k = 0; k < own; k++) {
        mhe_motion *motion = &motions[before ? more + k : k];
        *motion = from->motions[k];
        motion->coordinate += motion->coordinate >= n ? n_more : 0;
    }
    for (int32_t k = 0; k < more; k++) {
        motions[before ? k : own + k] = more_motion(k, first + k);
    }
    *to = *from;
    to->motions = motions;
    to->n_motions = own + more;
    return MHE_OK;
}

/* To all joints (body -1) six behind their own, or to that of one body three shifts before its own.
 */
static mhe_status add_motions(const mhe_description *d, int32_t body, mhi_arena *arena,
                              mhe_description *out, mhe_error *err) {
    const int32_t n = d->n_coordinates, all = body < 0, n_more = all ? SIX * d->n_bodies : 3;
    mhe_body *bodies = MHI_TAKE(arena, mhe_body, d->n_bodies);
    mhe_coordinate *coordinates = MHI_TAKE(arena, mhe_coordinate, n + n_more);
    mhe_dependent *dependents = MHI_TAKE(arena, mhe_dependent, d->n_dependents);
    if (bodies == NULL || coordinates == NULL || dependents == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    *out = *d;
    memcpy(coordinates, d->coordinates, sizeof *coordinates * (size_t)n);
    for (int32_t i = 0; i < n_more; i++) {
        const double reach = all ? 1 : REACH;
        coordinates[n + i] =
            (mhe_coordinate){.name = "of a joint", .lower = -reach, .upper = reach};
    }
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < d->n_bodies && status == MHE_OK; i++) {
        const int32_t more = all ? SIX : i == body ? 3 : 0;
        status = loosen_body(&d->bodies[i], more, n + (all ? SIX * i : 0), !all, n, n_more, arena,
                             &bodies[i], err);
    }
    for (int32_t i = 0; i < d->n_dependents; i++) {
        dependents[i] = d->dependents[i];
        dependents[i].independent += dependents[i].independent >= n ? n_more : 0;
    }
    out->bodies = bodies;
    out->coordinates = coordinates;
    out->n_coordinates = n + n_more;
    out->dependents = dependents;
    return status;
}

/* Points and polynomials speak of coordinates too. */
static mhe_status move_numbers(const mhe_description *d, mhi_arena *arena, mhe_description *out,
                               mhe_error *err) {
    const int32_t n = d->n_coordinates, n_more = out->n_coordinates - n;
    mhe_path *paths = MHI_TAKE(arena, mhe_path, d->n_paths);
    if (paths == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < d->n_paths; i++) {
        mhe_path_point *points = MHI_TAKE(arena, mhe_path_point, d->paths[i].n_points);
        if (points == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        paths[i] = d->paths[i];
        paths[i].points = points;
        for (int32_t k = 0; k < paths[i].n_points; k++) {
            points[k] = d->paths[i].points[k];
            for (int j = 0; j < 3; j++) {
                points[k].coordinate[j] += points[k].coordinate[j] >= n ? n_more : 0;
            }
        }
        if (paths[i].length != NULL) {
            mhe_polynomial *length = MHI_TAKE(arena, mhe_polynomial, 1);
            int32_t *numbers = MHI_TAKE(arena, int32_t, d->paths[i].length->n);
            if (length == NULL || numbers == NULL) {
                return mhe_fail(err, MHE_E_MEMORY, "out of memory");
            }
            *length = *d->paths[i].length;
            for (int32_t k = 0; k < length->n; k++) {
                numbers[k] = length->coordinate[k] + (length->coordinate[k] >= n ? n_more : 0);
            }
            length->coordinate = numbers;
            paths[i].length = length;
        }
    }
    out->paths = paths;
    return MHE_OK;
}

mhe_status mhi_joints_open(const mhe_description *d, mhi_arena *arena, mhe_description *out,
                           mhe_error *err) {
    const mhe_status status = add_motions(d, -1, arena, out, err);
    return status == MHE_OK ? move_numbers(d, arena, out, err) : status;
}

/* Where the motion keeps to, of which nothing is known of the shifts. */
static mhe_status extend_motion(const mhe_description *d, mhi_arena *arena, mhe_description *out,
                                mhe_error *err) {
    const double *const given[] = {d->motion_lower, d->motion_upper};
    const double **const to[] = {&out->motion_lower, &out->motion_upper};
    for (int32_t k = 0; k < 2; k++) {
        double *range = given[k] == NULL ? NULL : MHI_TAKE(arena, double, out->n_coordinates);
        if (given[k] != NULL && range == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        for (int32_t i = 0; i < out->n_coordinates && range != NULL; i++) {
            range[i] = i < d->n_coordinates ? given[k][i] : NAN;
        }
        *to[k] = range;
    }
    return MHE_OK;
}

mhe_status mhi_joints_loosen(const mhe_description *d, int32_t body, mhi_arena *arena,
                             mhe_description *out, mhe_error *err) {
    mhe_status status = add_motions(d, body, arena, out, err);
    if (status == MHE_OK) {
        status = move_numbers(d, arena, out, err);
    }
    return status == MHE_OK ? extend_motion(d, arena, out, err) : status;
}

mhe_status mhi_joints_exact_paths(const mhe_plugin *model, const void *config, mhi_arena *arena,
                                  const void **exact, mhe_error *err) {
    void *own = mhi_arena_take(arena, model->config_size);
    if (own == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    memcpy(own, config, model->config_size);
    for (uint32_t i = 0; i < model->option_count; i++) {
        const mhe_option *o = &model->options[i];
        if (strcmp(o->key, "paths") == 0 && o->type == MHE_TYPE_ENUM) {
            const int32_t choice = mhi_choice_find(o->choices, "exact");
            if (choice >= 0) {
                memcpy((char *)own + o->offset, &choice, sizeof choice);
            }
        }
    }
    *exact = own;
    return MHE_OK;
}

void mhi_joints_reaction(const mhe_description *d, int32_t i, const double *poses,
                         const double *tau, int32_t n, int32_t axes, double out[6]) {
    const double *r = poses + (ptrdiff_t)12 * i + 3, *child = d->bodies[i].body_r;
    const int32_t parent = d->bodies[i].parent;
    const double *to = poses + (ptrdiff_t)12 * parent + 3; /* not of ground */
    for (int part = 0; part < 2; part++) {
        const double *local = tau + n + (ptrdiff_t)SIX * i + (ptrdiff_t)3 * part;
        double *of = out + (ptrdiff_t)3 * part, ground[3];
        for (int k = 0; k < 3; k++) { /* the frame's axes in the body: body_r' */
            of[k] = child[k] * local[0] + child[3 + k] * local[1] + child[6 + k] * local[2];
        }
        if (axes == MHI_IN_CHILD) {
            continue;
        }
        for (int k = 0; k < 3; k++) {
            ground[k] = r[3 * k] * of[0] + r[3 * k + 1] * of[1] + r[3 * k + 2] * of[2];
        }
        memcpy(of, ground, sizeof ground);
        for (int k = 0; k < 3 && axes == MHI_IN_PARENT && parent >= 0; k++) {
            of[k] = to[k] * ground[0] + to[3 + k] * ground[1] + to[6 + k] * ground[2];
        }
    }
}
