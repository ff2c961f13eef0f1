/* SPDX-License-Identifier: Apache-2.0 */
/* Random staged quadratic programs: the optimality conditions decide, computed here without any
 * code of the solver. They are convex, so a point that satisfies the conditions is a minimum. */
#include "qp.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* How a family of programs is made. */
typedef struct recipe {
    const char *name;
    int n_programs;
    int max_x, max_u, max_N;
    double spread;      /* curvatures are 10^-spread .. 10^spread */
    double flat;        /* part of the curvatures that are 0 */
    double growth;      /* largest row sum of |A| */
    double bounded;     /* part of the variables with bounds */
    double tight;       /* ... whose bound goes through the known feasible point */
    double first_free;  /* part of the programs without a fixed first state */
    double pinned;      /* part of the later states and controls with equal bounds; where costs are
                         * separable, of first states */
    double activations; /* part of the programs with simple rows */
    int separable;      /* costs of controls and simple states are squares of each alone */
} recipe;

typedef struct program {
    mhe_stage_problem problem;
    uint8_t *pattern;
    int32_t *control_of;
    qp_shape shape;
    qp_stage *stages;
    double *memory, *feasible;
    int n_tied; /* first states, whose costs may hold products */
    qp qp;
    void *qp_memory;
} program;

static uint64_t seed;

static double uniform(double lower, double upper) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return lower + (upper - lower) * (double)(seed >> 11) * 0x1p-53;
}

static int whole(int lower, int upper) {
    return lower + (int)uniform(0, upper - lower + 0.999999);
}

static void *take(size_t n, size_t size) {
    void *memory = aligned_alloc(64, (n * size + 64) / 64 * 64);
    assert_non_null(memory);
    memset(memory, 0, n * size);
    return memory;
}

static void make_shape(program *p, const recipe *r) {
    const int n_x = whole(1, r->max_x), n_u = whole(1, r->max_u);
    const int simple = uniform(0, 1) < r->activations ? whole(0, n_x < n_u ? n_x : n_u) : 0;
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
        const double d = uniform(0, 1) < r->flat ? 0 : pow(10, uniform(-r->spread, r->spread));
        for (int i = first; i < s->n_z; i++) {
            const int tied = !r->separable || (i >= s->n_u && t >= s->n_u &&
                                               i < s->n_u + p->n_tied && t < s->n_u + p->n_tied);
            v[i] = i == t ? 1 : tied ? uniform(-0.3, 0.3) : 0;
        }
        for (int i = first; i < s->n_z; i++) {
            for (int j = first; j < s->n_z; j++) {
                p->stages[k].H[i * s->ld_z + j] += d * v[i] * v[j];
            }
        }
        /* in the range of H, so that a program with flat directions is bounded */
        const double pull = uniform(-2, 2) * d;
        for (int i = first; i < s->n_z; i++) {
            p->stages[k].g[i] += pull * v[i];
        }
    }
}

static double entry(const program *p, int k, int i, int j) { /* of [B A] */
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
            p->stages[k].F[i * s->ld_z + j] = uniform(-size, size);
        }
        if (i >= s->n_dense) {
            p->stages[k].by_state[i] = uniform(0, 1);
            p->stages[k].by_control[i] = s->control_of[i] >= 0 ? uniform(0, 1) : 0;
        }
    }
    for (int i = 0; i < s->n_x; i++) { /* so that p->feasible is */
        double sum = row_z(s, p->feasible, k + 1)[s->n_u + i];
        for (int j = 0; j < s->n_z; j++) {
            sum -= entry(p, k, i, j) * row_z(s, p->feasible, k)[j];
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
        w[i] += first_free ? uniform(-0.5, 0.5) : 0;
    }
    for (int k = 0; k < s->N; k++) {
        double *now = row_z(s, w, k), *next = row_z(s, w, k + 1) + s->n_u;
        for (int i = 0; i < s->n_u; i++) {
            now[i] += uniform(-0.5, 0.5);
        }
        for (int i = 0; i < s->n_x; i++) {
            next[i] = p->stages[k].b[i];
            for (int j = 0; j < s->n_z; j++) {
                next[i] += entry(p, k, i, j) * now[j];
            }
        }
    }
}

