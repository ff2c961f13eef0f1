/* SPDX-License-Identifier: Apache-2.0 */
/* tree.c: reduces a description to links and joints of one freedom. */
#include "tree.h"

#include "numbers.h"
#include "route.h"
#include "vector.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Frames of a file with all digits, multiplied, are rotations to less than this. */
#define ROUNDING 1e-13

typedef tree_place placement;

static const placement ground = {.link = -1, .r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};

static int function_is_constant(const mhe_function *function) {
    for (int32_t i = 0; i < function->n_pieces; i++) {
        const double *c = function->coef + i * function->n_coef;
        if (c[0] != function->coef[0]) {
            return 0;
        }
        for (int32_t k = 1; k < function->n_coef; k++) {
            if (c[k] != 0) {
                return 0;
            }
        }
    }
    return 1;
}

static double motion_constant(const mhe_motion *motion) {
    double value[4];
    function_evaluate(&motion->function, 0, value);
    return value[0];
}

/* at = at * (r, p) */
static void placement_move(placement *at, const double *r, const double *p) {
    double turned[9];
    place3(at->r, at->p, p, at->p);
    multiply3(at->r, r, turned);
    memcpy(at->r, turned, sizeof turned);
}

/* Rotation by `angle` about unit vector `axis` (Rodrigues). */
static void rotation_about(const double *axis, double angle, double *r) {
    double s = sin(angle), c = cos(angle);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            r[3 * i + j] = (1 - c) * axis[i] * axis[j] + (i == j ? c : 0);
        }
    }
    r[1] -= s * axis[2];
    r[2] += s * axis[1];
    r[3] += s * axis[2];
    r[5] -= s * axis[0];
    r[6] -= s * axis[1];
    r[7] += s * axis[0];
}

/* A rotation whose column `column` is `axis`. */
static void frame_along(const double *axis, int column, double *r) {
    int least = 0; /* the ground axis farthest from `axis` */
    for (int i = 1; i < 3; i++) {
        least = fabs(axis[i]) < fabs(axis[least]) ? i : least;
    }
    double side[3] = {0, 0, 0}, third[3];
    side[least] = 1;
    cross3(side, axis, side);
    double norm = sqrt(dot3(side, side));
    for (int i = 0; i < 3; i++) {
        side[i] /= norm;
    }
    cross3(axis, side, third);
    for (int i = 0; i < 3; i++) {
        r[3 * i + column] = axis[i];
        r[3 * i + (column + 1) % 3] = side[i];
        r[3 * i + (column + 2) % 3] = third[i];
    }
}

/* Passes a motion: a constant one moves `at` within its link, a free one begins a new link. */
static void tree_add_motion(const mhe_description *d, tree *t, const mhe_motion *motion,
                            placement *at) {
    double norm = sqrt(dot3(motion->axis, motion->axis));
    double axis[3], turn[9];
    for (int i = 0; i < 3; i++) {
        axis[i] = motion->axis[i] / norm;
    }
    int rotation = motion->kind == MHE_MOTION_ROTATION;
    if (motion->coordinate < 0 || function_is_constant(&motion->function)) {
        double value = motion_constant(motion);
        double shift[3] = {0, 0, 0};
        memcpy(turn, ground.r, sizeof turn);
        if (rotation) {
            rotation_about(axis, value, turn);
        } else {
            for (int i = 0; i < 3; i++) {
                shift[i] = value * axis[i];
            }
        }
        placement_move(at, turn, shift);
        return;
    }
    tree_joint *joint = &t->joints[t->n_joints];
    frame_along(axis, rotation ? 2 : 0, turn);
    joint->parent = at->link;
    joint->kind = motion->kind;
    joint->number = motion->coordinate;
    joint->coordinate = number_root(d, motion->coordinate);
    joint->function = &motion->function;
    joint->affine = joint->number < d->n_coordinates && joint->function->n_pieces == 1 &&
                    joint->function->n_coef == 2;
    memcpy(joint->p, at->p, sizeof joint->p);
    multiply3(at->r, turn, joint->r);

    *at = ground; /* the moved link's frame, turned back to the axes before the motion */
    at->link = t->n_joints++;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            at->r[3 * i + j] = turn[3 * j + i];
        }
    }
}

/* Adds a body's mass to its link (parallel axes). As in OpenSim, a body without mass has no inertia
 * either. */
static void tree_add_mass(tree *t, const mhe_body *body, const placement *at) {
    if (at->link < 0 || body->mass <= 0) {
        return;
    }
    tree_joint *link = &t->joints[at->link];
    double com[3], inertia[9], apart[3];
    place3(at->r, at->p, body->com, com);
    congruence3(at->r, body->inertia, inertia);
    double total = link->mass + body->mass;
    for (int i = 0; i < 3; i++) {
        apart[i] = com[i] - link->com[i];
        link->com[i] += body->mass / total * apart[i];
    }
    for (int i = 0; i < 9; i++) {
        link->inertia[i] += inertia[i];
    }
    add_point_inertia(link->mass * body->mass / total, apart, link->inertia);
    add_outer3(link->points, link->mass * body->mass / total, apart, apart);
    link->mass = total;
}

static tree_point tree_point_at(const placement *places, int32_t body, const double *location) {
    const placement *at = body < 0 ? &ground : &places[body];
    tree_point point = {.link = at->link};
    place3(at->r, at->p, location, point.at);
    return point;
}

