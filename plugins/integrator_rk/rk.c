/* SPDX-License-Identifier: Apache-2.0 */
/* rk.c: instances, contexts, and the step over a shooting interval. */
#include "rk.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RK_SHORTEST 1e-6 /* max_step, s */
#define RK_FINEST 0.01   /* activation_step */

static mhe_status rk_accepts(const mhe_system *system, const void *config, mhe_error *err) {
    int32_t scheme = ((const struct rk_config *)config)->scheme;
    if (system->n_z > 0 && scheme != RK_AUTO && scheme != RK_RADAU) {
        return mhe_fail(err, MHE_E_UNSUPPORTED,
                        "scheme: %s; muscles with states beside their activation (elastic tendons) "
                        "need radau, which forgets a wrong start",
                        scheme == RK_GAUSS ? "gauss" : "rk4");
    }
    if (system->n_k > RK_MAX_STATES) {
        return mhe_fail(err, MHE_E_UNSUPPORTED, "a muscle with %d states; at most %d are possible",
                        system->n_k, RK_MAX_STATES);
    }
    return MHE_OK;
}

static void rk_destroy(void *self) {
    free(self);
}

/* What is left to the scheme. */
static void rk_defaults(const mhe_system *system, struct rk_config *config) {
    if (config->scheme == RK_AUTO) {
        config->scheme = system->n_z > 0 ? RK_RADAU : RK_GAUSS;
    }
    if (config->stages == 0) {
        config->stages = config->scheme == RK_RADAU ? 3 : 2;
    }
    if (config->max_step == 0) {
        config->max_step = config->scheme == RK_GAUSS ? 0.03 : 0.0025;
    }
    if (config->activation_step == 0) {
        config->activation_step = config->scheme == RK_GAUSS ? 3.4 : 1.7;
    }
}

static mhe_status rk_create(const mhe_host *host, const mhe_system *system, const void *config,
                            void **self, mhe_error *err) {
    (void)host;
    struct rk *rk = calloc(1, sizeof *rk);
    if (rk == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for an integrator");
    }
    rk->system = system;
    rk->config = *(const struct rk_config *)config;
    if (rk->config.max_step > 0 && rk->config.max_step < RK_SHORTEST) {
        free(rk);
        return mhe_fail(err, MHE_E_CONFIG, "max_step: below %g s; 0 leaves it to the scheme",
                        RK_SHORTEST);
    }
    if (rk->config.activation_step > 0 && rk->config.activation_step < RK_FINEST) {
        free(rk);
        return mhe_fail(err, MHE_E_CONFIG, "activation_step: below %g; 0 leaves it to the scheme",
                        RK_FINEST);
    }
    rk_defaults(system, &rk->config);
    rk->pad = (system->n_m + RK_LANES - 1) / RK_LANES * RK_LANES;
    rk_tableau_gauss(RK_ACTIVATION_STAGES, &rk->activation);
    if (rk->config.scheme == RK_RK4) {
        rk_tableau_rk4(&rk->mechanics);
    } else if (rk->config.scheme == RK_RADAU) {
        rk_tableau_radau(rk->config.stages, &rk->mechanics);
    } else {
        rk_tableau_gauss(rk->config.stages, &rk->mechanics);
        rk_tableau_probes(&rk->mechanics, rk->probes);
        rk_tests(&rk->mechanics, rk->probes, rk->tests);
    }
    rk_memory_layout(rk);
    *self = rk;
    return MHE_OK;
}

static int32_t rk_memory_size(const void *self) {
    const struct rk *rk = self;
    return rk->memory_steps * rk->memory_stride;
}

static void rk_context_destroy(void *context) {
    struct rk_context *c = context;
    if (c != NULL) {
        free(c->arrays);
        free(c);
    }
}

