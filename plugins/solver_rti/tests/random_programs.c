/* SPDX-License-Identifier: Apache-2.0 */
#include "random_programs.h"

#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint64_t seed;

void random_begin(uint64_t value) {
    seed = value;
}

double random_uniform(double lower, double upper) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return lower + (upper - lower) * (double)(seed >> 11) * 0x1p-53;
}

static int whole(int lower, int upper) {
    return lower + (int)random_uniform(0, upper - lower + 0.999999);
}

static void *take(size_t n, size_t size) {
    void *memory = aligned_alloc(64, (n * size + 64) / 64 * 64);
    assert_non_null(memory);
    memset(memory, 0, n * size);
    return memory;
}

static void make_shape(program *p, const recipe *r) {
    const int n_x = whole(1, r->max_x), n_u = whole(1, r->max_u);
    const int simple = random_uniform(0, 1) < r->activations ? whole(0, n_x < n_u ? n_x : n_u) : 0;
    const int simple_x = n_x * (n_x + n_u), n_costs = n_x * n_x + n_u * n_x + n_u * n_u;
    p->pattern = take((size_t)(simple_x + n_costs), 1);
    uint8_t *xx = p->pattern + simple_x, *ux = xx + n_x * n_x, *uu = ux + n_u * n_x;
    p->control_of = take((size_t)n_x, sizeof *p->control_of);
    p->problem = (mhe_stage_problem){.n_x = n_x,
                                     .n_u = n_u,
                                     .n_intervals = whole(1, r->max_N),
                                     .A_pattern = p->pattern,
                                     .B_pattern = p->pattern + n_x * n_x,
                                     .xx_pattern = xx,
                                     .ux_pattern = ux,
                                     .uu_pattern = uu};
    p->n_tied = !r->separable ? n_x : whole(0, 1) ? n_x - simple : whole(0, n_x - simple);
    for (int i = 0; i < n_x; i++) {
        for (int j = 0; j < n_x; j++) {
            xx[i * n_x + j] = i == j || (i < p->n_tied && j < p->n_tied);
        }
    }
    memset(ux, !r->separable, (size_t)(n_u * n_x));
    for (int i = 0; i < n_u; i++) {
        for (int j = 0; j < n_u; j++) {
            uu[i * n_u + j] = i == j || !r->separable;
        }
    }
    const int shift = whole(0, n_u - simple);
    for (int i = 0; i < n_x; i++) {
        for (int j = 0; j < n_x + n_u; j++) {
            const int column = j < n_x ? i * n_x + j : n_x * n_x + i * n_u + (j - n_x);
            const int alone = j == i || j - n_x == shift + i - (n_x - simple);
            p->pattern[column] = i < n_x - simple || alone;
        }
    }
    qp_shape_of(&p->problem, p->control_of, &p->shape);
    assert_true(p->shape.n_dense <= n_x - simple);
    assert_true(p->shape.n_tied <= p->shape.n_dense);
    assert_true(!p->shape.separable || p->shape.n_tied <= p->n_tied);
    assert_true(p->shape.separable || !r->separable || p->shape.n_dense < n_x - simple);
}

/* H = sum of a few d v v^T: positive semidefinite with curvatures of all sizes. */
static void make_cost(program *p, const recipe *r, int k) {
    const qp_shape *s = &p->shape;
    const int first = k < s->N ? 0 : s->n_u;
    double v[128];
    for (int t = first; t < s->n_z; t++) {
        const double d =
            random_uniform(0, 1) < r->flat ? 0 : pow(10, random_uniform(-r->spread, r->spread));
        for (int i = first; i < s->n_z; i++) {
            const int tied = !r->separable || (i >= s->n_u && t >= s->n_u &&
                                               i < s->n_u + p->n_tied && t < s->n_u + p->n_tied);
            v[i] = i == t ? 1 : tied ? random_uniform(-0.3, 0.3) : 0;
        }
        for (int i = first; i < s->n_z; i++) {
            for (int j = first; j < s->n_z; j++) {
                p->stages[k].H[i * s->ld_z + j] += d * v[i] * v[j];
            }
        }
        /* in the range of H, so that a program with flat directions is bounded */
        const double pull = random_uniform(-2, 2) * d;
        for (int i = first; i < s->n_z; i++) {
            p->stages[k].g[i] += pull * v[i];
        }
    }
}

double program_entry(const program *p, int k, int i, int j) { /* of [B A] */
    const qp_shape *s = &p->shape;
    const qp_stage *stage = &p->stages[k];
    if (i < s->n_dense) {
        return stage->F[i * s->ld_z + j];
    }
    return j == s->n_u + i ? stage->by_state[i] : j == s->control_of[i] ? stage->by_control[i] : 0;
}

