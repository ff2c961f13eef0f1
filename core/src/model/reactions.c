/* SPDX-License-Identifier: Apache-2.0 */
/* reactions.c: what the joints of a system transmit at a state of its motion. */
#include "model/joints.h"

#include "model/actuators.h"
#include "model/system_private.h"
#include "plugin/instance.h"

#include <stdlib.h>
#include <string.h>

struct mhi_reactions {
    const mhi_system *system;
    mhe_description opened; /* with the joints' own motions */
    const mhe_model_ops *model;
    void *self, *context;
    double *q, *v, *a, *vdot; /* [n] of the opened one; vdot [n_q] */
    double *tau, *given;      /* [n] */
    double *length_q, *poses; /* [n_paths x n], [12 x n_bodies] */
    double *tension;          /* [n_paths] */
    mhi_arena arena;
};

static mhe_status take(mhi_reactions *r, mhe_error *err) {
    const int32_t n = r->opened.n_coordinates, n_p = r->opened.n_paths;
    const mhi_room rooms[] = {{&r->q, n},
                              {&r->v, n},
                              {&r->a, n},
                              {&r->vdot, n},
                              {&r->tau, n},
                              {&r->given, n},
                              {&r->length_q, n_p * n},
                              {&r->poses, 12 * r->opened.n_bodies},
                              {&r->tension, n_p}};
    return MHI_TAKE_ROOMS(&r->arena, rooms, err);
}

static mhe_status build(mhi_reactions *r, const mhi_system_setup *setup, mhe_error *err) {
    const mhe_description *d = setup->description;
    const void *config = NULL;
    for (int32_t i = 0; i < d->n_paths; i++) {
        if (d->paths[i].length != NULL) {
            return mhe_fail(err, MHE_E_UNSUPPORTED,
                            "output.reactions: the path of '%s' is a function without points: "
                            "where it pulls on a joint is not known",
                            i < d->n_muscles ? d->muscles[i].name : "a spring");
        }
    }
    mhe_status status = mhi_joints_open(d, &r->arena, &r->opened, err);
    if (status == MHE_OK) {
        r->opened.n_loops = 0; /* what closes them is a load here */
        status = mhi_joints_exact_paths(setup->model, setup->model_config, &r->arena, &config, err);
    }
    if (status == MHE_OK) {
        status = take(r, err);
    }
    if (status == MHE_OK) {
        status = mhi_model_create(setup->model, setup->host, &r->opened, config, &r->self, err);
    }
    return status == MHE_OK ? r->model->context_create(r->self, &r->context, err) : status;
}

mhe_status mhi_reactions_create(const mhi_system_setup *setup, const mhi_system *system,
                                mhi_reactions **reactions, mhe_error *err) {
    *reactions = NULL;
    mhi_reactions *r = calloc(1, sizeof *r);
    if (r == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    r->system = system;
    r->model = setup->model->ops;
    const mhe_status status = build(r, setup, err);
    if (status != MHE_OK) {
        mhi_reactions_free(r);
        return status;
    }
    *reactions = r;
    return MHE_OK;
}

void mhi_reactions_free(mhi_reactions *r) {
    if (r == NULL) {
        return;
    }
    if (r->context != NULL) {
        r->model->context_destroy(r->context);
    }
    if (r->self != NULL) {
        r->model->destroy(r->self);
    }
    mhi_arena_free(&r->arena);
    free(r);
}

static mhe_status add_loads(void *data, const mhe_load *loads, int32_t n, const double *values,
                            mhe_error *err) {
    mhi_reactions *r = data;
    return r->model->loads(r->context, loads, n, values, r->given, NULL, NULL, err);
}

/* Actuators that act on bodies; one of a coordinate is part of what its joint transmits. */
static mhe_status add_actuators(mhi_reactions *r, const double *control, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < r->system->n_actuators && status == MHE_OK; i++) {
        const mhe_actuator *a = &r->system->description->actuators[i];
        mhe_load loads[2];
        double value[18];
        const int32_t n = mhi_actuator_loads(a, a->optimal_force * control[i], loads, value);
        status = n == 0 ? MHE_OK : add_loads(r, loads, n, value, err);
    }
    return status;
}

mhe_status mhi_reactions_solve(mhi_reactions *r, mhi_system_context *c, const mhe_system_point *at,
                               int32_t axes, double *out, mhe_error *err) {
    const mhe_system *face = mhi_system_face(r->system);
    const mhe_description *d = &r->opened;
    const int32_t n = d->n_coordinates, n_q = face->n_q;
    const mhe_acceleration wanted = {.size = sizeof wanted, .vdot = r->vdot};
    mhe_status status = face->acceleration(face, c, at, &wanted, err);
    if (status != MHE_OK) {
        return status;
    }
    memset(r->tension, 0, sizeof(double) * (size_t)d->n_paths);
    memset(r->given, 0, sizeof(double) * (size_t)n);
    const mhi_path_pulls pulls = {r->tension, NULL, NULL};
    memcpy(r->tension, c->force, sizeof(double) * (size_t)face->n_m);
    memcpy(r->q, at->q, sizeof(double) * (size_t)n_q); /* the joints' own stay at 0 */
    memcpy(r->v, at->v, sizeof(double) * (size_t)n_q);
    memcpy(r->a, r->vdot, sizeof(double) * (size_t)n_q);
    const mhe_kinematics seen = {
        .size = sizeof seen, .length_q = d->n_paths > 0 ? r->length_q : NULL, .body = r->poses};
    status = r->model->kinematics(r->context, r->q, r->v, &seen, err);
    if (status == MHE_OK) {
        status = r->model->inverse_dynamics(r->context, r->a, r->tau, NULL, NULL, err);
    }
    if (status == MHE_OK) {
        status = mhi_forces_pull(c, at, &pulls, add_loads, r, err);
    }
    if (status == MHE_OK && r->system->n_loop_loads > 0) {
        mhi_loops_loads(c, 1);
        status = add_loads(r, r->system->loop_loads, r->system->n_loop_loads, c->loop_value, err);
    }
    if (status == MHE_OK && r->system->n_actuators > 0) {
        status = add_actuators(r, at->r + r->system->n_residual, err);
    }
    for (int32_t i = 0; i < n && status == MHE_OK; i++) {
        double given = r->given[i];
        for (int32_t p = 0; p < d->n_paths; p++) {
            given -= r->length_q[(ptrdiff_t)p * n + i] * r->tension[p];
        }
        r->tau[i] -= given;
    }
    for (int32_t i = 0; i < d->n_bodies && status == MHE_OK; i++) {
        mhi_joints_reaction(d, i, r->poses, r->tau, n_q, axes, out + (ptrdiff_t)6 * i);
    }
    return status;
}
