/* SPDX-License-Identifier: Apache-2.0 */
/* Where full steps of `robust` would go to and fro: across a bent valley, and across a kink. */
#include "solver_rig.h"
#include "support.h"

#include <math.h>

/* x_1 = u^2 / 2, which is to be t < 0, and u to be 0: the optimum is u = 0. Gauss-Newton does not
 * see that the cost bends upward with -t there, and a step leaves t times what it found. */
static void bent_rate(const toy *t, const double *x, const double *u, double *f, double *fx,
                      double *fu) {
    (void)t, (void)x, (void)fx;
    f[0] = 0.5 * u[0] * u[0];
    fu[0] = u[0];
}

/* target: of x at the next node, of u. */
static void residual(const toy *t, int k, const double *x, const double *u, double *r, double *w,
                     double *rx, double *ru) {
    r[0] = k > 0 ? x[0] - t->target[2 * (k - 1)] : 0;
    rx[0] = k > 0;
    w[0] = 1;
    if (u != NULL) {
        r[1] = u[0] - t->target[2 * k + 1];
        ru[1] = 1;
        w[1] = 1;
    }
}

static void open(rig *r, toy *t, int n, toy_rate rate, const double *target, const char *yaml) {
    toy_init(t, n, 1, 1, 1, 1, rate, residual, 2, 1);
    toy_x_lower(t, 0)[0] = toy_x_upper(t, 0)[0] = 0;
    t->target = target;
    assert_int_equal(rig_open(r, t, yaml), MHE_OK);
    rig_reset(r);
}

static void test_to_and_fro(void **state) {
    (void)state;
    static const double factors[] = {-0.5, -0.95, -1, -3, -8};
    for (size_t i = 0; i < sizeof factors / sizeof factors[0]; i++) {
        const double target[] = {factors[i], 0};
        toy t;
        rig r;
        open(&r, &t, 1, bent_rate, target, "{preset: robust, tolerance: 1e-6, objective_scale: 1}");
        r.at.u[0] = 0.3;
        r.at.x[1] = 0.045;
        assert_int_equal(rig_solve(&r, NULL), MHE_OK);
        print_message("factor %g: %d iterations, u = %.1e\n", factors[i], (int)r.info.iterations,
                      r.at.u[0]);
        assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
        assert_true(r.info.iterations <= 12);
        assert_true(fabs(r.at.u[0]) < 1e-6);
        rig_close_both(&r, &t);
    }
}

/* A muscle that gives half as much when it shortens. */
#define BEND 0.1
static void kinked_rate(const toy *t, const double *x, const double *u, double *f, double *fx,
                        double *fu) {
    const double slope = u[0] > 0 ? 2 : 1;
    (void)t, (void)x, (void)fx;
    f[0] = slope * u[0] + BEND * u[0] * u[0];
    fu[0] = slope + 2 * BEND * u[0];
}

/* u_1 of the optimum on the kink, u_0 = 0. */
static double other_control(const double *target) {
    double low = 0, high = 2;
    for (int i = 0; i < 100; i++) {
        const double u = 0.5 * (low + high), x = 2 * u + BEND * u * u;
        const double slope = (2 + 2 * BEND * u) * (x - target[2]) + u - target[3];
        *(slope > 0 ? &high : &low) = u;
    }
    return low;
}

/* The solution may lie on the kink: both sides point to it, and the motion along it must be the
 * best, from any start and to any tolerance. */
static void test_rest_on_a_kink(void **state) {
    (void)state;
    static const double target[] = {-0.8, 1.5, 1, 1};
    static const double starts[][2] = {{0.7, 0}, {-0.4, 2}, {1e-9, 0.6}, {-3, -3}};
    static const char *const yaml[] = {"{preset: robust, tolerance: 1e-4, objective_scale: 1}",
                                       "{preset: robust, tolerance: 1e-8, objective_scale: 1}"};
    const double other = other_control(target), within[] = {1e-4, 1e-8};
    for (int i = 0; i < 8; i++) {
        const double *start = starts[i / 2];
        toy t;
        rig r;
        open(&r, &t, 2, kinked_rate, target, yaml[i % 2]);
        r.at.u[0] = start[0];
        r.at.u[1] = start[1];
        assert_int_equal(rig_solve(&r, NULL), MHE_OK);
        print_message("%d iterations, %d programs, u_0 = %.1e, u_1 off by %.1e\n",
                      (int)r.info.iterations, (int)r.info.programs, r.at.u[0],
                      fabs(r.at.u[1] - other));
        assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
        assert_true(fabs(r.at.u[0]) <= 0.01 * within[i % 2]); /* as near as both sides */
        assert_true(fabs(r.at.u[1] - other) < within[i % 2]);
        assert_true(r.info.primal_residual < 0.1 * within[i % 2]);
        rig_close_both(&r, &t);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_to_and_fro),
                                       cmocka_unit_test(test_rest_on_a_kink)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
