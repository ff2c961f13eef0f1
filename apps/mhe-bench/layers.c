/* SPDX-License-Identifier: Apache-2.0 */
#include "layers.h"

#include "measure.h"
#include "plugin/instance.h"

#include <stdlib.h>
#include <string.h>

struct layers {
    const rig *rig;
    mhe_system_point at[RIG_POINTS_MAX]; /* the rig's points as the system takes them */
    const mhe_system *system;
    void *system_context;
    const mhe_stage_problem *problem;
    int32_t next;            /* point */
    int32_t begin[N_LAYERS]; /* the point at which each goes on: none depends on others' calls */
    const mhe_model_ops *model;
    void *model_self, *model_context; /* a skeleton of its own */
    mhe_kinematics kinematics;
    mhe_acceleration value, derivatives;
    double *rate, *rate_e, *rate_a;
    mhe_stage_values step, linear_step, cost, all;
    double *near_x, *near_u; /* the point of LAYER_INTERVAL_AGAIN */
    mhi_arena arena;
};

const char *const layer_keys[N_LAYERS] = {
    "kinematics",      "acceleration", "acceleration_derivatives",
    "activation_rate", "interval",     "interval_derivatives",
    "interval_again",  "stage_cost",   "window_linearisation"};

const char *const layer_names[N_LAYERS] = {"skeleton kinematics, all outputs",
                                           "system acceleration",
                                           "system acceleration, derivatives",
                                           "activation rates, derivatives",
                                           "shooting interval",
                                           "shooting interval with A and B",
                                           "the same 1e-3 away from the last",
                                           "stage cost, gradient, Hessian",
                                           "linearisation of the window"};

typedef struct point {
    const double *x, *u;
    const mhe_system_point *at;
} point;

static point next_point(layers *l) {
    const int32_t i = l->next;
    l->next = i + 1 == l->rig->n_points ? 0 : i + 1;
    const mhe_system *s = l->system;
    return (point){l->rig->x + (ptrdiff_t)i * s->n_x, l->rig->u + (ptrdiff_t)i * s->n_u, &l->at[i]};
}

static mhe_status call_kinematics(layers *l, mhe_error *err) {
    const point p = next_point(l);
    return l->model->kinematics(l->model_context, p.at->q, p.at->v, &l->kinematics, err);
}

static mhe_status call_acceleration(layers *l, const mhe_acceleration *out, mhe_error *err) {
    const point p = next_point(l);
    return l->system->acceleration(l->system, l->system_context, p.at, out, err);
}

static mhe_status call_rate(layers *l, mhe_error *err) {
    const point p = next_point(l);
    return l->system->activation_rate(l->system, p.at->c, p.at->a, l->rate, l->rate_e, l->rate_a,
                                      err);
}

static mhe_status call_stage(layers *l, const mhe_stage_values *out, mhe_error *err) {
    const int32_t k = l->next % l->problem->n_intervals;
    const point p = next_point(l);
    return l->problem->evaluate(l->problem, 0, k, p.x, p.u, out, err);
}

#define AGAIN_CALLS 16
#define AGAIN_AWAY 1e-3

static void move_near(layers *l, double by) {
    for (int32_t j = 0; j < l->system->n_x; j++) {
        l->near_x[j] += by;
    }
    for (int32_t j = 0; j < l->system->n_u; j++) {
        l->near_u[j] += by;
    }
}

static mhe_status call_near(layers *l, mhe_error *err) {
    return l->problem->evaluate(l->problem, 0, 0, l->near_x, l->near_u, &l->linear_step, err);
}

/* Seconds of a call near the last one: the first, at a new point, is not counted. */
static mhe_status time_again(layers *l, double *seconds, mhe_error *err) {
    const point p = next_point(l);
    memcpy(l->near_x, p.x, sizeof(double) * (size_t)l->system->n_x);
    memcpy(l->near_u, p.u, sizeof(double) * (size_t)l->system->n_u);
    mhe_status status = call_near(l, err);
    const double begin = measure_seconds();
    for (int32_t i = 0; i < AGAIN_CALLS && status == MHE_OK; i++) {
        move_near(l, i % 2 == 0 ? AGAIN_AWAY : -AGAIN_AWAY);
        status = call_near(l, err);
    }
    *seconds += (measure_seconds() - begin) / AGAIN_CALLS;
    return status;
}

static mhe_status call_linearisation(layers *l, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k <= l->problem->n_intervals && status == MHE_OK; k++) {
        const point p = next_point(l);
        const double *u = k < l->problem->n_intervals ? p.u : NULL;
        status = l->problem->evaluate(l->problem, 0, k, p.x, u, &l->all, err);
    }
    return status;
}

static mhe_status call(layers *l, int32_t layer, mhe_error *err) {
    switch (layer) {
    case LAYER_KINEMATICS:
        return call_kinematics(l, err);
    case LAYER_ACCELERATION:
        return call_acceleration(l, &l->value, err);
    case LAYER_ACCELERATION_DERIVATIVES:
        return call_acceleration(l, &l->derivatives, err);
    case LAYER_ACTIVATION_RATE:
        return call_rate(l, err);
    case LAYER_INTERVAL:
        return call_stage(l, &l->step, err);
    case LAYER_INTERVAL_DERIVATIVES:
        return call_stage(l, &l->linear_step, err);
    case LAYER_COST:
        return call_stage(l, &l->cost, err);
    default:
        return call_linearisation(l, err);
    }
}

