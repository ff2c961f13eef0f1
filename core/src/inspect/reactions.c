/* SPDX-License-Identifier: Apache-2.0 */
/* reactions.c: what joints transmit at a pose with given forces. */
#include "inspect/inspected.h"
#include "model/actuators.h"

#include "model/joints.h"

#include <string.h>

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

/* Force and moment of body i's joint, in ground. */
static void add_reaction(const mhe_description *d, int32_t i, const double *body, const double *tau,
                         int32_t first, cJSON *out) {
    const char *name = d->joints != NULL && d->joints[i] != NULL ? d->joints[i] : d->bodies[i].name;
    cJSON *reaction = cJSON_AddObjectToObject(out, name);
    double wrench[6];
    mhi_joints_reaction(d, i, body, tau, first, MHI_IN_GROUND, wrench);
    (void)cJSON_AddItemToObject(reaction, "force", mhi_json_numbers(wrench, 3));
    (void)cJSON_AddItemToObject(reaction, "moment", mhi_json_numbers(wrench + 3, 3));
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

mhe_status mhi_pose_reactions(mhi_inspected *m, const mhi_pose *pose, cJSON *out, mhe_error *err) {
    mhe_description *d = MHI_TAKE(&m->arena, mhe_description, 1);
    mhi_skeleton skeleton = {0};
    mhe_status status = d == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                  : mhi_joints_open(m->all, &m->arena, d, err);
    if (status == MHE_OK) {
        status = mhi_skeleton_open(m, d, &skeleton, err);
    }
    if (status == MHE_OK) {
        status = solve(m, &skeleton, pose, out, err);
    }
    mhi_skeleton_close(&skeleton);
    return status;
}
