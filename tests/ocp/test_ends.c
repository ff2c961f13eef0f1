/* SPDX-License-Identifier: Apache-2.0 */
/* How a solve ends where it cannot go well, whichever solver (RIG_SOLVER): bounds, evaluations,
 * limits. */
#include "solver_rig.h"
#include "support.h"

#include <math.h>
#include <string.h>

static void test_bounds_that_contradict(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 5, "{}");
    *toy_u_lower(&t, 2) = 9; /* above the upper bound */
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_INFEASIBLE);
    assert_int_equal(r.info.iterations, 0);
    rig_close_both(&r, &t);
}

static void test_out_of_reach(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 5, "{max_iterations: 500}");
    toy_x_lower(&t, 1)[0] = 3; /* upright within one interval */
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_INFEASIBLE);
    assert_true(r.info.primal_residual > 0.1);
    rig_close_both(&r, &t);
}

static void test_too_many_fixed(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 2, "{}");
    for (int k = 1; k <= 2; k++) {
        toy_x_lower(&t, k)[0] = toy_x_upper(&t, k)[0] = 0.1;
        toy_x_lower(&t, k)[1] = toy_x_upper(&t, k)[1] = 0.1;
    }
    assert_int_equal(rig_solve(&r, NULL), MHE_E_ARGUMENT);
    assert_string_equal(r.error.text, "2 free variables cannot satisfy 4 constraints");
    rig_close_both(&r, &t);
}

/* With the controls and all states given no equation takes a variable away: the dynamics hold there
 * or they do not. */
static void test_all_given(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 3, "{}");
    for (int k = 0; k < 3; k++) {
        *toy_u_lower(&t, k) = *toy_u_upper(&t, k) = 0.5 - 0.3 * k;
    }
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    for (int k = 1; k <= 3; k++) {
        for (int i = 0; i < 2; i++) {
            toy_x_lower(&t, k)[i] = toy_x_upper(&t, k)[i] = r.at.x[2 * k + i];
        }
    }
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    toy_x_lower(&t, 2)[0] = toy_x_upper(&t, 2)[0] = r.at.x[4] + 0.1;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_INFEASIBLE);
    assert_true(r.info.primal_residual > 0.05);
    rig_close_both(&r, &t);
}

/* Steps into a region without values are shortened. */
static void test_retry(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 20, "{max_iterations: 200}");
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    double highest = 0;
    const double objective = r.info.objective;
    for (int k = 0; k <= 20; k++) {
        highest = fmax(highest, r.at.x[2 * k]);
    }
    t.retry_above = highest + 0.01; /* the iterates before stray further */
    rig_reset(&r);
    for (int k = 1; k <= 20; k++) {
        r.at.x[2 * k] = highest;
        r.at.x[2 * k + 1] = 20;
    }
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    assert_true(fabs(r.info.objective - objective) < 1e-3 * objective);
    rig_close_both(&r, &t);
}

static void test_no_value_at_start(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 5, "{}");
    r.at.u[3] = 1.5;
    t.retry_above = -1;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_FAILED);
    assert_true(r.at.u[3] == 1.5); /* as it came */
    assert_int_equal(r.at.has_multipliers, 0);
    rig_close_both(&r, &t);
}

static void test_nan_objective(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 20, "{max_iterations: 100}");
    t.nan_above = 1; /* the optimum lies beyond */
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_not_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    assert_true(isfinite(r.info.objective));
    for (int i = 0; i < 2 * 21; i++) {
        assert_true(isfinite(r.at.x[i]));
    }
    t.nan_above = -1; /* nowhere a value */
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_FAILED);
    rig_close_both(&r, &t);
}

static void test_nan_start(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 5, "{}");
    r.at.x[4] = NAN;
    assert_int_equal(rig_solve(&r, NULL), MHE_E_ARGUMENT);
    r.at.x[4] = 0;
    r.at.has_multipliers = 1; /* useless ones are not used */
    r.at.lambda[2] = NAN;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    rig_close_both(&r, &t);
}

static void test_evaluation_gives_up(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 5, "{}");
    t.failure = MHE_E_NUMERIC;
    t.evaluations = 0;
    assert_int_equal(rig_solve(&r, NULL), MHE_E_NUMERIC);
    assert_string_equal(r.error.text, "the toy was told to fail at node 0");
    assert_int_equal(t.evaluations, 1);
    t.failure = MHE_OK; /* and the next solve is a new chance */
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    rig_close_both(&r, &t);
}

static int32_t stop_at_two(void *data, int32_t iteration, double objective, double kkt_residual) {
    int *calls = data;
    assert_true(isfinite(objective) && kkt_residual >= 0);
    (*calls)++;
    return iteration == 2;
}

static void test_stops(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 20, "{max_iterations: 3}");
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_ITERATION_LIMIT);
    assert_int_equal(r.info.iterations, 3);

    rig_reset(&r);
    mhe_solve_control control = {.size = sizeof control, .deadline = 1e-3}; /* long ago */
    assert_int_equal(rig_solve(&r, &control), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_DEADLINE);
    assert_int_equal(r.info.iterations, 0);
    assert_true(isfinite(r.at.x[5]));

    int calls = 0;
    control = (mhe_solve_control){.size = sizeof control, .data = &calls, .progress = stop_at_two};
    rig_reset(&r);
    assert_int_equal(rig_solve(&r, &control), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_INTERRUPTED);
    assert_int_equal(r.info.iterations, 2);
    assert_int_equal(calls, 3);
    rig_close_both(&r, &t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bounds_that_contradict),
        cmocka_unit_test(test_out_of_reach),
        cmocka_unit_test(test_too_many_fixed),
        cmocka_unit_test(test_all_given),
        cmocka_unit_test(test_retry),
        cmocka_unit_test(test_no_value_at_start),
        cmocka_unit_test(test_nan_objective),
        cmocka_unit_test(test_nan_start),
        cmocka_unit_test(test_evaluation_gives_up),
        cmocka_unit_test(test_stops),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