static void make_bounds(program *p, const recipe *r) {
    const qp_shape *s = &p->shape;
    const int first_free = uniform(0, 1) < r->first_free;
    double *other = take(size_z(s), sizeof(double));
    make_neighbour(p, other, first_free);
    for (int k = 0; k <= s->N; k++) {
        for (int i = 0; i < s->n_z; i++) {
            const double at = row_z(s, p->feasible, k)[i], beside = row_z(s, other, k)[i];
            double *lower = row_z(s, p->qp.lower, k) + i, *upper = row_z(s, p->qp.upper, k) + i;
            *lower = -INFINITY, *upper = INFINITY;
            if (uniform(0, 1) < r->bounded) {
                const int is_tight = uniform(0, 1) < r->tight;
                *lower = is_tight && beside > at ? at : fmin(at, beside) - uniform(0.01, 1);
                *upper = is_tight && beside < at ? at : fmax(at, beside) + uniform(0.01, 1);
                *lower = uniform(0, 1) < 0.2 ? -INFINITY : *lower;
                *upper = uniform(0, 1) < 0.2 ? INFINITY : *upper;
            }
            const int first = k == 0 && i >= s->n_u;
            const int is_pinned = first == r->separable && uniform(0, 1) < r->pinned;
            if ((first && !first_free) || is_pinned) {
                *lower = *upper = at;
            }
        }
    }
    free(other);
}