int layers_has(const layers *l, int32_t layer) {
    return layer != LAYER_ACTIVATION_RATE || l->system->n_d > 0;
}

mhe_status layers_time(layers *l, int32_t layer, int32_t calls, double *seconds, mhe_error *err) {
    mhe_status status = MHE_OK;
    mhi_work_begin(mhi_ocp_work(mhi_estimator_ocp(l->rig->estimator)), 0, 0); /* no frame's bound */
    const double begin = measure_seconds();
    double again = 0;
    l->next = l->begin[layer];
    for (int32_t i = 0; i < calls && status == MHE_OK; i++) {
        status = layer == LAYER_INTERVAL_AGAIN ? time_again(l, &again, err) : call(l, layer, err);
    }
    l->begin[layer] = l->next;
    *seconds = layer == LAYER_INTERVAL_AGAIN ? again : measure_seconds() - begin;
    return status;
}

static mhe_status take_arrays(layers *l, mhe_error *err) {
    const mhe_estimator_info *info = &l->rig->info;
    const int32_t n_q = l->system->n_q, n_m = l->system->n_m, n_r = l->system->n_r;
    const int32_t n_x = l->system->n_x, n_u = l->system->n_u, n_a = l->system->n_a;
    const int32_t n_p = mhi_system_description(mhi_estimator_system(l->rig->estimator))->n_paths;
    mhe_kinematics *kin = &l->kinematics;
    mhe_acceleration *d = &l->derivatives;
    mhe_stage_values *all = &l->all;
    *kin = (mhe_kinematics){.size = sizeof *kin};
    *d = (mhe_acceleration){.size = sizeof *d};
    *all = (mhe_stage_values){.size = sizeof *all};
    const mhi_room rooms[] = {{&kin->mass, n_q * n_q},
                              {&kin->bias, n_q},
                              {&kin->length, n_p},
                              {&kin->length_q, n_p * n_q},
                              {&kin->length_qq, n_p * n_q * n_q},
                              {&kin->marker, 3 * info->n_markers},
                              {&kin->marker_q, 3 * info->n_markers * n_q},
                              {&d->vdot, n_q},
                              {&d->vdot_q, n_q * n_q},
                              {&d->vdot_v, n_q * n_q},
                              {&d->vdot_a, n_q * n_a},
                              {&d->vdot_r, n_q * n_r},
                              {&l->rate, n_m},
                              {&l->rate_e, n_m},
                              {&l->rate_a, n_m},
                              {&all->cost, 1},
                              {&all->grad_x, n_x},
                              {&all->grad_u, n_u},
                              {&all->hess_xx, n_x * n_x},
                              {&all->hess_ux, n_u * n_x},
                              {&all->hess_uu, n_u * n_u},
                              {&all->x_next, n_x},
                              {&all->A, n_x * n_x},
                              {&all->B, n_x * n_u},
                              {&l->near_x, n_x},
                              {&l->near_u, n_u}};
    if (MHI_TAKE_ROOMS(&l->arena, rooms, err) != MHE_OK) {
        return MHE_E_MEMORY;
    }
    l->value = (mhe_acceleration){.size = sizeof l->value, .vdot = d->vdot};
    l->step = (mhe_stage_values){.size = sizeof l->step, .x_next = all->x_next};
    l->linear_step = l->step;
    l->linear_step.A = all->A;
    l->linear_step.B = all->B;
    l->cost = *all;
    l->cost.x_next = l->cost.A = l->cost.B = NULL;
    return MHE_OK;
}

mhe_status layers_create(rig *r, layers **result, mhe_error *err) {
    *result = NULL;
    layers *l = calloc(1, sizeof *l);
    if (l == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const mhi_system *system = mhi_estimator_system(r->estimator);
    const mhi_use *model = &r->variant->run->model;
    l->rig = r;
    l->system = mhi_system_face(system);
    l->system_context = mhi_ocp_context(mhi_estimator_ocp(r->estimator));
    l->problem = mhi_ocp_face(mhi_estimator_ocp(r->estimator));
    l->model = model->plugin->ops;
    for (int32_t i = 0; i < r->n_points; i++) {
        mhi_system_point(system, r->x + (ptrdiff_t)i * l->system->n_x,
                         r->u + (ptrdiff_t)i * l->system->n_u,
                         mhi_ocp_input(mhi_estimator_ocp(r->estimator), 0), &l->at[i]);
    }
    mhe_status status = mhi_model_create(model->plugin, r->host, mhi_system_description(system),
                                         model->config, &l->model_self, err);
    if (status == MHE_OK) {
        status = l->model->context_create(l->model_self, &l->model_context, err);
    }
    if (status == MHE_OK) {
        status = take_arrays(l, err);
    }
    if (status != MHE_OK) {
        layers_free(l);
        return status;
    }
    *result = l;
    return MHE_OK;
}

void layers_free(layers *l) {
    if (l == NULL) {
        return;
    }
    if (l->model_context != NULL) {
        l->model->context_destroy(l->model_context);
    }
    if (l->model_self != NULL) {
        l->model->destroy(l->model_self);
    }
    mhi_arena_free(&l->arena);
    free(l);
}
