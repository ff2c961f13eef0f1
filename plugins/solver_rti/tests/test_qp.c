/* SPDX-License-Identifier: Apache-2.0 */
/* Random staged quadratic programs: the optimality conditions decide, computed here without any
 * code of the solver. They are convex, so a point that satisfies the conditions is a minimum. */
#include "random_programs.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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
                sum += program_entry(p, k, i, j) * w[j];
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
                const double part = program_entry(p, k, j, i) * row_x(s, p->qp.lambda, k)[j];
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
        const double dice = random_uniform(0, 1);
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
        random_begin((uint64_t)i * 7919u + 17u);
        program_make(&p, r);
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
        program_drop(&p);
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
        random_begin((uint64_t)i * 7919u + 29u);
        program_make(&p, r);
        const size_t z = size_z(&p.shape), end = z - 4 * (size_t)p.shape.ld_z;
        if (p.shape.N >= 20 && qp_solve(&p.qp, p.stages, &tight, 0) == QP_SOLVED) {
            double *lower = malloc(sizeof *lower * 4 * z);
            assert_non_null(lower);
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
        program_drop(&p);
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
