/* SPDX-License-Identifier: Apache-2.0 */
#include "model/joint_force.h"

#include "model/joints.h"
#include "model/system_private.h"
#include "plugin/instance.h"

#include <stdlib.h>
#include <string.h>

#define AXES 3

struct mhi_joint_force {
    const mhi_system *system;
    int32_t body;             /* that the joint carries */
    uint8_t *beyond;          /* [n_bodies] 1: the joint carries it */
    int32_t *path;            /* [n_paths of the loosened one] which of the system's */
    mhe_description loosened; /* with the shifts, and only the paths that cross the joint */
    mhe_host quiet;
    void *self;
    mhi_arena arena;
};

struct mhi_joint_force_context {
    const mhi_joint_force *joint;
    void *model;
    double *q, *v, *a;              /* [n + 3]: zeros follow the coordinates */
    double *vdot, *vdot_q, *vdot_v; /* of the system [n], [n x n] */
    double *vdot_a, *vdot_r, *vdot_z;
    double *mass, *bias; /* of the loosened one, n + 3 wide */
    double *length_q, *length_qq;
    double *tau, *tau_q, *tau_v;
    double *given, *given_q;
    double *tension, *tension_l, *tension_w; /* of the system's paths */
    double *rows;                            /* [3 x n_z] along the shifts */
    mhi_arena arena;
};

static size_t doubles(int32_t n) {
    return sizeof(double) * (size_t)n;
}

/* ---- what it is made of ---- */

static const char *joint_name(const mhe_description *d, int32_t i) {
    return d->joints != NULL && d->joints[i] != NULL ? d->joints[i] : d->bodies[i].name;
}

static mhe_status find_joint(mhi_joint_force *j, const char *name, mhe_error *err) {
    const mhe_description *d = j->system->description;
    char has[512] = "";
    for (int32_t i = 0; i < d->n_bodies; i++) {
        if (strcmp(joint_name(d, i), name) == 0 || strcmp(d->bodies[i].name, name) == 0) {
            j->body = i;
            return MHE_OK;
        }
        const size_t used = strlen(has); /* as many as fit */
        (void)snprintf(has + used, sizeof has - used, "%s%s", i > 0 ? ", " : "", joint_name(d, i));
    }
    return mhe_fail(err, MHE_E_CONFIG, "the model has no joint '%s' (it has %s)", name, has);
}

static int32_t is_beyond(const mhi_joint_force *j, int32_t body) {
    return body >= 0 && j->beyond[body];
}

static mhe_status find_bodies(mhi_joint_force *j, mhe_error *err) {
    const mhe_description *d = j->system->description;
    j->beyond = MHI_TAKE(&j->arena, uint8_t, d->n_bodies);
    if (j->beyond == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < d->n_bodies; i++) { /* parents first */
        j->beyond[i] = i == j->body || is_beyond(j, d->bodies[i].parent);
    }
    return MHE_OK;
}

/* What acts on the far side alone would have to be told apart from what the joint gives. */
static mhe_status refuse(const mhi_joint_force *j, const char *what, const char *name,
                         mhe_error *err) {
    return mhe_fail(err, MHE_E_UNSUPPORTED,
                    "what joint '%s' transmits is not known: %s '%s' acts across it",
                    joint_name(j->system->description, j->body), what, name);
}

static mhe_status check_parts(const mhi_joint_force *j, mhe_error *err) {
    const mhi_system *s = j->system;
    const mhe_description *d = s->description;
    for (int32_t i = 0; i < d->n_paths; i++) {
        if (d->paths[i].length != NULL) {
            return refuse(j, "the path without points of", d->paths[i].name, err);
        }
    }
    for (int32_t i = 0; i < d->n_loops; i++) {
        if (is_beyond(j, d->loops[i].body[0]) != is_beyond(j, d->loops[i].body[1])) {
            return refuse(j, "loop", d->loops[i].name, err);
        }
    }
    for (int32_t i = 0; i < s->n_forces; i++) {
        const mhe_force_layout *l = &s->forces[i].layout;
        for (int32_t k = 0; k < l->n_pairs; k++) {
            if (is_beyond(j, l->pairs[k].body[0]) != is_beyond(j, l->pairs[k].body[1])) {
                return refuse(j, "a pair of frames of", s->forces[i].name, err);
            }
        }
    }
    for (int32_t i = 0; i < s->n_actuators; i++) {
        const mhe_actuator *a = &d->actuators[i];
        if (a->kind == MHE_ACTUATOR_POINT && is_beyond(j, a->body[0])) {
            return refuse(j, "actuator", a->name, err);
        }
    }
    return MHE_OK;
}

