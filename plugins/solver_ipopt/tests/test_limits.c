/* SPDX-License-Identifier: Apache-2.0 */
/* What solver_ipopt does where a solve cannot go well: bounds, evaluations, options, time. */
#include "solver_rig.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static void test_empty_bounds(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, 5);
    assert_int_equal(rig_open(&r, &t, "{}"), MHE_OK);
    *toy_u_lower(&t, 2) = 9; /* above the upper bound */
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_INFEASIBLE);
    assert_int_equal(r.info.iterations, 0);
    rig_close(&r);
    toy_free(&t);
}

static void test_out_of_reach(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, 5);
    toy_x_lower(&t, 1)[0] = 3; /* upright within one interval */
    assert_int_equal(rig_open(&r, &t, "{max_iterations: 500}"), MHE_OK);
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_INFEASIBLE);
    assert_true(r.info.primal_residual > 0.1);
    rig_close(&r);
    toy_free(&t);
}

static void test_too_many_fixed(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, 2);
    for (int k = 1; k <= 2; k++) {
        toy_x_lower(&t, k)[0] = toy_x_upper(&t, k)[0] = 0.1;
        toy_x_lower(&t, k)[1] = toy_x_upper(&t, k)[1] = 0.1;
    }
    assert_int_equal(rig_open(&r, &t, "{}"), MHE_OK);
    assert_int_equal(rig_solve(&r, NULL), MHE_E_ARGUMENT);
    assert_string_equal(r.error.text, "2 free variables cannot satisfy 4 constraints");
    rig_close(&r);
    toy_free(&t);
}

/* Steps into a region without values are shortened. */
static void test_retry(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, 20);
    assert_int_equal(rig_open(&r, &t, "{max_iterations: 200}"), MHE_OK);
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    double highest = 0, objective = r.info.objective;
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
    assert_true(t.retries > 0);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    assert_true(fabs(r.info.objective - objective) < 1e-3 * objective);
    rig_close(&r);
    toy_free(&t);
}

static void test_no_value_at_start(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, 5);
    assert_int_equal(rig_open(&r, &t, "{}"), MHE_OK);
    r.at.u[3] = 1.5;
    t.retry_above = -1;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_FAILED);
    assert_true(r.at.u[3] == 1.5); /* as it came */
    assert_int_equal(r.at.has_multipliers, 0);
    rig_close(&r);
    toy_free(&t);
}

static void test_nan_objective(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, 20);
    assert_int_equal(rig_open(&r, &t, "{max_iterations: 100}"), MHE_OK);
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
    rig_close(&r);
    toy_free(&t);
}

static void test_nan_start(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, 5);
    assert_int_equal(rig_open(&r, &t, "{}"), MHE_OK);
    r.at.x[4] = NAN;
    assert_int_equal(rig_solve(&r, NULL), MHE_E_ARGUMENT);
    r.at.x[4] = 0;
    r.at.has_multipliers = 1; /* useless ones are not used */
    r.at.lambda[2] = NAN;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    rig_close(&r);
    toy_free(&t);
}

static void test_evaluation_gives_up(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, 5);
    assert_int_equal(rig_open(&r, &t, "{}"), MHE_OK);
    t.failure = MHE_E_NUMERIC;
    t.evaluations = 0;
    assert_int_equal(rig_solve(&r, NULL), MHE_E_NUMERIC);
    assert_string_equal(r.error.text, "the toy was told to fail at node 0");
    assert_int_equal(t.evaluations, 1);
    t.failure = MHE_OK; /* and the next solve is a new chance */
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    rig_close(&r);
    toy_free(&t);
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
    toy_pendulum(&t, 20);
    assert_int_equal(rig_open(&r, &t, "{max_iterations: 3}"), MHE_OK);
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
    assert_int_equal(rig_solve(&r, &control), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_INTERRUPTED);
    assert_int_equal(r.info.iterations, 2);
    assert_int_equal(calls, 3);
    rig_close(&r);
    toy_free(&t);
}

