/* SPDX-License-Identifier: Apache-2.0 */
/* What solver_ipopt does with options and linear solvers that are not there, and that it is silent.
 */
#include "solver_rig.h"
#include "support.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

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
        cmocka_unit_test(test_options),
        cmocka_unit_test(test_missing_linear_solver),
        cmocka_unit_test(test_silent),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
