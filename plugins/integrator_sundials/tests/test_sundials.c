/* SPDX-License-Identifier: Apache-2.0 */
/* mhe.integrator.sundials on closed-form systems: derivatives, tolerances, failures. */
#include "systems.h"

#include <math.h>
#include <string.h>

#define SUNDIALS "mhe.integrator.sundials"

/* The sensitivities are CVODES' own solution, not the derivative of its steps: they agree with
 * differences as far as the tolerances go. */
static void derivatives(void **state) {
    (void)state;
    static const char *const configs[] = {"{rtol: 1e-10, atol: 1e-12}",
                                          "{rtol: 1e-10, atol: 1e-12, method: adams}"};
    test_derivatives_of_steps(SUNDIALS, configs, 2, 5, 0.03, 0.03, 1e-6);
}

/* adot = (e - a) / tau has a closed solution. */
static void tolerance_holds(void **state) {
    (void)state;
    const double tau[SYSTEM_M] = {0.009, 0.018, 0.05};
    mhe_system system;
    test_linear_system(SYSTEM_EXCITATION, &system);
    struct test_integrator flow =
        test_integrator_open(SUNDIALS, "{rtol: 1e-10, atol: 1e-12}", &system, NULL);
    double x[SYSTEM_X] = {0, 0, 0, 0, 0.1, 0.9, 0.5}, u[SYSTEM_M] = {1, 0, 0.2}, next[SYSTEM_X];
    double A[SYSTEM_X * SYSTEM_X], B[SYSTEM_X * SYSTEM_U];
    test_integrate(&flow, x, u, 0.06, next, A, B);
    for (int i = 0; i < SYSTEM_M; i++) {
        double decay = exp(-0.06 / tau[i]);
        assert_true(fabs(next[4 + i] - (u[i] + (x[4 + i] - u[i]) * decay)) < 1e-9);
        assert_true(fabs(A[(4 + i) * 7 + 4 + i] - decay) < 1e-9);
        assert_true(fabs(B[(4 + i) * 3 + i] - (1 - decay)) < 1e-9);
    }
    test_integrator_close(&flow);
}

static void same_bits_twice(void **state) {
    (void)state;
    uint64_t seed = 22;
    mhe_system system;
    test_pendulum_system(SYSTEM_EXCITATION, &system);
    struct test_integrator flow = test_integrator_open(SUNDIALS, "", &system, NULL);
    double x[SYSTEM_X], u[SYSTEM_U], other[SYSTEM_X], next[2][SYSTEM_X];
    double A[SYSTEM_X * SYSTEM_X], B[SYSTEM_X * SYSTEM_U];
    test_pendulum_state(&seed, &system, x, u);
    test_pendulum_state(&seed, &system, other, u);
    test_integrate(&flow, x, u, 0.03, next[0], A, B);
    test_integrate(&flow, other, u, 0.05, next[1], NULL, NULL);
    test_integrate(&flow, x, u, 0.03, next[1], A, B);
    assert_memory_equal(next[0], next[1], sizeof next[0]);
    test_integrator_close(&flow);
}

static void failures(void **state) {
    (void)state;
    mhe_system system;
    double x[SYSTEM_X] = {0, 0, 0, 0, 0.5, 0.5, 0.5}, u[SYSTEM_M] = {0, 0, 0}, next[SYSTEM_X];
    mhe_error err = {0};
    test_integrator_meets_bad_points(SUNDIALS);
    test_pendulum_system(SYSTEM_EXCITATION, &system);
    struct test_integrator flow = test_integrator_open(SUNDIALS, "max_steps: 3", &system, NULL);
    assert_int_equal(flow.ops->step(flow.context, x, u, NULL, 0.03, NULL, next, NULL, &err),
                     MHE_RETRY);
    assert_non_null(strstr(err.text, "CVODES"));
    test_integrator_close(&flow);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives), cmocka_unit_test(tolerance_holds),
        cmocka_unit_test(same_bits_twice), cmocka_unit_test(failures)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