static void make_dynamics(program *p, const recipe *r, int k) {
    const qp_shape *s = &p->shape;
    for (int i = 0; i < s->n_x; i++) {
        for (int j = 0; j < s->n_z && i < s->n_dense; j++) {
            const double size = j < s->n_u ? 1 : r->growth / s->n_x;
            p->stages[k].F[i * s->ld_z + j] = random_uniform(-size, size);
        }
        if (i >= s->n_dense) {
            p->stages[k].by_state[i] = random_uniform(0, 1);
            p->stages[k].by_control[i] = s->control_of[i] >= 0 ? random_uniform(0, 1) : 0;
        }
    }
    for (int i = 0; i < s->n_x; i++) { /* so that p->feasible is */
        double sum = row_z(s, p->feasible, k + 1)[s->n_u + i];
        for (int j = 0; j < s->n_z; j++) {
            sum -= program_entry(p, k, i, j) * row_z(s, p->feasible, k)[j];
        }
        p->stages[k].b[i] = sum;
    }
}

/* A trajectory beside p->feasible, by other controls: tight bounds leave it strictly inside, since
 * without any interior there is no central path for an interior-point method to follow. */
static void make_neighbour(program *p, double *w, int first_free) {
    const qp_shape *s = &p->shape;
    memcpy(w, p->feasible, sizeof(double) * size_z(s));
    for (int i = s->n_u; i < s->n_z; i++) {
        w[i] += first_free ? random_uniform(-0.5, 0.5) : 0;
    }
    for (int k = 0; k < s->N; k++) {
        double *now = row_z(s, w, k), *next = row_z(s, w, k + 1) + s->n_u;
        for (int i = 0; i < s->n_u; i++) {
            now[i] += random_uniform(-0.5, 0.5);
        }
        for (int i = 0; i < s->n_x; i++) {
            next[i] = p->stages[k].b[i];
            for (int j = 0; j < s->n_z; j++) {
                next[i] += program_entry(p, k, i, j) * now[j];
            }
        }
    }
}

static void make_bounds(program *p, const recipe *r) {
    const qp_shape *s = &p->shape;
    const int first_free = random_uniform(0, 1) < r->first_free;
    double *other = take(size_z(s), sizeof(double));
    make_neighbour(p, other, first_free);
    for (int k = 0; k <= s->N; k++) {
        for (int i = 0; i < s->n_z; i++) {
            const double at = row_z(s, p->feasible, k)[i], beside = row_z(s, other, k)[i];
            double *lower = row_z(s, p->qp.lower, k) + i, *upper = row_z(s, p->qp.upper, k) + i;
            *lower = -INFINITY, *upper = INFINITY;
            if (random_uniform(0, 1) < r->bounded) {
                const int is_tight = random_uniform(0, 1) < r->tight;
                *lower = is_tight && beside > at ? at : fmin(at, beside) - random_uniform(0.01, 1);
                *upper = is_tight && beside < at ? at : fmax(at, beside) + random_uniform(0.01, 1);
                *lower = random_uniform(0, 1) < 0.2 ? -INFINITY : *lower;
                *upper = random_uniform(0, 1) < 0.2 ? INFINITY : *upper;
            }
            const int first = k == 0 && i >= s->n_u;
            const int is_pinned = first == r->separable && random_uniform(0, 1) < r->pinned;
            if ((first && !first_free) || is_pinned) {
                *lower = *upper = at;
            }
        }
    }
    free(other);
}

void program_make(program *p, const recipe *r) {
    *p = (program){0};
    make_shape(p, r);
    const qp_shape *s = &p->shape;
    p->stages = take((size_t)s->N + 1, sizeof *p->stages);
    p->memory = take(qp_stages_size(s), sizeof(double));
    p->feasible = take(size_z(s), sizeof(double));
    p->qp_memory = take(qp_size(s), 1);
    qp_stages_place(s, p->memory, p->stages);
    qp_place(&p->qp, s, p->qp_memory);
    for (int k = 0; k <= s->N; k++) {
        for (int i = k < s->N ? 0 : s->n_u; i < s->n_z; i++) {
            row_z(s, p->feasible, k)[i] = random_uniform(-1, 1);
        }
    }
    for (int k = 0; k <= s->N; k++) {
        make_cost(p, r, k);
        if (k < s->N) {
            make_dynamics(p, r, k);
        }
    }
    make_bounds(p, r);
    qp_read_bounds(&p->qp);
    for (size_t i = 0; i < size_z(s); i++) { /* constants are where they are fixed */
        p->qp.w[i] = p->qp.fixed[i] ? p->qp.lower[i] : 0;
    }
}

void program_drop(program *p) {
    free(p->pattern);
    free(p->control_of);
    free(p->stages);
    free(p->memory);
    free(p->feasible);
    free(p->qp_memory);
}
