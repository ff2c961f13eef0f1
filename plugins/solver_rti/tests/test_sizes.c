/* SPDX-License-Identifier: Apache-2.0 */
/* Programs of estimators at the ends of their sizes: whichever way they are solved, by sets from
 * the multipliers of a neighbour or from none, or by the interior point, the optimum is the same.
 */
#include "qp.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FIXED = 1, EQUAL = 2, INFEASIBLE = 4, SINGULAR = 8 };

typedef struct size {
    const char *name;
    int n_dense, n_muscles, n_loose, N; /* loose: controls that no simple state has */
    int what;
} size;

typedef struct program {
    mhe_stage_problem problem;
    qp_shape shape;
    int32_t *control_of;
    uint8_t *patterns;
    qp_stage *stages;
    double *memory;
    qp qp;
    void *qp_memory;
} program;

static uint64_t seed;

static double uniform(double lower, double upper) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return lower + (upper - lower) * (double)(seed >> 11) * 0x1p-53;
}

static void *take(size_t n, size_t bytes) {
    void *memory = aligned_alloc(64, (n * bytes + 64) / 64 * 64);
    assert_non_null(memory);
    memset(memory, 0, n * bytes);
    return memory;
}

static void make_shape(program *p, const size *z) {
    const int n_x = z->n_dense + z->n_muscles, n_u = z->n_muscles + z->n_loose;
    const size_t xx = (size_t)(n_x * n_x), xu = (size_t)(n_x * n_u), uu = (size_t)(n_u * n_u);
    p->patterns = take(2 * xx + 2 * xu + uu + 1, 1);
    uint8_t *A = p->patterns, *B = A + xx, *cost = B + xu, *ux = cost + xx, *of_u = ux + xu;
    for (int i = 0; i < n_x; i++) {
        const int dense = i < z->n_dense;
        for (int j = 0; j < n_x; j++) {
            A[i * n_x + j] = dense || j == i;
            cost[i * n_x + j] = (dense && j < z->n_dense) || j == i;
        }
        for (int j = 0; j < n_u; j++) {
            B[i * n_u + j] = dense || j == i - z->n_dense;
        }
    }
    for (int i = 0; i < n_u; i++) {
        of_u[i * n_u + i] = 1;
    }
    p->control_of = take((size_t)n_x, sizeof *p->control_of);
    p->problem = (mhe_stage_problem){.n_x = n_x,
                                     .n_u = n_u,
                                     .n_intervals = z->N,
                                     .A_pattern = A,
                                     .B_pattern = B,
                                     .xx_pattern = cost,
                                     .ux_pattern = ux,
                                     .uu_pattern = of_u};
    qp_shape_of(&p->problem, p->control_of, &p->shape);
    assert_true(p->shape.separable);
}

/* Muscles push dense states, markers (stiff) and EMG (weak) track something. */
static void make_stage(program *p, const size *z, int k) {
    const qp_shape *s = &p->shape;
    qp_stage *stage = &p->stages[k];
    for (int i = 0; i < s->n_dense; i++) {
        for (int j = 0; j <= i; j++) {
            const double h = i == j ? uniform(1, 100) : uniform(-0.3, 0.3);
            const double set = (z->what & SINGULAR) && i == s->n_dense - 1 ? 0 : h;
            stage->H[(s->n_u + i) * s->ld_z + s->n_u + j] = set;
            stage->H[(s->n_u + j) * s->ld_z + s->n_u + i] = set;
        }
        stage->g[s->n_u + i] = (z->what & SINGULAR) && i == s->n_dense - 1 ? 0 : uniform(-5, 5);
        for (int j = 0; j < s->n_z && k < s->N; j++) {
            const double scale = j < s->n_u ? 0.3 : 0.6 / s->n_dense;
            stage->F[i * s->ld_z + j] = uniform(-scale, scale) + (j == s->n_u + i ? 0.5 : 0);
        }
        stage->b[i] = k < s->N ? uniform(-0.1, 0.1) : 0;
    }
    for (int i = s->n_dense; i < s->n_x; i++) {
        stage->H[(s->n_u + i) * (s->ld_z + 1)] = 1e-6;
        stage->by_state[i] = uniform(0.3, 0.7);
        stage->by_control[i] = 1 - stage->by_state[i];
    }
    for (int i = 0; i < s->n_u && k < s->N; i++) {
        stage->H[i * (s->ld_z + 1)] = (z->what & SINGULAR) && i % 3 == 0 ? 0 : uniform(0.5, 2);
        stage->g[i] = (z->what & SINGULAR) && i % 3 == 0 ? 0 : uniform(-0.5, 0.5);
    }
}

