/* SPDX-License-Identifier: Apache-2.0 */
/* tree_check.c: refuses descriptions that cannot be a tree of rigid bodies. */
#include "tree.h"

#include "vector.h"

#include <math.h>

static int all_finite(const double *values, int32_t n) {
    double sum = 0;
    for (int32_t i = 0; i < n; i++) {
        sum += values[i] * 0.0;
    }
    return sum == 0;
}

/* Columns of unit length at right angles. A mirrored frame passes: files do hold pairs of them that
 * undo each other; what is left at the joints is checked after the reduction. */
static int is_orthogonal(const double *r) {
    return off_orthogonal3(r) < 1e-3; /* files round to as few as four digits */
}

static mhe_status check_motion(const mhe_motion *motion, int32_t n_coordinates, const char *body,
                               mhe_error *err) {
    if (motion->coordinate < -1 || motion->coordinate >= n_coordinates) {
        return mhe_fail(err, MHE_E_INPUT,
                        "body '%s': a motion of coordinate %d, which is not there", body,
                        (int)motion->coordinate);
    }
    if (motion->kind != MHE_MOTION_ROTATION && motion->kind != MHE_MOTION_TRANSLATION) {
        return mhe_fail(err, MHE_E_INPUT, "body '%s': a motion of unknown kind %d", body,
                        (int)motion->kind);
    }
    if (!(fabs(dot3(motion->axis, motion->axis) - 1) < 1e-6)) {
        return mhe_fail(err, MHE_E_INPUT, "body '%s': a motion's axis is not a unit vector", body);
    }
    const mhe_function *f = &motion->function;
    if (f->n_pieces < 1 || f->n_coef < 1 || !all_finite(f->coef, f->n_coef * f->n_pieces) ||
        !all_finite(f->origin, f->n_pieces)) {
        return mhe_fail(err, MHE_E_INPUT, "body '%s': a motion's function is not finite", body);
    }
    return MHE_OK;
}

static mhe_status check_body(const mhe_description *d, int32_t i, mhe_error *err) {
    const mhe_body *body = &d->bodies[i];
    if (body->parent < -1 || body->parent >= i) {
        return mhe_fail(err, MHE_E_INPUT, "body '%s': its parent is not listed before it",
                        body->name);
    }
    if (!is_orthogonal(body->joint_r) || !is_orthogonal(body->body_r) ||
        !all_finite(body->joint_p, 3) || !all_finite(body->body_p, 3)) {
        return mhe_fail(err, MHE_E_INPUT,
                        "body '%s': a frame of its joint is not a rigid placement", body->name);
    }
    if (!(body->mass >= 0) || !all_finite(&body->mass, 1)) {
        return mhe_fail(err, MHE_E_INPUT, "body '%s': mass %g kg is not a finite number >= 0",
                        body->name, body->mass);
    }
    if (!all_finite(body->com, 3) || !all_finite(body->inertia, 9)) {
        return mhe_fail(err, MHE_E_INPUT, "body '%s': centre of mass or inertia is not finite",
                        body->name);
    }
    for (int32_t k = 0; k < body->n_motions; k++) {
        mhe_status status =
            check_motion(&body->motions[k], d->n_coordinates + d->n_dependents, body->name, err);
        if (status != MHE_OK) {
            return status;
        }
    }
    return MHE_OK;
}

static int is_place(const mhe_description *d, int32_t body, const double *location) {
    return body >= -1 && body < d->n_bodies && all_finite(location, 3);
}

mhe_status tree_check_description(const mhe_description *d, mhe_error *err) {
    if (!all_finite(d->gravity, 3)) {
        return mhe_fail(err, MHE_E_INPUT, "gravity is not finite");
    }
    mhe_status sound = check_dependents(d, err);
    if (sound != MHE_OK) {
        return sound;
    }
    for (int32_t i = 0; i < d->n_bodies; i++) {
        mhe_status status = check_body(d, i, err);
        if (status != MHE_OK) {
            return status;
        }
    }
    for (int32_t i = 0; i < d->n_markers; i++) {
        if (!is_place(d, d->markers[i].body, d->markers[i].location)) {
            return mhe_fail(err, MHE_E_INPUT, "marker '%s': its body or location is not valid",
                            d->markers[i].name);
        }
    }
    if (d->n_muscles > d->n_paths) {
        return mhe_fail(err, MHE_E_INPUT, "%d muscles, but %d paths", (int)d->n_muscles,
                        (int)d->n_paths);
    }
    return check_paths(d, err);
}

static mhe_status check_joint_frames(const tree *t, const mhe_description *d, mhe_error *err) {
    for (int32_t i = 0; i < t->n_joints; i++) {
        const tree_joint *joint = &t->joints[i];
        double normal[3];
        cross3(joint->r, joint->r + 3, normal);
        if (dot3(normal, joint->r + 6) < 0) {
            return mhe_fail(err, MHE_E_INPUT, "coordinate '%s': its joint's frame is mirrored",
                            d->coordinates[joint->coordinate].name);
        }
    }
    return MHE_OK;
}

mhe_status tree_check_joints(const tree *t, const mhe_description *d, mhe_error *err) {
    if (t->n_q < 1) {
        return mhe_fail(err, MHE_E_INPUT, "the model has no coordinate");
    }
    return check_joint_frames(t, d, err);
}

int32_t tree_moves_mass(const tree *t, int32_t coordinate) {
    for (int32_t i = 0; i < t->n_joints; i++) {
        for (int32_t up = i; up >= 0 && t->joints[i].mass > 0; up = t->joints[up].parent) {
            if (t->joints[up].coordinate == coordinate) {
                return 1;
            }
        }
    }
    return 0;
}