static void make(program *p, const recipe *r) {
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
            row_z(s, p->feasible, k)[i] = uniform(-1, 1);
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

static void drop(program *p) {
    free(p->pattern);
    free(p->control_of);
    free(p->stages);
    free(p->memory);
    free(p->feasible);
    free(p->qp_memory);
}

/* Largest violations of the optimality conditions, relative to the terms that they are sums of. */
typedef struct kkt {
    double stationarity, feasibility, complementarity, sign;
} kkt;

static void check_variable(const program *p, int k, int i, double slope, double terms, kkt *out) {
    const ptrdiff_t at = (ptrdiff_t)k * p->shape.ld_z + i;
    const double w = p->qp.w[at], lower = p->qp.lower[at], upper = p->qp.upper[at];
    const double z_lower = p->qp.z_lower[at], z_upper = p->qp.z_upper[at];
    out->feasibility = fmax(out->feasibility, fmax(lower - w, w - upper));
    out->sign = fmax(out->sign, fmax(-z_lower, -z_upper));
    if (p->qp.fixed[at]) {
        return;
    }
    slope += z_upper - z_lower;
    terms = fmax(terms, fmax(z_lower, z_upper));
    out->stationarity = fmax(out->stationarity, fabs(slope) / terms);
    const double below = isfinite(lower) ? w - lower : 1, above = isfinite(upper) ? upper - w : 1;
    out->complementarity = fmax(out->complementarity, z_lower * below / fmax(1, z_lower));
    out->complementarity = fmax(out->complementarity, z_upper * above / fmax(1, z_upper));
}

static kkt conditions(const program *p) {
    const qp_shape *s = &p->shape;
    kkt out = {0};
    for (int k = 0; k <= s->N; k++) {
        const double *w = row_z(s, p->qp.w, k);
        for (int i = 0; i < s->n_x && k < s->N; i++) {
            double sum = p->stages[k].b[i] - row_z(s, p->qp.w, k + 1)[s->n_u + i];
            for (int j = 0; j < s->n_z; j++) {
                sum += entry(p, k, i, j) * w[j];
            }
            out.feasibility = fmax(out.feasibility, fabs(sum));
        }
        for (int i = k < s->N ? 0 : s->n_u; i < s->n_z; i++) {
            double slope = p->stages[k].g[i], terms = fmax(1, fabs(slope));
            for (int j = 0; j < s->n_z; j++) {
                const double part = p->stages[k].H[i * s->ld_z + j] * w[j];
                slope += part;
                terms = fmax(terms, fabs(part));
            }
            if (i >= s->n_u && k > 0) {
                const double part = row_x(s, p->qp.lambda, k - 1)[i - s->n_u];
                slope += part;
                terms = fmax(terms, fabs(part));
            }
            for (int j = 0; j < s->n_x && k < s->N; j++) {
                const double part = entry(p, k, j, i) * row_x(s, p->qp.lambda, k)[j];
                slope -= part;
                terms = fmax(terms, fabs(part));
            }
            check_variable(p, k, i, slope, terms, &out);
        }
    }
    return out;
}

static const qp_limits tight = {.stationarity = 1e-9,
                                .feasibility = 1e-9,
                                .complementarity = 1e-9,
                                .max_iterations = 200,
                                .regularisation = 1e-9};

/* Multipliers as of a program some of whose bounds were others. */
static void confuse(program *p) {
    for (size_t i = 0; i < size_z(&p->shape); i++) {
        const double dice = uniform(0, 1);
        if (!p->qp.fixed[i] && isfinite(p->qp.lower[i]) && isfinite(p->qp.upper[i])) {
            p->qp.z_lower[i] = dice < 0.1 ? 1 : dice < 0.2 ? 0 : p->qp.z_lower[i];
            p->qp.z_upper[i] = dice < 0.1 ? 0 : dice < 0.15 ? 1 : p->qp.z_upper[i];
        }
    }
}

/* How far a solved program is from its conditions. */
static double off(const program *p, double *worst) {
    const kkt found = conditions(p);
    const double values[4] = {found.stationarity, found.feasibility, found.complementarity,
                              found.sign};
    double most = 0;
    for (int j = 0; j < 4; j++) {
        most = values[j] <= most ? most : values[j]; /* NaN stays */
        worst[j] = fmax(worst[j], values[j]);
    }
    return most;
}

static void run(const recipe *r) {
    double iterations = 0, warm_iterations = 0, most = 0, worst[4] = {0};
    int failures = 0, fallbacks = 0, by_sets = 0, updates = 0;
    for (int i = 0; i < r->n_programs; i++) {
        program p;
        seed = (uint64_t)i * 7919u + 17u;
        make(&p, r);
        const int32_t result = qp_solve(&p.qp, p.stages, &tight, 0);
        double far = off(&p, worst);
        iterations += p.qp.iterations;
        most = fmax(most, p.qp.iterations);
        for (int again = 0; again < 2;
             again++) { /* by sets, from the multipliers, and from others */
            if (again) {
                confuse(&p);
            }
            for (size_t j = 0; j < size_z(&p.shape); j++) {
                p.qp.w[j] = p.qp.fixed[j] ? p.qp.lower[j] : 0;
            }
            assert_int_equal(qp_solve(&p.qp, p.stages, &tight, 1), QP_SOLVED);
            const double warm = off(&p, worst);
            far = warm <= far ? far : warm;
            warm_iterations += p.qp.iterations;
        }
        fallbacks += p.qp.fallbacks;
        by_sets += p.qp.programs - 1 - p.qp.fallbacks;
        updates += p.qp.updates;
        if ((result != QP_SOLVED || !(far <= 1e-8)) && failures++ < 5) {
            print_message("%s %d: result %d after %d iterations; N %d, n_x %d (%d dense), n_u %d; "
                          "off by %g; own %g %g %g\n",
                          r->name, i, (int)result, (int)p.qp.iterations, (int)p.shape.N,
                          (int)p.shape.n_x, (int)p.shape.n_dense, (int)p.shape.n_u, far,
                          p.qp.stationarity, p.qp.feasibility, p.qp.complementarity);
        }
        drop(&p);
    }
    print_message(
        "%-16s %5d programs, %4.1f iterations (most %.0f), again warm %.1f, %d by sets (%d by "
        "updates), %d not; violations %.1e %.1e %.1e\n",
        r->name, r->n_programs, iterations / r->n_programs, most,
        warm_iterations / (2 * r->n_programs), by_sets, updates, fallbacks, worst[0], worst[1],
        worst[2]);
    assert_int_equal(failures, 0);
    if (r->separable) {
        assert_true(by_sets > r->n_programs / 4); /* of twice as many */
        assert_true(r->first_free > 0.5 || updates > r->n_programs / 10);
    }
}

static void test_families(void **state) {
    (void)state;
    static const recipe families[] = {
        {"free", 500, 10, 10, 10, 1, 0, 1, 0, 0, 0.5, 0, 0, 0},
        {"small", 3000, 5, 5, 10, 1, 0, 1.5, 0.7, 0.2, 0.5, 0, 0.3, 0},
        {"activations", 1000, 30, 30, 10, 1, 0, 1, 0.8, 0.1, 0.3, 0, 1, 0},
        {"real size", 200, 30, 30, 20, 1, 0, 1, 0.9, 0.2, 0.2, 0, 1, 0},
        {"ill-conditioned", 1500, 8, 8, 12, 4, 0, 1.5, 0.8, 0.2, 0.5, 0, 0.3, 0},
        {"degenerate", 1500, 8, 8, 12, 1, 0.2, 1.2, 1, 0.6, 0.5, 0, 0.3, 0},
        {"unstable", 800, 6, 6, 20, 1, 0, 3, 0.8, 0.2, 0.5, 0, 0, 0},
        {"separable", 1500, 30, 30, 10, 1, 0, 1, 0.8, 0.1, 0, 0, 1, 1},
        {"muscles", 300, 12, 40, 20, 1, 0, 1, 0.9, 0.2, 0, 0, 1, 1},
        {"ill separable", 1000, 10, 10, 12, 4, 0, 1, 0.8, 0.2, 0.2, 0, 1, 1},
        {"begins", 1000, 30, 30, 10, 1, 0, 1, 0.8, 0.1, 1, 0, 1, 1},
        {"begins, controls", 500, 12, 40, 20, 1, 0, 1, 0.9, 0.2, 1, 0, 0, 1},
        {"begins, pinned", 1000, 10, 10, 12, 1, 0, 1, 0.8, 0.2, 0.7, 0.05, 1, 1},
        {"pinned", 1500, 6, 8, 10, 1, 0, 1, 0.5, 0, 0.5, 0.1, 0.3, 0},
    };
    for (size_t i = 0; i < sizeof families / sizeof families[0]; i++) {
        run(&families[i]);
    }
}

/* From the same multipliers, with the tail first or without; the result -> w. */
static int solve_from(program *p, const double *lower, const double *upper, int tail, double *w) {
    const size_t z = size_z(&p->shape);
    for (size_t i = 0; i < z; i++) {
        p->qp.w[i] = p->qp.fixed[i] ? p->qp.lower[i] : 0;
    }
    memcpy(p->qp.z_lower, lower, sizeof *lower * z);
    memcpy(p->qp.z_upper, upper, sizeof *upper * z);
    p->qp.ahead = tail ? 0 : 1000;
    assert_int_equal(qp_solve(&p->qp, p->stages, &tight, 1), QP_SOLVED);
    double worst[4] = {0};
    assert_true(off(p, worst) <= 1e-8);
    memcpy(w, p->qp.w, sizeof *w * z);
    return p->qp.iterations;
}

/* Long windows whose sets changed at their ends: the last stages by themselves come to them, and
 * the answer is the same as without. */
static void compare_tails(const recipe *r) {
    int n = 0, tails = 0, with = 0, without = 0;
    for (int i = 0; i < r->n_programs; i++) {
        program p;
        seed = (uint64_t)i * 7919u + 29u;
        make(&p, r);
        const size_t z = size_z(&p.shape), end = z - 4 * (size_t)p.shape.ld_z;
        if (p.shape.N >= 20 && qp_solve(&p.qp, p.stages, &tight, 0) == QP_SOLVED) {
            double *lower = take(4 * z, sizeof *lower);
            double *upper = lower + z, *w = upper + z, *other = w + z;
            memcpy(lower, p.qp.z_lower, sizeof *lower * z);
            memcpy(upper, p.qp.z_upper, sizeof *upper * z);
            confuse(&p);
            memcpy(lower + end, p.qp.z_lower + end, sizeof *lower * (z - end));
            memcpy(upper + end, p.qp.z_upper + end, sizeof *upper * (z - end));
            p.qp.tails = 0;
            without += solve_from(&p, lower, upper, 0, other);
            assert_int_equal(p.qp.tails, 0);
            with += solve_from(&p, lower, upper, 1, w);
            tails += p.qp.tails;
            for (size_t j = 0; j < z; j++) {
                assert_true(fabs(w[j] - other[j]) <= 1e-7 * (1 + fabs(other[j])));
            }
            n++;
            free(lower);
        }
        drop(&p);
    }
    print_message("%-16s %5d programs, %d tails, %.2f systems with and %.2f without\n", r->name, n,
                  tails, (double)with / n, (double)without / n);
    assert_true(n > 100 && tails > n / 3);
    assert_true(with < without);
}

static void test_tails(void **state) {
    (void)state;
    static const recipe families[] = {
        {"long", 300, 12, 12, 60, 1, 0, 0.7, 0.2, 0, 0, 0, 1, 1},
        {"long, controls", 300, 4, 20, 60, 0.5, 0, 0.7, 0.3, 0, 0, 0, 0, 1},
    };
    for (size_t i = 0; i < sizeof families / sizeof families[0]; i++) {
        compare_tails(&families[i]);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_families),
                                       cmocka_unit_test(test_tails)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