static mhe_status rk_context_create(const void *self, void *system_context, void **context,
                                    mhe_error *err) {
    const struct rk *rk = self;
    const mhe_system *system = rk->system;
    size_t n_q = (size_t)system->n_q, n_m = (size_t)system->n_m, pad = (size_t)rk->pad;
    size_t s = (size_t)rk->mechanics.stages, two = (size_t)system->first_d;
    size_t columns = (size_t)(system->n_x + system->n_u + system->n_p), n_z = (size_t)system->n_z;
    size_t wide = n_z > 0 ? columns : 0;
    double *slot, *trace;
    struct rk_context *c = calloc(1, sizeof *c);
    if (c == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for an integrator");
    }
    const struct {
        double **array;
        size_t n;
    } arrays[] = {{&c->a, pad},
                  {&c->a_a, pad},
                  {&c->a_e, pad},
                  {&c->a_start, n_m},
                  {&c->stage_a, s * n_m},
                  {&c->stage_a_a, s * n_m},
                  {&c->stage_a_e, s * n_m},
                  {&c->slope, RK_ACTIVATION_STAGES * pad},
                  {&c->slope_a, RK_ACTIVATION_STAGES * pad},
                  {&c->slope_e, RK_ACTIVATION_STAGES * pad},
                  {&c->guess, RK_ACTIVATION_STAGES * pad},
                  {&c->guess_a, RK_ACTIVATION_STAGES * pad},
                  {&c->guess_e, RK_ACTIVATION_STAGES * pad},
                  {&c->q, n_q},
                  {&c->v, n_q},
                  {&c->K, s * n_q},
                  {&c->stage_q, n_q},
                  {&c->stage_v, n_q},
                  {&c->defect, RK_PROBES * n_q},
                  {&c->probe_a, n_m},
                  {&c->held, 3 * pad},
                  {&c->f, s * n_q},
                  {&c->residual, s * n_q},
                  {&slot, (size_t)rk_slot_size(rk)},
                  {&trace, (size_t)rk_trace_size(rk)},
                  {&c->weights, RK_WEIGHED * (RK_WEIGHED + 1) / 2 * s * RK_ACTIVATION_STAGES},
                  {&c->direct, two * (n_m > n_q ? n_m : n_q)},
                  {&c->adjoint, two * s * n_q},
                  {&c->carry, two * two},
                  {&c->sens, (two + n_z) * columns},
                  {&c->sens_next, two * (columns - wide)},
                  {&c->z, n_z},
                  {&c->Z, s * n_z},
                  {&c->H, s * n_z},
                  {&c->offset, s * n_z},
                  {&c->dz, s * n_z},
                  {&c->by_K, s * n_z * s * n_q},
                  {&c->wide_K, s * n_q * wide},
                  {&c->wide_H, s * n_z * wide},
                  {&c->wide_Z, s * n_z * wide},
                  {&c->before, n_z > 0 ? 3 * pad : 0}};
    const size_t n_arrays = sizeof arrays / sizeof arrays[0];
    size_t total = 1;
    for (size_t i = 0; i < n_arrays; i++) {
        total += arrays[i].n;
    }
    c->rk = rk;
    c->system_context = system_context;
    c->columns = (int32_t)columns;
    c->arrays = calloc(total, sizeof *c->arrays);
    if (c->arrays == NULL) {
        rk_context_destroy(c);
        return mhe_fail(err, MHE_E_MEMORY, "no memory for an integrator");
    }
    double *next = c->arrays;
    for (size_t i = 0; i < n_arrays; i++) {
        *arrays[i].array = next;
        next += arrays[i].n;
    }
    rk_slot_at(rk, slot, &c->own);
    rk_trace_at(rk, trace, &c->trace);
    rk_activation_weights(c);
    *context = c;
    return MHE_OK;
}

static void rk_fill(double *x, int32_t n, double value) {
    for (int32_t i = 0; i < n; i++) {
        x[i] = value;
    }
}

/* Puts the context at the start of an interval. Without activations among the states the controls
 * are the stage activations. */