static void refused(const char *yaml, const char *name) {
    toy t;
    rig r;
    toy_pendulum(&t, 5);
    assert_int_equal(rig_open(&r, &t, yaml), MHE_E_CONFIG);
    assert_non_null(strstr(r.error.text, name));
    rig_close(&r);
    toy_free(&t);
}

static void test_options(void **state) {
    (void)state;
    refused("{options: {no_such_option: 1}}", "no_such_option: 1");
    refused("{options: {mu_init: -1}}", "mu_init: -1");
    refused("{options: {mu_oracle: guess}}", "mu_oracle: guess");
    refused("{linear_solver: abacus}", "linear_solver: abacus");

    toy t;
    rig r;
    toy_pendulum(&t, 5); /* the map wins; whole numbers, reals and texts are told apart */
    assert_int_equal(rig_open(&r, &t,
                              "{max_iterations: 40, options: {max_iter: 2, mu_max: 10, "
                              "mu_oracle: loqo, bound_push: 1.5e-2}}"),
                     MHE_OK);
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_ITERATION_LIMIT);
    assert_int_equal(r.info.iterations, 2);
    rig_close(&r);
    toy_free(&t);
}

/* Ipopt knows the name but finds no library of it: told at the first solve, not on the console. */
static void test_missing_linear_solver(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_pendulum(&t, 5);
    assert_int_equal(rig_open(&r, &t, "{linear_solver: ma27}"), MHE_OK);
    mhe_status status = rig_solve(&r, NULL);
    if (status != MHE_OK) { /* else HSL is installed here */
        assert_int_equal(status, MHE_E_NUMERIC);
        assert_non_null(strstr(r.error.text, "linear solver 'ma27'"));
    }
    rig_close(&r);
    toy_free(&t);
}

/* Nothing on the console, not for a refused option either, and no ipopt.opt from the working
 * directory, whose "max_iter 0" would show. */
static void test_silent(void **state) {
    (void)state;
    char folder[] = "/tmp/mhe_test_XXXXXX", text[16];
    assert_non_null(mkdtemp(folder));
    assert_int_equal(chdir(folder), 0);
    FILE *file = fopen("ipopt.opt", "w");
    assert_non_null(file);
    fputs("max_iter 0\nprint_level 5\n", file);
    fclose(file);

    fflush(stdout);
    int console = dup(STDOUT_FILENO);
    FILE *captured = tmpfile();
    dup2(fileno(captured), STDOUT_FILENO);
    toy t;
    rig r, refused_rig;
    toy_pendulum(&t, 5);
    mhe_status bad = rig_open(&refused_rig, &t, "{options: {no_such_option: 1}}");
    mhe_status created = rig_open(&r, &t, "{}");
    mhe_status solved = rig_solve(&r, NULL);
    fflush(stdout);
    dup2(console, STDOUT_FILENO);
    close(console);
    assert_int_equal(bad, MHE_E_CONFIG);
    assert_int_equal(created, MHE_OK);
    assert_int_equal(solved, MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    rewind(captured);
    assert_null(fgets(text, sizeof text, captured));
    fclose(captured);
    unlink("ipopt.opt");
    assert_int_equal(chdir("/"), 0);
    rmdir(folder);
    rig_close(&r);
    rig_close(&refused_rig);
    toy_free(&t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_empty_bounds),
        cmocka_unit_test(test_out_of_reach),
        cmocka_unit_test(test_too_many_fixed),
        cmocka_unit_test(test_retry),
        cmocka_unit_test(test_no_value_at_start),
        cmocka_unit_test(test_nan_objective),
        cmocka_unit_test(test_nan_start),
        cmocka_unit_test(test_evaluation_gives_up),
        cmocka_unit_test(test_stops),
        cmocka_unit_test(test_options),
        cmocka_unit_test(test_missing_linear_solver),
        cmocka_unit_test(test_silent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
