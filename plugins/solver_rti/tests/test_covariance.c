/* SPDX-License-Identifier: Apache-2.0 */
/* Covariances against the inverse of the whole optimality system, written down densely here. */
#include "dense_covariance.h"
#include "solver_rig.h"
#include "support.h"

#include <math.h>
#include <string.h>

/* All nodes' blocks of a solved rig against the dense inverse. */
static void check(rig *r, const char *name, int want_gone_x) {
    mhi_dense d;
    assert_true(mhi_dense_make(&r->t->problem, &r->at, &d));
    const double worst = mhi_dense_compare(&d, r->ops, r->solver, &r->error);
    print_message("%s: %d controls and %d later states at bounds; largest difference %.1e\n", name,
                  d.n_gone_u, d.n_gone_x, worst);
    assert_true((d.n_gone_x > 0) == want_gone_x);
    assert_true(worst < (want_gone_x ? 1e-5 : 1e-7)); /* later states are held, not removed */
    mhi_dense_free(&d);
}

static void pendulum_with_bounds(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, 30);
    assert_int_equal(rig_open(&r, &t, "{tolerance: 1e-10, max_iterations: 500}"), MHE_OK);
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    check(&r, "pendulum", 0);
    for (int k = 0; k <= 30; k++) { /* the rate too may meet a bound on the way */
        toy_x_lower(&t, k)[1] = -4.5;
        toy_x_upper(&t, k)[1] = 4.5;
    }
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    check(&r, "pendulum, rate bounded", 1);
    rig_close(&r);
    toy_free(&t);
}

/* The arm's structure: a first state that is free, then fixed; muscles at their bounds. */
static void arm(void **state) {
    (void)state;
    enum { STEPS = 5 };
    static double x[(STEPS + 2) * TOY_ARM_X], target[(STEPS + 1) * TOY_ARM_TARGET];
    toy t;
    rig r;
    toy_arm(&t, STEPS, 0.02);
    for (int i = 0; i < TOY_ARM_X; i++) {
        x[i] = i < 4 ? 0.1 * (i + 1) : i < 8 ? 0.5 : 0.2;
    }
    toy_arm_motion(&t, STEPS + 1, x, target);
    t.target = target;
    assert_int_equal(rig_open(&r, &t, "{tolerance: 1e-6, max_iterations: 500}"), MHE_OK);
    memcpy(r.at.x, x, sizeof(double) * (STEPS + 1) * TOY_ARM_X);
    for (int k = 0; k < STEPS; k++) {
        memcpy(r.at.u + k * TOY_ARM_U, target + k * TOY_ARM_TARGET + 24, sizeof(double) * 19);
    }
    for (int fixed = 0; fixed < 2; fixed++) {
        for (int i = 0; i < TOY_ARM_X && fixed; i++) {
            toy_x_lower(&t, 0)[i] = toy_x_upper(&t, 0)[i] = x[i];
        }
        assert_int_equal(rig_solve(&r, NULL), MHE_OK);
        assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
        check(&r, fixed ? "arm, first state fixed" : "arm, first state free", 0);
    }
    rig_close(&r);
    toy_free(&t);
}

/* Without a solve there is nothing to be uncertain about; a cost that says nothing of a control is
 * said to be so. */
static void singular(void **state) {
    (void)state;
    toy t;
    rig r;
    double xx[4];
    const mhe_covariance out = {.size = sizeof out, .node = 3, .xx = xx};
    toy_pendulum(&t, 10);
    assert_int_equal(rig_open(&r, &t, "{tolerance: 1e-6, max_iterations: 500}"), MHE_OK);
    assert_int_equal(r.ops->covariance(r.solver, &out, &r.error), MHE_E_ARGUMENT);
    for (int i = 0; i < 2; i++) { /* nothing fixes the first state, and nothing measures it */
        toy_x_lower(&t, 0)[i] = -INFINITY;
        toy_x_upper(&t, 0)[i] = INFINITY;
    }
    t.n_r = t.n_r_last = 0;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.ops->covariance(r.solver, &out, &r.error), MHE_E_NUMERIC);
    assert_non_null(strstr(r.error.text, "Hessian is singular"));
    rig_close(&r);
    toy_free(&t);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(pendulum_with_bounds),
                                       cmocka_unit_test(arm), cmocka_unit_test(singular)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