static void rk_begin(struct rk_context *c, const double *x, const double *u) {
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q, n_m = system->n_m, s = c->rk->mechanics.stages;
    size_t bytes_q = sizeof(double) * (size_t)n_q, bytes_m = sizeof(double) * (size_t)n_m;
    memcpy(c->q, x, bytes_q);
    memcpy(c->v, x + n_q, bytes_q);
    memcpy(c->a, system->n_d > 0 ? x + system->first_d : u, bytes_m);
    rk_fill(c->a_a, n_m, 1);
    rk_fill(c->a_e, n_m, 0);
    if (system->n_d == 0) {
        memcpy(c->a_start, u, bytes_m);
        for (int32_t j = 0; j < s; j++) {
            memcpy(c->stage_a + j * n_m, u, bytes_m);
        }
        rk_fill(c->stage_a_e, s * n_m, 1);
    }
    memcpy(c->z, x + system->first_z, sizeof(double) * (size_t)system->n_z);
    c->step = 0;
}

/* Splits the carried derivatives into A and B. */
static void rk_derivatives(const struct rk_context *c, double *A, double *B) {
    const mhe_system *system = c->rk->system;
    int32_t first_d = system->first_d, first_z = system->first_z;
    int32_t n_d = system->n_d, n_x = system->n_x, n_u = system->n_u;
    for (int32_t i = 0; i < first_d; i++) {
        const double *row = c->sens + i * c->columns;
        memcpy(A + i * n_x, row, sizeof(double) * (size_t)n_x);
        memcpy(B + i * n_u, row + n_x, sizeof(double) * (size_t)n_u);
    }
    memset(A + first_d * n_x, 0, sizeof(double) * (size_t)(n_d * n_x));
    memset(B + first_d * n_u, 0, sizeof(double) * (size_t)(n_d * n_u));
    for (int32_t i = 0; i < n_d; i++) {
        A[(first_d + i) * n_x + first_d + i] = c->a_a[i];
        B[(first_d + i) * n_u + i] = c->a_e[i];
    }
    for (int32_t i = 0; i < system->n_z; i++) {
        const double *row = c->sens + (first_d + i) * c->columns;
        memcpy(A + (first_z + i) * n_x, row, sizeof(double) * (size_t)n_x);
        memcpy(B + (first_z + i) * n_u, row + n_x, sizeof(double) * (size_t)n_u);
    }
}

/* The same of the columns of the parameters; activations see none. */
static void rk_parameters(const struct rk_context *c, double *P) {
    const mhe_system *system = c->rk->system;
    int32_t two = system->first_d, n_d = system->n_d, n_p = system->n_p;
    size_t bytes = sizeof(double) * (size_t)n_p;
    for (int32_t i = 0; i < two + system->n_z; i++) {
        const double *row = c->sens + i * c->columns + system->n_x + system->n_u;
        memcpy(P + (i < two ? i : i + n_d) * n_p, row, bytes);
    }
    memset(P + two * n_p, 0, bytes * (size_t)n_d);
}

static mhe_status rk_step(void *context, const double *x, const double *u, const double *w,
                          double dt, double *memory, double *x_next,
                          const mhe_step_derivatives *out, mhe_error *err) {
    struct rk_context *c = context;
    const int32_t derivatives = out != NULL && out->A != NULL;
    c->memory = memory;
    c->u = u;
    c->w = w;
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q;
    int32_t n = (int32_t)fmax(1, ceil(dt / c->rk->config.max_step - 1e-9));
    rk_begin(c, x, u);
    mhe_status status = rk_steps(c, u, n, dt / n, derivatives, err);
    if (status != MHE_OK) {
        return status;
    }
    memcpy(x_next, c->q, sizeof(double) * (size_t)n_q);
    memcpy(x_next + n_q, c->v, sizeof(double) * (size_t)n_q);
    memcpy(x_next + system->first_d, c->a, sizeof(double) * (size_t)system->n_d);
    memcpy(x_next + system->first_z, c->z, sizeof(double) * (size_t)system->n_z);
    if (derivatives) {
        rk_derivatives(c, out->A, out->B);
        if (out->P != NULL && system->n_p > 0) {
            rk_parameters(c, out->P);
        }
    }
    return MHE_OK;
}

const mhe_integrator_ops rk_ops = {.size = sizeof rk_ops,
                                   .create = rk_create,
                                   .destroy = rk_destroy,
                                   .context_create = rk_context_create,
                                   .context_destroy = rk_context_destroy,
                                   .step = rk_step,
                                   .memory_size = rk_memory_size,
                                   .accepts = rk_accepts};
