/* SPDX-License-Identifier: Apache-2.0 */
/* equations.c: the system as CVODES sees it: xdot, d xdot/dx, and the rates of dx/d(x0, u, p). */
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

/* Accelerations, activation rates and rates of z at x, with derivatives if wanted. */
static mhe_status flow_evaluate(struct flow_context *c, const double *x, double *vdot, double *ddot,
                                double *zdot, int32_t derivatives) {
    const mhe_system *system = c->flow->system;
    const int32_t n_q = system->n_q, n_d = system->n_d;
    const double *d = x + system->first_d;
    const mhe_system_point at = {.size = sizeof at,
                                 .q = x,
                                 .v = x + n_q,
                                 .a = n_d > 0 ? d : (system->n_a > 0 ? c->u : NULL),
                                 .z = system->n_z > 0 ? x + system->first_z : NULL,
                                 .c = c->u,
                                 .r = system->n_r > 0 ? c->u + system->n_m : NULL,
                                 .w = c->w};
    mhe_acceleration out = {.size = sizeof out, .vdot = vdot, .zdot = zdot};
    if (derivatives) {
        out.vdot_q = c->f_q;
        out.vdot_v = c->f_v;
        out.vdot_a = system->n_a > 0 ? c->f_a : NULL;
        out.vdot_r = system->n_r > 0 ? c->f_r : NULL;
        out.vdot_z = system->n_z > 0 ? c->f_z : NULL;
        out.vdot_p = system->n_p > 0 ? c->f_p : NULL;
    }
    if (derivatives && system->n_z > 0) {
        out.zdot_q = c->z_q;
        out.zdot_v = c->z_v;
        out.zdot_a = system->n_a > 0 ? c->z_a : NULL;
        out.zdot_c = c->z_c;
        out.zdot_z = c->z_z;
        out.zdot_p = system->n_p > 0 ? c->z_p : NULL;
    }
    mhe_status status = system->acceleration(system, c->system_context, &at, &out, &c->error);
    if (status == MHE_OK && n_d > 0) {
        status = system->activation_rate(system, c->u, d, ddot, derivatives ? c->rate_e : NULL,
                                         derivatives ? c->rate_a : NULL, &c->error);
    }
    return status;
}

int flow_rate(sunrealtype t, N_Vector x, N_Vector xdot, void *data) {
    struct flow_context *c = data;
    const mhe_system *system = c->flow->system;
    const int32_t n_q = system->n_q;
    const double *from = N_VGetArrayPointer(x);
    double *to = N_VGetArrayPointer(xdot);
    (void)t;
    memcpy(to, from + n_q, sizeof(double) * (size_t)n_q);
    return flow_answer(
        c, flow_evaluate(c, from, to + n_q, to + system->first_d, to + system->first_z, 0));
}

/* Rows of z in the Jacobian; `d` and `z` are the places of activations and z in x. */
static void flow_jacobian_z(const struct flow_context *c, SUNMatrix J, int32_t d, int32_t z) {
    const mhe_system *system = c->flow->system;
    const int32_t n_q = system->n_q, n_k = system->n_k;
    for (int32_t i = 0; i < system->n_z; i++) {
        const int32_t m = system->z_muscle[i];
        for (int32_t k = 0; k < n_q; k++) {
            SM_ELEMENT_D(J, z + i, k) = c->z_q[i * n_q + k];
            SM_ELEMENT_D(J, z + i, n_q + k) = c->z_v[i * n_q + k];
        }
        if (system->n_d > 0) {
            SM_ELEMENT_D(J, z + i, d + m) = c->z_a[i];
        }
        for (int32_t k = 0; k < n_k && system->z_of[m * n_k + k] >= 0; k++) {
            SM_ELEMENT_D(J, z + i, z + system->z_of[m * n_k + k]) = c->z_z[i * n_k + k];
        }
    }
}

int flow_jacobian(sunrealtype t, N_Vector x, N_Vector xdot, SUNMatrix J, void *data, N_Vector a,
                  N_Vector b, N_Vector e) {
    struct flow_context *c = data;
    const mhe_system *system = c->flow->system;
    const int32_t n_q = system->n_q, n_a = system->n_a, n_z = system->n_z;
    const int32_t d = system->first_d, z = system->first_z;
    (void)t, (void)xdot, (void)a, (void)b, (void)e;
    mhe_status status = flow_evaluate(c, N_VGetArrayPointer(x), c->vdot, c->rate, c->zdot, 1);
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
        for (int32_t k = 0; k < system->n_d; k++) {
            SM_ELEMENT_D(J, n_q + i, d + k) = c->f_a[i * n_a + k];
        }
        for (int32_t k = 0; k < n_z; k++) {
            SM_ELEMENT_D(J, n_q + i, z + k) = c->f_z[i * n_z + k];
        }
    }
    for (int32_t i = 0; i < system->n_d; i++) {
        SM_ELEMENT_D(J, d + i, d + i) = c->rate_a[i];
    }
    flow_jacobian_z(c, J, d, z);
    return 0;
}

