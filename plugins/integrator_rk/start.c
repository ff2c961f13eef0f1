/* SPDX-License-Identifier: Apache-2.0 */
/* start.c: where the iterations of a step begin: at the system linearised at its start, or at what
 * the memory knows of the step. */
#include "rk.h"

#include <math.h>
#include <string.h>

mhe_status rk_predict(struct rk_context *c, const double *r, double h, mhe_error *err) {
    const struct rk_tableau *t = &c->rk->mechanics;
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q, n_m = system->n_m;
    const mhe_acceleration out = {.size = sizeof out,
                                  .vdot = c->f,
                                  .vdot_q = c->at->f_q,
                                  .vdot_v = c->at->f_v,
                                  .vdot_a = c->at->f_a};
    mhe_status status = rk_accelerate(c, c->q, c->v, c->a_start, NULL, r, &out, err);
    if (status == MHE_OK) {
        rk_keep_start(c);
        status = rk_factor(c, h, 0, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    for (int32_t j = 0; j < t->stages; j++) {
        memcpy(c->K + j * n_q, c->f, sizeof(double) * (size_t)n_q);
    }
    for (int32_t j = 0; j < t->stages; j++) {
        const double *a = c->stage_a + j * n_m;
        rk_stage(c, h, j);
        for (int32_t i = 0; i < n_q; i++) {
            double sum = 0;
            for (int32_t m = 0; m < n_q; m++) {
                sum += c->at->f_q[i * n_q + m] * (c->stage_q[m] - c->q[m]) +
                       c->at->f_v[i * n_q + m] * (c->stage_v[m] - c->v[m]);
            }
            for (int32_t m = 0; m < n_m; m++) {
                sum += c->at->f_a[i * n_m + m] * (a[m] - c->a_start[m]);
            }
            c->residual[j * n_q + i] = sum;
        }
    }
    (void)rk_correct(c, h);
    return MHE_OK;
}

mhe_status rk_predict_states(struct rk_context *c, const double *r, mhe_error *err) {
    int32_t n_q = c->rk->system->n_q, n_z = c->rk->system->n_z;
    const mhe_acceleration out = {.size = sizeof out, .vdot = c->f, .zdot = c->H};
    mhe_status status = rk_accelerate(c, c->q, c->v, c->a_start, c->z, r, &out, err);
    for (int32_t j = 0; j < c->rk->mechanics.stages && status == MHE_OK; j++) {
        memcpy(c->K + j * n_q, c->f, sizeof(double) * (size_t)n_q);
        memcpy(c->Z + j * n_z, c->z, sizeof(double) * (size_t)n_z);
    }
    return status;
}

double rk_recall(struct rk_context *c, const double *r, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    const mhe_system *system = c->rk->system;
    const struct rk_slot *at = &c->kept;
    int32_t n_q = system->n_q, n_m = system->n_m, n_r = system->n_r, n = t->stages * n_q;
    if (!rk_memory_slot(c, &c->kept) || *at->step != h) {
        return NAN;
    }
    for (int32_t k = 0; k < n; k++) {
        int32_t j = k / n_q;
        const double *f_q = at->f_q + k * n_q, *f_v = at->f_v + k * n_q;
        const double *f_a = at->f_a + k * n_m, *f_r = at->f_r + k * n_r;
        const double *a = c->stage_a + j * n_m, *a_then = at->stage_a + j * n_m;
        double sum = 0;
        for (int32_t m = 0; m < n_q; m++) {
            double dv = c->v[m] - at->v[m];
            sum += f_q[m] * (c->q[m] - at->q[m] + h * t->c[j] * dv) + f_v[m] * dv;
        }
        for (int32_t m = 0; m < n_m; m++) {
            sum += f_a[m] * (a[m] - a_then[m]);
        }
        for (int32_t m = 0; m < n_r; m++) {
            sum += f_r[m] * (r[m] - at->r[m]);
        }
        c->residual[k] = sum;
    }
    c->at = &c->kept;
    if (system->n_z > 0) {
        rk_states_recall(c, h);
    }
    memcpy(c->K, at->K, sizeof(double) * (size_t)n);
    return rk_correct(c, h);
}

void rk_keep(const struct rk_context *c, const double *r, double h) {
    const mhe_system *system = c->rk->system;
    const struct rk_slot *at = &c->kept;
    int32_t n_q = system->n_q, s = c->rk->mechanics.stages;
    memcpy(at->q, c->q, sizeof(double) * (size_t)n_q);
    memcpy(at->v, c->v, sizeof(double) * (size_t)n_q);
    for (int32_t i = 0; i < system->n_r; i++) {
        at->r[i] = r[i];
    }
    for (int32_t i = 0; i < system->n_w; i++) {
        at->w[i] = c->w[i];
    }
    memcpy(at->stage_a, c->stage_a, sizeof(double) * (size_t)(s * system->n_m));
    memcpy(at->K, c->K, sizeof(double) * (size_t)(s * n_q));
    if (system->n_z > 0) {
        rk_states_keep(c);
    }
    *at->step = h;
}
