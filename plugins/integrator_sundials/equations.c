/* SPDX-License-Identifier: Apache-2.0 */
/* equations.c: the system as CVODES sees it: xdot, d xdot/dx, and the rates of dx/d(x0, u). */
#include "flow.h"

#include <string.h>

/* The answer of a callback: 0, a point to avoid (> 0), or the end (< 0). */
static int flow_answer(struct flow_context *c, mhe_status status) {
    if (status != MHE_OK) {
        c->status = status;
        c->error.code = status;
    }
    return status == MHE_OK ? 0 : status > 0 ? 1 : -1;
}

/* Accelerations (NULL: not wanted) and activation rates at x, with derivatives if wanted. */
static mhe_status flow_evaluate(struct flow_context *c, const double *x, double *vdot, double *adot,
                                int32_t derivatives) {
    const mhe_system *system = c->flow->system;
    int32_t n_q = system->n_q;
    const double *a = system->n_a > 0 ? x + 2 * n_q : c->u;
    const double *r = system->n_r > 0 ? c->u + system->n_m : NULL;
    mhe_acceleration out = {.size = sizeof out, .vdot = vdot};
    if (derivatives) {
        out.vdot_q = c->f_q;
        out.vdot_v = c->f_v;
        out.vdot_a = c->f_a;
        out.vdot_r = system->n_r > 0 ? c->f_r : NULL;
    }
    mhe_status status =
        system->acceleration(system, c->system_context, x, x + n_q, a, r, &out, &c->error);
    if (status == MHE_OK && system->n_a > 0) {
        status = system->activation_rate(system, c->u, a, adot, derivatives ? c->rate_e : NULL,
                                         derivatives ? c->rate_a : NULL, &c->error);
    }
    return status;
}

int flow_rate(sunrealtype t, N_Vector x, N_Vector xdot, void *data) {
    struct flow_context *c = data;
    int32_t n_q = c->flow->system->n_q;
    const double *from = N_VGetArrayPointer(x);
    double *to = N_VGetArrayPointer(xdot);
    (void)t;
    memcpy(to, from + n_q, sizeof(double) * (size_t)n_q);
    return flow_answer(c, flow_evaluate(c, from, to + n_q, to + 2 * n_q, 0));
}

int flow_jacobian(sunrealtype t, N_Vector x, N_Vector xdot, SUNMatrix J, void *data, N_Vector a,
                  N_Vector b, N_Vector d) {
    struct flow_context *c = data;
    const mhe_system *system = c->flow->system;
    int32_t n_q = system->n_q, n_m = system->n_m;
    (void)t, (void)xdot, (void)a, (void)b, (void)d;
    mhe_status status = flow_evaluate(c, N_VGetArrayPointer(x), c->vdot, c->rate, 1);
    if (status != MHE_OK) {
        return flow_answer(c, status);
    }
    SUNMatZero(J);
    for (int32_t i = 0; i < n_q; i++) {
        SM_ELEMENT_D(J, i, n_q + i) = 1;
        for (int32_t k = 0; k < n_q; k++) {
            SM_ELEMENT_D(J, n_q + i, k) = c->f_q[i * n_q + k];
            SM_ELEMENT_D(J, n_q + i, n_q + k) = c->f_v[i * n_q + k];
        }
        for (int32_t k = 0; k < system->n_a; k++) {
            SM_ELEMENT_D(J, n_q + i, 2 * n_q + k) = c->f_a[i * n_m + k];
        }
    }
    for (int32_t i = 0; i < system->n_a; i++) {
        SM_ELEMENT_D(J, 2 * n_q + i, 2 * n_q + i) = c->rate_a[i];
    }
    return 0;
}

/* d/dt of a sensitivity s without the direct effect of a control: J s. */
static void flow_apply(const struct flow_context *c, const double *s, double *out) {
    const mhe_system *system = c->flow->system;
    int32_t n_q = system->n_q, n_m = system->n_m, n_a = system->n_a;
    memcpy(out, s + n_q, sizeof(double) * (size_t)n_q);
    for (int32_t i = 0; i < n_q; i++) {
        double sum = 0;
        for (int32_t k = 0; k < n_q; k++) {
            sum += c->f_q[i * n_q + k] * s[k] + c->f_v[i * n_q + k] * s[n_q + k];
        }
        for (int32_t k = 0; k < n_a; k++) {
            sum += c->f_a[i * n_m + k] * s[2 * n_q + k];
        }
        out[n_q + i] = sum;
    }
    for (int32_t i = 0; i < n_a; i++) {
        out[2 * n_q + i] = c->rate_a[i] * s[2 * n_q + i];
    }
}

/* Adds d xdot/du_k: an excitation moves its own activation, an activation or a residual torque all
 * accelerations. */
static void flow_add_control(const struct flow_context *c, int32_t k, double *out) {
    const mhe_system *system = c->flow->system;
    int32_t n_q = system->n_q, n_m = system->n_m, n_r = system->n_r;
    if (k < n_m && system->n_a > 0) {
        out[2 * n_q + k] += c->rate_e[k];
        return;
    }
    for (int32_t i = 0; i < n_q; i++) {
        out[n_q + i] += k < n_m ? c->f_a[i * n_m + k] : c->f_r[i * n_r + k - n_m];
    }
}

int flow_sens_rate(int n, sunrealtype t, N_Vector x, N_Vector xdot, N_Vector *sens,
                   N_Vector *sens_dot, void *data, N_Vector a, N_Vector b) {
    struct flow_context *c = data;
    int32_t n_x = c->flow->system->n_x;
    (void)t, (void)xdot, (void)a, (void)b;
    mhe_status status = flow_evaluate(c, N_VGetArrayPointer(x), c->vdot, c->rate, 1);
    if (status != MHE_OK) {
        return flow_answer(c, status);
    }
    for (int32_t i = 0; i < n; i++) {
        double *out = N_VGetArrayPointer(sens_dot[i]);
        flow_apply(c, N_VGetArrayPointer(sens[i]), out);
        if (i >= n_x) {
            flow_add_control(c, i - n_x, out);
        }
    }
    return 0;
}
