/* SPDX-License-Identifier: Apache-2.0 */
/* actuators.c: motors of the model file as controls: a force (moment) of the optimal one times the
 * control, on a coordinate, on bodies or at a point. */
#include "model/actuators.h"

#include "io/description_builder.h"
#include "model/system_private.h"

#include <string.h>

mhe_status mhi_actuators_check(const mhi_system *s, mhe_error *err) {
    const mhe_description *d = s->description;
    for (int32_t i = 0; i < d->n_actuators; i++) {
        if (d->actuators[i].kind != MHE_ACTUATOR_COORDINATE && s->model->loads == NULL) {
            return mhe_fail(err, MHE_E_UNSUPPORTED,
                            "%s: actuator '%s': this model plugin loads no bodies", d->source,
                            d->actuators[i].name);
        }
    }
    return MHE_OK;
}

int32_t mhi_actuator_loads(const mhe_actuator *a, double force, mhe_load loads[2],
                           double value[18]) {
    int32_t n = 0;
    for (int k = 0; k < (a->kind == MHE_ACTUATOR_TORQUE ? 2 : 1); k++) {
        if (a->kind == MHE_ACTUATOR_COORDINATE || a->body[k] < 0) {
            continue; /* on ground */
        }
        double *v = value + 9 * n;
        memset(v, 0, 9 * sizeof *v);
        for (int j = 0; j < 3; j++) {
            const int at = a->kind == MHE_ACTUATOR_POINT ? j : 6 + j;
            v[at] = (k == 0 ? force : -force) * a->axis[j];
            v[3 + j] = a->kind == MHE_ACTUATOR_POINT ? a->point[j] : 0;
        }
        loads[n++] = (mhe_load){
            .body = a->body[k], .axes = a->axis_in_ground ? -1 : a->body[0], .origin = a->body[0]};
    }
    return n;
}

/* A coordinate's slope and bend by the free one that it follows, whose number is returned. */
static int32_t follow(const mhe_description *d, int32_t number, const double *q, double *slope,
                      double *bend, double *value) {
    const int32_t n = d->n_coordinates;
    if (number < n) {
        *value = q[number];
        *slope = 1;
        *bend = 0;
        return number;
    }
    const mhe_dependent *dependent = &d->dependents[number - n];
    double f[3];
    const int32_t free = follow(d, dependent->independent, q, slope, bend, value);
    mhi_function_derivatives(&dependent->function, *value, f);
    *bend = f[2] * *slope * *slope + f[1] * *bend;
    *slope *= f[1];
    *value = f[0];
    return free;
}

mhe_status mhi_actuators_drive(mhi_system_context *c, const double *q, const double *r,
                               int32_t derivatives, mhe_error *err) {
    const mhi_system *s = c->system;
    const mhe_description *d = s->description;
    const int32_t n_q = s->face.n_q, n = s->n_actuators;
    mhe_status status = MHE_OK;
    memset(c->drive, 0, sizeof(double) * (size_t)n_q);
    memset(c->drive_q, 0, sizeof(double) * (size_t)(derivatives ? n_q * n_q : 0));
    memset(c->drive_r, 0, sizeof(double) * (size_t)(n_q * n));
    for (int32_t i = 0; i < n && status == MHE_OK; i++) {
        const mhe_actuator *a = &d->actuators[i];
        if (a->kind == MHE_ACTUATOR_COORDINATE) {
            double slope, bend, value;
            const int32_t free = follow(d, a->coordinate, q, &slope, &bend, &value);
            c->drive[free] += a->optimal_force * slope * r[i];
            c->drive_r[free * n + i] = a->optimal_force * slope;
            if (derivatives) {
                c->drive_q[free * n_q + free] += a->optimal_force * bend * r[i];
            }
            continue;
        }
        mhe_load loads[2];
        double force[18];
        const int32_t n_loads = mhi_actuator_loads(a, a->optimal_force, loads, force);
        memset(c->row_q, 0, sizeof(double) * (size_t)n_q); /* at a control of 1 */
        status = s->model->loads(c->model, loads, n_loads, force, c->row_q, NULL, NULL, err);
        for (int32_t j = 0; j < n_q; j++) {
            c->drive[j] += c->row_q[j] * r[i];
            c->drive_r[j * n + i] = c->row_q[j];
        }
        if (status == MHE_OK && derivatives) {
            for (int32_t k = 0; k < 9 * n_loads; k++) {
                force[k] *= k % 9 / 3 == 1 ? 1 : r[i]; /* not the point */
            }
            status = s->model->loads(c->model, loads, n_loads, force, NULL, c->drive_q, NULL, err);
        }
    }
    return status;
}