static int32_t crosses(const mhi_joint_force *j, const mhe_path *path) {
    const mhe_description *d = j->system->description;
    int32_t sides = 0;
    for (int32_t i = 0; i < path->n_points; i++) {
        sides |= is_beyond(j, path->points[i].body) ? 2 : 1;
    }
    for (int32_t i = 0; i < path->n_wraps; i++) {
        sides |= is_beyond(j, d->obstacles[path->wraps[i].obstacle].body) ? 2 : 1;
    }
    return sides == 3;
}

/* Leaves the paths that cross the joint; markers, loops and springs are of no use there. */
static mhe_status keep_paths(mhi_joint_force *j, mhe_error *err) {
    mhe_description *d = &j->loosened;
    mhe_path *paths = MHI_TAKE(&j->arena, mhe_path, d->n_paths);
    j->path = MHI_TAKE(&j->arena, int32_t, d->n_paths);
    if (paths == NULL || j->path == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    int32_t n = 0;
    for (int32_t p = 0; p < d->n_paths; p++) {
        if (crosses(j, &d->paths[p])) {
            paths[n] = d->paths[p];
            j->path[n++] = p;
        }
    }
    d->paths = paths;
    d->n_paths = n;
    d->n_muscles = d->n_markers = d->n_loops = d->n_path_springs = d->n_ligaments = 0;
    d->n_actuators = d->n_limits = d->n_coordinate_springs = d->n_bushings = 0;
    return MHE_OK;
}

static mhe_status build(mhi_joint_force *j, const char *name, mhe_error *err) {
    const mhi_system *s = j->system;
    mhe_status status = find_joint(j, name, err);
    if (status == MHE_OK) {
        status = find_bodies(j, err);
    }
    if (status == MHE_OK) {
        status = check_parts(j, err);
    }
    if (status == MHE_OK) {
        status = mhi_joints_loosen(s->description, j->body, &j->arena, &j->loosened, err);
    }
    if (status == MHE_OK) {
        status = keep_paths(j, err);
    }
    j->quiet = mhi_host_quiet(s->host.data); /* the system's own model has told all */
    return status == MHE_OK ? mhi_model_create(s->model_plugin, &j->quiet, &j->loosened,
                                               s->model_config, &j->self, err)
                            : status;
}

mhe_status mhi_joint_force_create(const mhi_system *system, const char *name,
                                  mhi_joint_force **joint, mhe_error *err) {
    *joint = NULL;
    mhi_joint_force *j = calloc(1, sizeof *j);
    if (j == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    j->system = system;
    const mhe_status status = build(j, name, err);
    if (status != MHE_OK) {
        mhi_joint_force_free(j);
        return status;
    }
    *joint = j;
    return MHE_OK;
}

void mhi_joint_force_free(mhi_joint_force *j) {
    if (j == NULL) {
        return;
    }
    if (j->self != NULL) {
        j->system->model->destroy(j->self);
    }
    mhi_arena_free(&j->arena);
    free(j);
}

/* ---- contexts ---- */

static mhe_status take(mhi_joint_force_context *c, mhe_error *err) {
    const mhe_system *f = &c->joint->system->face;
    const int32_t n_q = f->n_q, n = n_q + AXES, n_p = c->joint->loosened.n_paths;
    const int32_t n_all = c->joint->system->n_paths;
    const mhi_room rooms[] = {{&c->q, n},
                              {&c->v, n},
                              {&c->a, n},
                              {&c->vdot, n_q},
                              {&c->vdot_q, n_q * n_q},
                              {&c->vdot_v, n_q * n_q},
                              {&c->vdot_a, n_q * f->n_a},
                              {&c->vdot_r, n_q * f->n_r},
                              {&c->vdot_z, n_q * f->n_z},
                              {&c->mass, n * n},
                              {&c->bias, n},
                              {&c->length_q, n_p * n},
                              {&c->length_qq, n_p * n * n},
                              {&c->tau, n},
                              {&c->tau_q, n * n},
                              {&c->tau_v, n * n},
                              {&c->given, n},
                              {&c->given_q, n * n},
                              {&c->tension, n_all},
                              {&c->tension_l, n_all},
                              {&c->tension_w, n_all},
                              {&c->rows, AXES * (f->n_x + f->n_u)}};
    return MHI_TAKE_ROOMS(&c->arena, rooms, err);
}

mhe_status mhi_joint_force_context_create(const mhi_joint_force *joint,
                                          mhi_joint_force_context **context, mhe_error *err) {
    *context = NULL;
    mhi_joint_force_context *c = calloc(1, sizeof *c);
    if (c == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    c->joint = joint;
    mhe_status status = take(c, err);
    if (status == MHE_OK) {
        status = joint->system->model->context_create(joint->self, &c->model, err);
    }
    if (status != MHE_OK) {
        mhi_joint_force_context_free(c);
        return status;
    }
    *context = c;
    return MHE_OK;
}

void mhi_joint_force_context_free(mhi_joint_force_context *c) {
    if (c == NULL) {
        return;
    }
    if (c->model != NULL) {
        c->joint->system->model->context_destroy(c->model);
    }
    mhi_arena_free(&c->arena);
    free(c);
}

/* ---- evaluation ---- */

typedef struct load_call {
    mhi_joint_force_context *c;
    int32_t derivatives;
} load_call;

static mhe_status add_loads(void *data, const mhe_load *loads, int32_t n, const double *values,
                            mhe_error *err) {
    const load_call *call = data;
    mhi_joint_force_context *c = call->c;
    return c->joint->system->model->loads(c->model, loads, n, values, c->given,
                                          call->derivatives ? c->given_q : NULL, NULL, err);
}

/* The loosened model at the system's state, its accelerations and all pulls. */
static mhe_status gather(mhi_joint_force_context *c, mhi_system_context *system,
                         const mhe_system_point *at, int32_t derivatives, mhe_error *err) {
    const mhi_system *s = c->joint->system;
    const mhe_description *d = &c->joint->loosened;
    const int32_t n_q = s->face.n_q, n = n_q + AXES;
    memset(c->tension, 0, doubles(s->n_paths));
    memset(c->tension_l, 0, doubles(s->n_paths));
    memset(c->tension_w, 0, doubles(s->n_paths));
    memset(c->given, 0, doubles(n));
    memset(c->given_q, 0, doubles(derivatives ? n * n : 0));
    memcpy(c->tension, system->force, doubles(s->face.n_m));
    memcpy(c->q, at->q, doubles(n_q)); /* the shifts stay at 0 */
    memcpy(c->v, at->v, doubles(n_q));
    memcpy(c->a, c->vdot, doubles(n_q));
    const mhe_kinematics seen = {.size = sizeof seen,
                                 .mass = derivatives ? c->mass : NULL,
                                 .length_q = d->n_paths > 0 ? c->length_q : NULL,
                                 .length_qq = d->n_paths > 0 && derivatives ? c->length_qq : NULL};
    mhe_status status = s->model->kinematics(c->model, c->q, c->v, &seen, err);
    if (status == MHE_OK) {
        status = s->model->inverse_dynamics(c->model, c->a, c->tau, derivatives ? c->tau_q : NULL,
                                            derivatives ? c->tau_v : NULL, err);
    }
    if (status == MHE_OK && s->n_forces > 0) {
        const mhi_path_pulls pulls = {c->tension, derivatives ? c->tension_l : NULL,
                                      derivatives ? c->tension_w : NULL};
        load_call call = {c, derivatives};
        status = mhi_forces_pull(system, at, &pulls, add_loads, &call, err);
    }
    return status;
}

/* row [n_columns] += sum_i by[i] rows[i] */
static void add_rows(const double *by, const double *rows, int32_t n, int32_t n_columns,
                     double *row) {
    for (int32_t i = 0; i < n; i++) {
        for (int32_t k = 0; k < n_columns; k++) {
            row[k] += by[i] * rows[i * n_columns + k];
        }
    }
}

/* What path p's tension makes of shift s by the columns of z. */
static void add_pull(const mhi_joint_force_context *c, const mhi_system_context *system, int32_t i,
                     int32_t shift, int32_t activation, double *row) {
    const mhi_system *s = c->joint->system;
    const mhe_system *f = &s->face;
    const int32_t n_q = f->n_q, n = n_q + AXES, p = c->joint->path[i];
    const double by = c->length_q[i * n + shift], tension = c->tension[p];
    const double *bend = c->length_qq + (ptrdiff_t)(i * n + shift) * n;
    const double *l_q = system->length_q + p * n_q, *w_q = system->velocity_q + p * n_q;
    for (int32_t k = 0; k < n_q; k++) {
        row[k] += bend[k] * tension + by * (c->tension_l[p] * l_q[k] + c->tension_w[p] * w_q[k]);
        row[n_q + k] += by * c->tension_w[p] * l_q[k];
    }
    if (p >= f->n_m) {
        return;
    }
    add_rows(&by, system->force_q + p * n_q, 1, n_q, row);
    add_rows(&by, system->force_v + p * n_q, 1, n_q, row + n_q);
    if (f->n_a > 0) {
        row[activation + p] += by * system->force_s[s->activation * f->n_m + p];
    }
    for (int32_t k = 0; k < f->n_k && f->z_of[p * f->n_k + k] >= 0; k++) {
        const int32_t z = f->z_of[p * f->n_k + k];
        row[f->first_z + z] += by * system->force_z[z];
    }
}

static void linearise(mhi_joint_force_context *c, const mhi_system_context *system, int32_t width,
                      int32_t activation) {
    const mhe_system *f = &c->joint->system->face;
    const int32_t n_q = f->n_q, n = n_q + AXES, with_u = width > f->n_x;
    memset(c->rows, 0, doubles(AXES * width));
    for (int32_t axis = 0; axis < AXES; axis++) {
        const int32_t shift = n_q + axis;
        const double *mass = c->mass + shift * n;
        double *row = c->rows + axis * width;
        for (int32_t k = 0; k < n_q; k++) {
            row[k] = c->tau_q[shift * n + k] - c->given_q[shift * n + k];
            row[n_q + k] = c->tau_v[shift * n + k];
        }
        add_rows(mass, c->vdot_q, n_q, n_q, row);
        add_rows(mass, c->vdot_v, n_q, n_q, row + n_q);
        if (f->n_a > 0) {
            add_rows(mass, c->vdot_a, n_q, f->n_a, row + activation);
        }
        add_rows(mass, c->vdot_z, n_q, f->n_z, row + f->first_z);
        if (with_u) {
            add_rows(mass, c->vdot_r, n_q, f->n_r, row + f->n_x + f->n_m);
        }
        for (int32_t i = 0; i < c->joint->loosened.n_paths; i++) {
            add_pull(c, system, i, shift, activation, row);
        }
    }
}

/* out [3 x n] = R rows */
static void turn(const double *R, const double *rows, int32_t n, double *out) {
    for (int32_t i = 0; i < AXES; i++) {
        for (int32_t k = 0; k < n; k++) {
            out[i * n + k] =
                R[3 * i] * rows[k] + R[3 * i + 1] * rows[n + k] + R[3 * i + 2] * rows[2 * n + k];
        }
    }
}

mhe_status mhi_joint_force_evaluate(mhi_joint_force_context *c, mhi_system_context *system,
                                    const mhe_system_point *at, int32_t width, int32_t activation,
                                    double *force, double *by_z, mhe_error *err) {
    const mhi_joint_force *j = c->joint;
    const mhe_system *face = &j->system->face;
    const int32_t n_q = face->n_q, n = n_q + AXES, derivatives = by_z != NULL;
    const double *R = j->loosened.bodies[j->body].joint_r;
    mhe_acceleration wanted = {.size = sizeof wanted, .vdot = c->vdot};
    if (derivatives) {
        wanted.vdot_q = c->vdot_q;
        wanted.vdot_v = c->vdot_v;
        wanted.vdot_a = c->vdot_a;
        wanted.vdot_r = c->vdot_r;
        wanted.vdot_z = c->vdot_z;
    }
    mhe_status status = face->acceleration(face, system, at, &wanted, err);
    if (status == MHE_OK) {
        status = gather(c, system, at, derivatives, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    double along[AXES];
    for (int32_t axis = 0; axis < AXES; axis++) {
        along[axis] = c->tau[n_q + axis] - c->given[n_q + axis];
        for (int32_t i = 0; i < j->loosened.n_paths; i++) {
            along[axis] += c->length_q[i * n + n_q + axis] * c->tension[j->path[i]];
        }
    }
    turn(R, along, 1, force);
    if (derivatives) {
        linearise(c, system, width, activation);
        turn(R, c->rows, width, by_z);
    }
    return MHE_OK;
}
