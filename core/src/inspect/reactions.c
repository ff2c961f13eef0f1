/* SPDX-License-Identifier: Apache-2.0 */
/* reactions.c: what joints transmit.
 *
 * Each joint gets six motions more, three shifts along and three turns about the axes of the
 * joint's frame in the child, all held at 0. The generalised force that inverse dynamics finds on
 * such a motion, with every load applied, is what the joint has to give there: force and moment on
 * the child at that frame's origin. The moments of turns in a row are about the frame's own axes,
 * because the turns stand at 0. */
#include "inspect/inspected.h"
#include "model/actuators.h"

#include <string.h>

#define SIX 6

static const double one[2] = {0, 1}, zero[1] = {0};

/* `d` with six motions more between each joint's own and its child; coordinates of body i are
 * [n + 6 i, n + 6 i + 6). */
static mhe_status add_motions(mhi_inspected *m, mhe_description *out, mhe_error *err) {
    const mhe_description *d = m->all;
    const int32_t n = d->n_coordinates, n_more = SIX * d->n_bodies;
    mhe_body *bodies = MHI_TAKE(&m->arena, mhe_body, d->n_bodies);
    mhe_coordinate *coordinates = MHI_TAKE(&m->arena, mhe_coordinate, n + n_more);
    mhe_dependent *dependents = MHI_TAKE(&m->arena, mhe_dependent, d->n_dependents);
    if (bodies == NULL || coordinates == NULL || dependents == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    *out = *d;
    memcpy(coordinates, d->coordinates, sizeof *coordinates * (size_t)n);
    for (int32_t i = 0; i < n_more; i++) {
        coordinates[n + i] = (mhe_coordinate){.name = "of a joint", .lower = -1, .upper = 1};
    }
    for (int32_t i = 0; i < d->n_bodies; i++) {
        const int32_t own = d->bodies[i].n_motions;
        mhe_motion *motions = MHI_TAKE(&m->arena, mhe_motion, own + SIX);
        if (motions == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        memcpy(motions, d->bodies[i].motions, sizeof *motions * (size_t)own);
        for (int k = 0; k < own; k++) { /* numbers of dependents move up */
            motions[k].coordinate += motions[k].coordinate >= n ? n_more : 0;
        }
        for (int k = 0; k < SIX; k++) {
            motions[own + k] =
                (mhe_motion){.kind = k < 3 ? MHE_MOTION_TRANSLATION : MHE_MOTION_ROTATION,
                             .coordinate = n + SIX * i + k,
                             .function = {.origin = zero, .coef = one, .n_pieces = 1, .n_coef = 2}};
            motions[own + k].axis[k % 3] = 1;
        }
        bodies[i] = d->bodies[i];
        bodies[i].motions = motions;
        bodies[i].n_motions = own + SIX;
    }
    for (int32_t i = 0; i < d->n_dependents; i++) {
        dependents[i] = d->dependents[i];
        dependents[i].independent += dependents[i].independent >= n ? n_more : 0;
    }
    out->bodies = bodies;
    out->coordinates = coordinates;
    out->n_coordinates = n + n_more;
    out->dependents = dependents;
    return MHE_OK;
}

/* Points and polynomials speak of coordinates too. */
static mhe_status move_numbers(mhi_inspected *m, mhe_description *out, mhe_error *err) {
    const mhe_description *d = m->all;
    const int32_t n = d->n_coordinates, n_more = out->n_coordinates - n;
    mhe_path *paths = MHI_TAKE(&m->arena, mhe_path, d->n_paths);
    if (paths == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < d->n_paths; i++) {
        mhe_path_point *points = MHI_TAKE(&m->arena, mhe_path_point, d->paths[i].n_points);
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
            mhe_polynomial *length = MHI_TAKE(&m->arena, mhe_polynomial, 1);
            int32_t *numbers = MHI_TAKE(&m->arena, int32_t, d->paths[i].length->n);
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

/* tau of all loads that are given: paths, actuators, external ones. */
static mhe_status applied(mhi_inspected *m, const mhi_skeleton *s, const mhi_pose *pose,
                          const double *length_q, double *tau, mhe_error *err) {
    const mhe_description *d = s->description;
    const int32_t n = d->n_coordinates;
    for (int32_t i = 0; i < d->n_paths; i++) {
        for (int32_t k = 0; k < n; k++) {
            tau[k] -= length_q[(ptrdiff_t)i * n + k] * pose->force[i];
        }
    }
    mhe_status status = pose->n_loads > 0 ? s->ops->loads(s->context, pose->loads, pose->n_loads,
                                                          pose->load_values, tau, NULL, NULL, err)
                                          : MHE_OK;
    for (int32_t i = 0; i < d->n_actuators && status == MHE_OK; i++) {
        const mhe_actuator *a = &d->actuators[i];
        const double f = pose->actuator[i];
        double value[18];
        mhe_load loads[2];
        if (a->kind == MHE_ACTUATOR_COORDINATE || f == 0) {
            continue; /* acts through the joint itself: part of what it transmits */
        }
        const int32_t n_loads = mhi_actuator_loads(a, f, loads, value);
        status = s->ops->loads(s->context, loads, n_loads, value, tau, NULL, NULL, err);
    }
    (void)m;
    return status;
}

/* Force and moment of body i's joint, from its frame's axes to ground. */
static void add_reaction(const mhe_description *d, int32_t i, const double *body, const double *tau,
                         int32_t first, cJSON *out) {
    const double *r = body + (ptrdiff_t)12 * i + 3, *child = d->bodies[i].body_r;
    const char *name = d->joints != NULL && d->joints[i] != NULL ? d->joints[i] : d->bodies[i].name;
    cJSON *reaction = cJSON_AddObjectToObject(out, name);
    for (int part = 0; part < 2; part++) {
        const double *local = tau + first + (ptrdiff_t)SIX * i + (ptrdiff_t)3 * part;
        double in_body[3], ground[3];
        for (int k = 0; k < 3; k++) { /* the frame's axes in the body: body_r' */
            in_body[k] = child[k] * local[0] + child[3 + k] * local[1] + child[6 + k] * local[2];
        }
        for (int k = 0; k < 3; k++) {
            ground[k] =
                r[3 * k] * in_body[0] + r[3 * k + 1] * in_body[1] + r[3 * k + 2] * in_body[2];
        }
        (void)cJSON_AddItemToObject(reaction, part == 0 ? "force" : "moment",
                                    mhi_json_numbers(ground, 3));
    }
}

static mhe_status solve(mhi_inspected *m, const mhi_skeleton *s, const mhi_pose *pose, cJSON *out,
                        mhe_error *err) {
    const mhe_description *d = s->description;
    const int32_t n = d->n_coordinates, own = m->all->n_coordinates;
    double *q = MHI_TAKE(&m->arena, double, 5 * n);
    double *length_q = MHI_TAKE(&m->arena, double, d->n_paths *n);
    double *body = MHI_TAKE(&m->arena, double, 12 * d->n_bodies);
    if (q == NULL || length_q == NULL || body == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    double *v = q + n, *a = v + n, *tau = a + n, *load = tau + n;
    memcpy(q, pose->q, sizeof *q * (size_t)own);
    memcpy(v, pose->v, sizeof *v * (size_t)own);
    memcpy(a, pose->a, sizeof *a * (size_t)own);
    const mhe_kinematics wanted = {.size = sizeof wanted, .length_q = length_q, .body = body};
    mhe_status status = s->ops->kinematics(s->context, q, v, &wanted, err);
    if (status == MHE_OK) {
        status = s->ops->inverse_dynamics(s->context, a, tau, NULL, NULL, err);
    }
    if (status == MHE_OK) {
        status = applied(m, s, pose, length_q, load, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    for (int32_t i = 0; i < n; i++) {
        tau[i] -= load[i];
    }
    cJSON *reactions = cJSON_AddObjectToObject(out, "reactions");
    for (int32_t i = 0; i < d->n_bodies; i++) {
        add_reaction(d, i, body, tau, own, reactions);
    }
    return MHE_OK;
}

mhe_status mhi_reactions(mhi_inspected *m, const mhi_pose *pose, cJSON *out, mhe_error *err) {
    mhe_description *d = MHI_TAKE(&m->arena, mhe_description, 1);
    mhi_skeleton skeleton = {0};
    mhe_status status =
        d == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : add_motions(m, d, err);
    if (status == MHE_OK) {
        status = move_numbers(m, d, err);
    }
    if (status == MHE_OK) {
        status = mhi_skeleton_open(m, d, &skeleton, err);
    }
    if (status == MHE_OK) {
        status = solve(m, &skeleton, pose, out, err);
    }
    mhi_skeleton_close(&skeleton);
    return status;
}