static double flow_dot(const double *a, const double *b, int32_t n) {
    double sum = 0;
    for (int32_t i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* d/dt of a sensitivity s without the direct effect of a control or parameter: J s. */
static void flow_apply(const struct flow_context *c, const double *s, double *out) {
    const mhe_system *system = c->flow->system;
    const int32_t n_q = system->n_q, n_a = system->n_a, n_d = system->n_d, n_z = system->n_z;
    const int32_t n_k = system->n_k;
    const double *s_d = s + system->first_d, *s_z = s + system->first_z;
    double *out_d = out + system->first_d, *out_z = out + system->first_z;
    memcpy(out, s + n_q, sizeof(double) * (size_t)n_q);
    for (int32_t i = 0; i < n_q; i++) {
        double sum = 0;
        for (int32_t k = 0; k < n_q; k++) {
            sum += c->f_q[i * n_q + k] * s[k] + c->f_v[i * n_q + k] * s[n_q + k];
        }
        for (int32_t k = 0; k < n_d; k++) {
            sum += c->f_a[i * n_a + k] * s_d[k];
        }
        out[n_q + i] = sum + flow_dot(c->f_z + i * n_z, s_z, n_z);
    }
    for (int32_t i = 0; i < n_d; i++) {
        out_d[i] = c->rate_a[i] * s_d[i];
    }
    for (int32_t i = 0; i < n_z; i++) {
        const int32_t m = system->z_muscle[i];
        double sum = flow_dot(c->z_q + i * n_q, s, n_q) + flow_dot(c->z_v + i * n_q, s + n_q, n_q);
        sum += n_d > 0 ? c->z_a[i] * s_d[m] : 0;
        for (int32_t k = 0; k < n_k && system->z_of[m * n_k + k] >= 0; k++) {
            sum += c->z_z[i * n_k + k] * s_z[system->z_of[m * n_k + k]];
        }
        out_z[i] = sum;
    }
}

/* Adds d xdot/du_k: an excitation moves its own muscle's states, an activation or what acts on the
 * skeleton all accelerations. */
static void flow_add_control(const struct flow_context *c, int32_t k, double *out) {
    const mhe_system *system = c->flow->system;
    const int32_t n_q = system->n_q, n_m = system->n_m, n_r = system->n_r, n_k = system->n_k;
    const int32_t driven = system->n_a > 0 && system->n_d == 0; /* by activations */
    double *z = out + system->first_z;
    for (int32_t j = 0; j < n_k && k < n_m && system->z_of[k * n_k + j] >= 0; j++) {
        const int32_t i = system->z_of[k * n_k + j];
        z[i] += c->z_c[i] + (driven ? c->z_a[i] : 0);
    }
    if (k < n_m && system->n_d > 0) {
        out[system->first_d + k] += c->rate_e[k];
    }
    for (int32_t i = 0; i < n_q && (k >= n_m || driven); i++) {
        out[n_q + i] += k < n_m ? c->f_a[i * n_m + k] : c->f_r[i * n_r + k - n_m];
    }
}

/* Adds d xdot/dp_k. */
static void flow_add_parameter(const struct flow_context *c, int32_t k, double *out) {
    const mhe_system *system = c->flow->system;
    const int32_t n_q = system->n_q, n_p = system->n_p;
    double *z = out + system->first_z;
    for (int32_t i = 0; i < n_q; i++) {
        out[n_q + i] += c->f_p[i * n_p + k];
    }
    for (int32_t i = 0; i < system->n_z; i++) {
        z[i] += c->z_p[i * n_p + k];
    }
}

int flow_sens_rate(int n, sunrealtype t, N_Vector x, N_Vector xdot, N_Vector *sens,
                   N_Vector *sens_dot, void *data, N_Vector a, N_Vector b) {
    struct flow_context *c = data;
    const int32_t n_x = c->flow->system->n_x, n_xu = n_x + c->flow->system->n_u;
    (void)t, (void)xdot, (void)a, (void)b;
    mhe_status status = flow_evaluate(c, N_VGetArrayPointer(x), c->vdot, c->rate, c->zdot, 1);
    if (status != MHE_OK) {
        return flow_answer(c, status);
    }
    for (int32_t i = 0; i < n; i++) {
        double *out = N_VGetArrayPointer(sens_dot[i]);
        flow_apply(c, N_VGetArrayPointer(sens[i]), out);
        if (i >= n_xu) {
            flow_add_parameter(c, i - n_xu, out);
        } else if (i >= n_x) {
            flow_add_control(c, i - n_x, out);
        }
    }
    return 0;
}
