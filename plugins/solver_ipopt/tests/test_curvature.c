/* SPDX-License-Identifier: Apache-2.0 */
/* adapt_curvature: where the dynamics are so curved that Gauss-Newton steps overshoot or creep. */
#include "solver_rig.h"
#include "support.h"

#include <math.h>

/* x_1 = u + c u^2 / 2 from x_0 = 0: all curvature is in the dynamics. */
static double curve, effort; /* c, rho */

static void curved_rate(const toy *t, const double *x, const double *u, double *f, double *fx,
                        double *fu) {
    (void)t, (void)x, (void)fx;
    f[0] = u[0] + 0.5 * curve * u[0] * u[0];
    fu[0] = 1 + curve * u[0];
}

/* 1/2 (rho u^2 + (x_1 - target)^2) */
static void curved_residual(const toy *t, int k, const double *x, const double *u, double *r,
                            double *w, double *rx, double *ru) {
    (void)k;
    if (u != NULL) {
        r[0] = u[0];
        w[0] = effort;
        ru[0] = 1;
    } else {
        r[0] = x[0] - *t->target;
        w[0] = 1;
        rx[0] = 1;
    }
}

static int iterations(double target, const char *yaml, double *u) {
    toy t;
    rig r;
    toy_init(&t, 1, 1, 1, 1.0, 1, curved_rate, curved_residual, 1, 1);
    toy_x_lower(&t, 0)[0] = toy_x_upper(&t, 0)[0] = 0;
    t.target = &target;
    assert_int_equal(rig_open(&r, &t, yaml), MHE_OK);
    r.at.u[0] = *u;
    r.at.x[1] = *u + 0.5 * curve * *u * *u;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    const int n = r.info.outcome == MHE_SOLVE_CONVERGED ? r.info.iterations : 1000;
    *u = r.at.u[0];
    if (n < 1000) {
        const rig_kkt kkt = rig_check(&r);
        /* the tolerance is relative to the control's curvature, here 1 to 500 */
        assert_true(kkt.stationarity < 1e-8 * (1 + effort) && kkt.primal < 1e-8);
    }
    rig_close(&r);
    toy_free(&t);
    return n;
}

static void compare(double target, double start) {
    double u = start, with_u = start;
    const int plain = iterations(target, "{tolerance: 1e-9, max_iterations: 200}", &u);
    const int adapted = iterations(
        target, "{tolerance: 1e-9, max_iterations: 200, adapt_curvature: true}", &with_u);
    print_message("target %g: %d iterations, adapted %d, u %.6f\n", target, plain, adapted, with_u);
    assert_true(adapted < 40);
    assert_true(adapted < plain);
}

static void test_overshoot(void **state) {
    (void)state;
    curve = 2; /* true curvature about 4 times Gauss-Newton's */
    effort = 0.38;
    compare(-1, -0.3);
}

static void test_creep(void **state) {
    (void)state;
    curve = 1; /* true curvature about a quarter of Gauss-Newton's: u = 4 */
    effort = 500;
    compare(412, 3);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_overshoot),
                                       cmocka_unit_test(test_creep)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
