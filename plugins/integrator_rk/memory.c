/* SPDX-License-Identifier: Apache-2.0 */
/* memory.c: where the memory of an interval keeps its steps.
 *
 * Step after step of the interval: a slot of the mechanical step, then the traces of the steps that
 * its activations take. Steps beyond the capacity start from nothing. */
#include "rk.h"

#include <math.h>

/* The steps of this many seconds are kept, but never more than so many. */
#define RK_MEMORY_SPAN 0.06
#define RK_MEMORY_STEPS 8
#define RK_MEMORY_TRACES 4
#define RK_MEMORY_TRACE 0.0075 /* s: short for a step of the activations */

/* Length of an array at *next, which moves behind it. */
static double *rk_take(double **next, int32_t n) {
    double *array = *next;
    *next += n;
    return array;
}

int32_t rk_slot_size(const struct rk *rk) {
    int32_t q = rk->system->n_q, m = rk->system->n_m, r = rk->system->n_r;
    int32_t s = rk->mechanics.stages, n = s * q;
    int32_t size =
        1 + 2 * q + r + rk->system->n_w + s * m + n + 2 * n * q + n * m + n * r + n * n + n;
    int32_t z = rk->system->n_z, k = rk->system->n_k;
    size += (n + s * z) * rk->system->n_p;
    return z == 0 ? size
                  : size + z + m + s * z + n * z + s * z * (2 * q + 2 + k) + m * s * k * s * k +
                        s * z * n;
}

void rk_slot_at(const struct rk *rk, double *memory, struct rk_slot *out) {
    int32_t q = rk->system->n_q, m = rk->system->n_m, r = rk->system->n_r;
    int32_t s = rk->mechanics.stages, n = s * q;
    out->step = rk_take(&memory, 1);
    out->q = rk_take(&memory, q);
    out->v = rk_take(&memory, q);
    out->r = rk_take(&memory, r);
    out->w = rk_take(&memory, rk->system->n_w);
    out->stage_a = rk_take(&memory, s * m);
    out->K = rk_take(&memory, n);
    out->f_q = rk_take(&memory, n * q);
    out->f_v = rk_take(&memory, n * q);
    out->f_a = rk_take(&memory, n * m);
    out->f_r = rk_take(&memory, n * r);
    out->f_p = rk_take(&memory, n * rk->system->n_p);
    out->h_p = rk_take(&memory, s * rk->system->n_z * rk->system->n_p);
    out->lu = rk_take(&memory, n * n);
    out->pivots = (int32_t *)(void *)rk_take(&memory, n);
    int32_t z = rk->system->n_z, k = rk->system->n_k;
    if (z == 0) {
        return;
    }
    out->z = rk_take(&memory, z);
    out->u = rk_take(&memory, m);
    out->Z = rk_take(&memory, s * z);
    out->f_z = rk_take(&memory, n * z);
    out->h_q = rk_take(&memory, s * z * q);
    out->h_v = rk_take(&memory, s * z * q);
    out->h_a = rk_take(&memory, s * z);
    out->h_c = rk_take(&memory, s * z);
    out->h_z = rk_take(&memory, s * z * k);
    out->P = rk_take(&memory, m * s * k * s * k);
    out->E = rk_take(&memory, s * z * n);
}

int32_t rk_trace_size(const struct rk *rk) {
    return 1 + 2 * rk->system->n_m + 3 * RK_ACTIVATION_STAGES * rk->pad;
}

void rk_trace_at(const struct rk *rk, double *memory, struct rk_trace *out) {
    int32_t m = rk->system->n_m, n = RK_ACTIVATION_STAGES * rk->pad;
    out->step = rk_take(&memory, 1);
    out->a = rk_take(&memory, m);
    out->e = rk_take(&memory, m);
    out->value = rk_take(&memory, n);
    out->by_a = rk_take(&memory, n);
    out->by_e = rk_take(&memory, n);
}

static int32_t rk_at_most(double wanted, int32_t most) {
    return wanted < most ? (int32_t)wanted : most;
}

void rk_memory_layout(struct rk *rk) {
    if (rk->mechanics.is_explicit) {
        return; /* nothing to start from */
    }
    double step = rk->config.max_step;
    rk->memory_steps = rk_at_most(ceil(RK_MEMORY_SPAN / step - 1e-9), RK_MEMORY_STEPS);
    rk->memory_traces =
        rk->system->n_d > 0 ? rk_at_most(ceil(step / RK_MEMORY_TRACE), RK_MEMORY_TRACES) : 0;
    rk->memory_stride = rk_slot_size(rk) + rk->memory_traces * rk_trace_size(rk);
}

int rk_memory_slot(const struct rk_context *c, struct rk_slot *out) {
    if (c->memory == NULL || c->slot >= c->rk->memory_steps) {
        return 0;
    }
    rk_slot_at(c->rk, c->memory + c->slot * c->rk->memory_stride, out);
    return 1;
}

int rk_memory_trace(const struct rk_context *c, int32_t k, struct rk_trace *out) {
    const struct rk *rk = c->rk;
    if (c->memory == NULL || c->slot >= rk->memory_steps || k >= rk->memory_traces) {
        return 0;
    }
    rk_trace_at(rk,
                c->memory + c->slot * rk->memory_stride + rk_slot_size(rk) + k * rk_trace_size(rk),
                out);
    return 1;
}