static void make_bounds(program *p, const size *z) {
    const qp_shape *s = &p->shape;
    for (int k = 0; k <= s->N; k++) {
        for (int i = k < s->N ? 0 : s->n_u; i < s->n_z; i++) {
            double *lower = row_z(s, p->qp.lower, k) + i, *upper = row_z(s, p->qp.upper, k) + i;
            const int simple = i >= s->n_u + s->n_dense, control = i < s->n_u;
            *lower = simple || control ? -uniform(0, 0.4) : -INFINITY;
            *upper = simple || control ? uniform(0.3, 0.6) : INFINITY;
            if (k == 0 && i >= s->n_u) {
                *lower = *upper = 0;
            } else if (control && (z->what & FIXED)) {
                *lower = *upper = 0.1;
            } else if (simple && (z->what & FIXED)) {
                *lower = -1, *upper = 1;
            } else if (!control && !simple && k == s->N && (z->what & EQUAL)) {
                *lower = *upper = 0.05;
            } else if (simple && k == s->N && (z->what & INFEASIBLE)) {
                *lower = 5, *upper = 6; /* no control gets there */
            }
        }
    }
}

static void make(program *p, const size *z) {
    *p = (program){0};
    make_shape(p, z);
    const qp_shape *s = &p->shape;
    p->stages = take((size_t)s->N + 1, sizeof *p->stages);
    p->memory = take(qp_stages_size(s), sizeof(double));
    p->qp_memory = take(qp_size(s), 1);
    qp_stages_place(s, p->memory, p->stages);
    qp_place(&p->qp, s, p->qp_memory);
    for (int k = 0; k <= s->N; k++) {
        make_stage(p, z, k);
    }
    make_bounds(p, z);
    qp_read_bounds(&p->qp);
}

static void drop(program *p) {
    free(p->patterns);
    free(p->control_of);
    free(p->stages);
    free(p->memory);
    free(p->qp_memory);
}

static double cost(const program *p) {
    const qp_shape *s = &p->shape;
    double sum = 0;
    for (int k = 0; k <= s->N; k++) {
        const double *w = row_z(s, p->qp.w, k);
        for (int i = 0; i < s->n_z; i++) {
            double slope = p->stages[k].g[i];
            for (int j = 0; j < s->n_z; j++) {
                slope += 0.5 * p->stages[k].H[i * s->ld_z + j] * w[j];
            }
            sum += w[i] * slope;
        }
    }
    return sum;
}

static const qp_limits tight = {.stationarity = 1e-9,
                                .feasibility = 1e-10,
                                .complementarity = 1e-11,
                                .max_iterations = 200,
                                .regularisation = 1e-9};

/* From w = 0 with the multipliers that are there, or without; the result. */
static int32_t solve(program *p, int32_t warm, int32_t forget) {
    const size_t bytes = sizeof(double) * size_z(&p->shape);
    memset(p->qp.w, 0, bytes);
    for (size_t i = 0; i < size_z(&p->shape); i++) {
        p->qp.w[i] = p->qp.fixed[i] ? p->qp.lower[i] : 0;
        p->qp.z_lower[i] *= !forget;
        p->qp.z_upper[i] *= !forget;
    }
    p->qp.to_skip = 0;
    return qp_solve(&p->qp, p->stages, &tight, warm);
}

static void ends(void **state) {
    (void)state;
    static const size sizes[] = {{"usual", 8, 19, 0, 7, 0},
                                 {"one muscle", 2, 1, 0, 7, 0},
                                 {"no muscle", 4, 0, 2, 7, 0},
                                 {"300 muscles", 12, 300, 0, 5, 0},
                                 {"activation-driven", 8, 0, 40, 7, 0},
                                 {"window 2", 8, 19, 0, 2, 0},
                                 {"window 200", 4, 6, 0, 200, 0},
                                 {"all controls fixed", 8, 19, 0, 7, FIXED},
                                 {"last state given", 2, 19, 0, 7, EQUAL},
                                 {"bounds that cannot be met", 4, 6, 0, 7, INFEASIBLE},
                                 {"singular Hessian", 4, 10, 0, 7, SINGULAR}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        program p;
        seed = 17 + i;
        make(&p, &sizes[i]);
        const int32_t inside = solve(&p, 0, 1);
        const double best = cost(&p), scale = 1 + fabs(best);
        const int32_t expected = sizes[i].what & INFEASIBLE ? QP_INFEASIBLE : QP_SOLVED;
        assert_int_equal(inside, expected);
        for (int forget = 0; forget < 2; forget++) {
            const int32_t result = solve(&p, 1, forget);
            print_message(
                "%-26s %d: result %d, %d systems, fallbacks %d of %d, cost %.12g, off %.1e\n",
                sizes[i].name, forget, (int)result, (int)p.qp.iterations, (int)p.qp.fallbacks,
                (int)p.qp.programs - 1, best, cost(&p) - best);
            assert_int_equal(result, expected);
            if (expected == QP_SOLVED) {
                assert_true(fabs(cost(&p) - best) <= 1e-9 * scale);
            }
        }
        drop(&p);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(ends)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