/* Writes the joints from link `from` down to, and without, its ancestor `until`, outermost last. */
static int32_t tree_chain(const tree *t, int32_t from, int32_t until, int32_t *out) {
    int32_t n = 0;
    for (int32_t i = from; i != until; i = t->joints[i].parent) {
        n++;
    }
    for (int32_t i = from, k = n; i != until; i = t->joints[i].parent) {
        out[--k] = i;
    }
    return n;
}

static int32_t tree_common_ancestor(const tree *t, int32_t a, int32_t b) {
    while (a != b) { /* parents have smaller numbers */
        if (a > b) {
            a = t->joints[a].parent;
        } else {
            b = t->joints[b].parent;
        }
    }
    return a;
}

static void tree_add_path(tree *t, int32_t muscle, const mhe_path *m, const placement *places,
                          int32_t **chain) {
    for (int32_t k = 0; k < m->n_points; k++) {
        int32_t here = t->n_points++;
        t->points[here] = tree_point_at(places, m->points[k].body, m->points[k].location);
        if (k == 0 || !route_is_plain(m, k - 1)) {
            continue;
        }
        const tree_point *a = &t->points[here - 1], *b = &t->points[here];
        if (a->link == b->link) {
            double d[3] = {b->at[0] - a->at[0], b->at[1] - a->at[1], b->at[2] - a->at[2]};
            t->fixed_length[muscle] += sqrt(dot3(d, d));
            continue;
        }
        tree_segment *segment = &t->segments[t->n_segments++];
        int32_t meet = tree_common_ancestor(t, a->link, b->link);
        segment->muscle = muscle;
        segment->from = here - 1;
        segment->to = here;
        segment->joints = *chain;
        segment->n_to = tree_chain(t, b->link, meet, *chain);
        *chain += segment->n_to;
        segment->n_from = tree_chain(t, a->link, meet, *chain);
        *chain += segment->n_from;
        int32_t length = segment->n_to + segment->n_from;
        t->max_chain = length > t->max_chain ? length : t->max_chain;
    }
}

static mhe_status tree_allocate(const mhe_description *d, tree *t) {
    size_t n_joints = 0, n_points = 0;
    for (int32_t i = 0; i < d->n_bodies; i++) {
        n_joints += (size_t)d->bodies[i].n_motions;
    }
    for (int32_t i = 0; i < d->n_paths; i++) {
        n_points += (size_t)d->paths[i].n_points;
    }
    t->joints = calloc(n_joints + 1, sizeof *t->joints);
    t->bodies = calloc((size_t)d->n_bodies + 1, sizeof *t->bodies);
    t->markers = calloc((size_t)d->n_markers + 1, sizeof *t->markers);
    t->points = calloc(n_points + 1, sizeof *t->points);
    t->fixed_length = calloc((size_t)d->n_paths + 1, sizeof *t->fixed_length);
    t->segments = calloc(n_points + 1, sizeof *t->segments);
    t->chains = calloc(n_points * n_joints + 1, sizeof *t->chains);
    return t->joints != NULL && t->bodies != NULL && t->markers != NULL && t->points != NULL &&
                   t->fixed_length != NULL && t->segments != NULL && t->chains != NULL
               ? MHE_OK
               : MHE_E_MEMORY;
}

static void tree_build(const mhe_description *d, tree *t) {
    placement *places = t->bodies;
    t->n_q = d->n_coordinates;
    t->n_markers = d->n_markers;
    t->n_muscles = d->n_paths;
    t->n_bodies = d->n_bodies;
    memcpy(t->gravity, d->gravity, sizeof t->gravity);
    for (int32_t i = 0; i < d->n_bodies; i++) {
        const mhe_body *body = &d->bodies[i];
        placement at = body->parent < 0 ? ground : places[body->parent];
        placement_move(&at, body->joint_r, body->joint_p);
        for (int32_t k = 0; k < body->n_motions; k++) {
            tree_add_motion(d, t, &body->motions[k], &at);
        }
        placement_move(&at, body->body_r, body->body_p);
        tree_add_mass(t, body, &at);
        places[i] = at;
    }
    for (int32_t i = 0; i < d->n_markers; i++) {
        t->markers[i] = tree_point_at(places, d->markers[i].body, d->markers[i].location);
    }
    t->direct = t->n_joints == t->n_q;
    for (int32_t i = 0; i < t->n_joints; i++) {
        const tree_joint *joint = &t->joints[i];
        t->rounded |= off_orthogonal3(joint->r) > ROUNDING;
        t->direct =
            t->direct && joint->affine && joint->number == i && joint->function->coef[1] == 1;
    }
    int32_t *chain = t->chains;
    for (int32_t i = 0; i < d->n_paths; i++) {
        tree_add_path(t, i, &d->paths[i], places, &chain);
    }
}

mhe_status tree_create(const mhe_description *description, tree **out, mhe_error *err) {
    *out = NULL;
    mhe_status status = tree_check_description(description, err);
    if (status != MHE_OK) {
        return status;
    }
    tree *t = calloc(1, sizeof *t);
    if (t == NULL || tree_allocate(description, t) != MHE_OK) {
        status = mhe_fail(err, MHE_E_MEMORY, "no memory for the model's tree");
        goto fail;
    }
    tree_build(description, t);
    status = tree_check_joints(t, description, err);
    if (status != MHE_OK) {
        goto fail;
    }
    *out = t;
    return MHE_OK;

fail:
    tree_free(t);
    return status;
}

void tree_free(tree *t) {
    if (t != NULL) {
        free(t->joints);
        free(t->bodies);
        free(t->markers);
        free(t->points);
        free(t->fixed_length);
        free(t->segments);
        free(t->chains);
        free(t);
    }
}
