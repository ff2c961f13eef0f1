/* SPDX-License-Identifier: Apache-2.0 */
/* create.c: a solver's memory and threads. */
#include "rti.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

double rti_now(void) {
    struct timespec time;
    (void)clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* One block that is cut into cache lines, so that threads do not share one; without memory it
 * counts what is needed. */
typedef struct block {
    char *memory;
    size_t used;
} block;

static void *cut(block *b, size_t bytes) {
    void *piece = b->memory != NULL ? b->memory + b->used : NULL;
    b->used += (bytes + 63) / 64 * 64;
    return piece;
}

static double *cut_doubles(block *b, size_t n) {
    return cut(b, sizeof(double) * n);
}

static void place_point(block *b, const qp_shape *shape, rti_point *point) {
    point->stages = cut(b, ((size_t)shape->N + 1) * sizeof(qp_stage));
    point->w = cut_doubles(b, size_z(shape));
    double *stages = cut_doubles(b, qp_stages_size(shape));
    if (stages != NULL) {
        qp_stages_place(shape, stages, point->stages);
    }
}

static void place_worker(block *b, const qp_shape *shape, rti_worker *worker) {
    const size_t n_x = (size_t)shape->n_x, n_u = (size_t)shape->n_u;
    worker->xx = cut_doubles(b, n_x * n_x);
    worker->A = cut_doubles(b, n_x * n_x);
    worker->ux = cut_doubles(b, n_u * n_x);
    worker->B = cut_doubles(b, n_u * n_x);
    worker->uu = cut_doubles(b, n_u * n_u);
    worker->grad_x = cut_doubles(b, n_x);
    worker->grad_u = cut_doubles(b, n_u);
    worker->x_next = cut_doubles(b, n_x);
    const size_t n_p = (size_t)shape->n_p;
    worker->px = cut_doubles(b, n_p * n_x);
    worker->pu = cut_doubles(b, n_p * n_u);
    worker->pp = cut_doubles(b, n_p * n_p);
    worker->P = cut_doubles(b, n_p * n_x);
    worker->grad_p = cut_doubles(b, n_p);
}

static void place(rti_solver *s, block *b) {
    const qp_shape *shape = &s->shape;
    const size_t z = size_z(shape), x = size_x(shape), n_stages = (size_t)shape->N + 1;
    void *program = cut(b, qp_size(shape));
    if (program != NULL) {
        qp_place(&s->qp, shape, program);
    }
    place_point(b, shape, &s->here);
    place_point(b, shape, &s->trial);
    double **const of_z[] = {&s->lower,   &s->upper,         &s->z_lower,       &s->z_upper,
                             &s->first.w, &s->first.z_lower, &s->first.z_upper, &s->slope,
                             &s->last.w,  &s->last.z_lower,  &s->last.z_upper,  &s->last_from,
                             &s->before};
    for (size_t i = 0; i < sizeof of_z / sizeof of_z[0]; i++) {
        *of_z[i] = cut_doubles(b, z);
    }
    const size_t n_x = (size_t)shape->n_x, n_u = (size_t)shape->n_u;
    s->result = cut_doubles(b, z);
    s->spread = cut_doubles(b, n_stages * n_x * (size_t)shape->ld_x);
    s->gain = cut_doubles(b, n_u * (size_t)shape->ld_x);
    s->rest = cut_doubles(b, n_u * (size_t)shape->ld_z);
    s->joint = cut_doubles(b, (n_x + n_u) * (size_t)shape->ld_z);
    s->lambda = cut_doubles(b, x);
    s->first.lambda = cut_doubles(b, x);
    s->last.lambda = cut_doubles(b, x);
    s->weight = cut_doubles(b, x);
    s->gaps = cut_doubles(b, x);
    s->stage_cost = cut_doubles(b, n_stages);
    s->stage_status = cut(b, n_stages * sizeof(mhe_status));
    for (int32_t i = 0; i < s->problem->n_workers; i++) {
        place_worker(b, shape, &s->workers[i]);
    }
}

static int32_t take_memory(rti_solver *s) {
    const mhe_stage_problem *p = s->problem;
    int32_t *control_of = calloc((size_t)p->n_x, sizeof *control_of);
    s->shape.control_of = control_of;
    s->workers = calloc((size_t)p->n_workers, sizeof *s->workers);
    if (control_of == NULL || s->workers == NULL) {
        return 0;
    }
    qp_shape_of(p, control_of, &s->shape);
    block needed = {0};
    place(s, &needed);
    block b = {.memory = aligned_alloc(64, needed.used)};
    s->memory = b.memory;
    if (s->memory == NULL) {
        return 0;
    }
    memset(s->memory, 0, needed.used);
    place(s, &b);
    return 1;
}

mhe_status rti_accepts(const mhe_stage_problem *problem, const void *config, mhe_error *err) {
    (void)problem, (void)config, (void)err; /* any: parameters border the recursion */
    return MHE_OK;
}

mhe_status rti_create(const mhe_host *host, const mhe_stage_problem *problem, const void *config,
                      void **self, mhe_error *err) {
    rti_solver *s = calloc(1, sizeof *s);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->host = host;
    s->config = config;
    s->problem = problem;
    if (!take_memory(s)) {
        rti_destroy(s);
        return mhe_fail(err, MHE_E_MEMORY, "no memory for %d intervals of %d states, %d controls",
                        (int)problem->n_intervals, (int)problem->n_x, (int)problem->n_u);
    }
    s->pool = rti_pool_create(problem->n_workers, s->config->spin);
    *self = s;
    return MHE_OK;
}

void rti_destroy(void *self) {
    rti_solver *s = self;
    if (s != NULL) {
        rti_pool_destroy(s->pool);
        free((void *)s->shape.control_of);
        free(s->workers);
        free(s->memory);
        free(s);
    }
}
