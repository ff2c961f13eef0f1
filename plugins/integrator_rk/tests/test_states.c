/* SPDX-License-Identifier: Apache-2.0 */
/* mhe.integrator.rk on muscles with states of their own: any number a muscle, activations among
 * them or not. */
#include "stateful.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RK "mhe.integrator.rk"
#define CVODES "mhe.integrator.sundials"
#define EXACT "{rtol: 1e-11, atol: 1e-12}"
#define N STATEFUL_X

/* Excitation-driven, activation-driven, activations among the states; with residual torques. */
static const int32_t kinds[] = {SYSTEM_EXCITATION, SYSTEM_EXCITATION | SYSTEM_RESIDUALS,
                                SYSTEM_RESIDUALS, STATEFUL_INSIDE,
                                STATEFUL_INSIDE | SYSTEM_RESIDUALS};
#define N_KINDS ((int)(sizeof kinds / sizeof kinds[0]))

static void derivatives(void **state) {
    (void)state;
    uint64_t seed = 41;
    double worst = 0;
    static const char *const yaml[] = {"", "{stages: 1, max_step: 0.01}",
                                       "{stages: 2, max_step: 0.01}", "{stages: 3, max_step: 0.03}",
                                       "{scheme: radau, stages: 5}"};
    for (int kind = 0; kind < N_KINDS; kind++) {
        for (size_t i = 0; i < sizeof yaml / sizeof yaml[0]; i++) {
            mhe_system system;
            test_stateful_system(kinds[kind], &system);
            struct test_integrator rk = test_integrator_open(RK, yaml[i], &system, NULL);
            for (int trial = 0; trial < 5; trial++) {
                double x[N], u[SYSTEM_U];
                test_stateful_state(&system, &seed, x, u);
                double error = test_step_derivatives(&rk, x, u, 0.03);
                assert_true(error >= 0);
                worst = fmax(worst, error);
            }
            test_integrator_close(&rk);
        }
    }
    print_message("A, B against differences: %.1e\n", worst);
    assert_true(worst < 1e-6);
}

/* Error over 30 ms against CVODES, the worst of random states. */
static double error_of(const char *yaml, int32_t kind) {
    uint64_t seed = 42;
    double worst = 0;
    mhe_system system;
    test_stateful_system(kind, &system);
    struct test_integrator rk = test_integrator_open(RK, yaml, &system, NULL);
    struct test_integrator flow = test_integrator_open(CVODES, EXACT, &system, NULL);
    if (flow.ops == NULL) {
        skip();
    }
    for (int trial = 0; trial < 10; trial++) {
        double x[N], u[SYSTEM_U], next[N], exact[N];
        test_stateful_state(&system, &seed, x, u);
        test_integrate(&rk, x, u, 0.03, next, NULL, NULL);
        test_integrate(&flow, x, u, 0.03, exact, NULL, NULL);
        worst = fmax(worst, test_relative(next, exact, system.n_x));
    }
    test_integrator_close(&rk);
    test_integrator_close(&flow);
    return worst;
}

/* The defaults, and what a longer step costs: a start off the slow motion is lost within one. */
static void against_cvodes(void **state) {
    (void)state;
    for (int kind = 0; kind < N_KINDS; kind++) {
        double usual = error_of("", kinds[kind]), live = error_of("max_step: 0.01", kinds[kind]);
        print_message("kind %d: %.1e, steps of 10 ms: %.1e\n", kind, usual, live);
        assert_true(usual < 5e-5);
        assert_true(live < 2e-3);
    }
}

/* Radau's order on a system that is not stiff: 2 s - 1. */
static void order(void **state) {
    (void)state;
    uint64_t seed = 43;
    mhe_system system;
    test_pendulum_system(0, &system);
    for (int stages = 1; stages <= 4; stages++) {
        double error[2] = {0, 0};
        struct test_integrator flow = test_integrator_open(CVODES, EXACT, &system, NULL);
        if (flow.ops == NULL) {
            skip();
        }
        for (int k = 0; k < 2; k++) {
            char yaml[80];
            (void)snprintf(yaml, sizeof yaml, "{scheme: radau, stages: %d, max_step: %g}", stages,
                           0.03 / (1 << k));
            struct test_integrator rk = test_integrator_open(RK, yaml, &system, NULL);
            uint64_t same = seed;
            for (int trial = 0; trial < 10; trial++) {
                double x[N], u[SYSTEM_U], next[N], exact[N];
                test_stateful_state(&system, &same, x, u);
                test_integrate(&rk, x, u, 0.06, next, NULL, NULL);
                test_integrate(&flow, x, u, 0.06, exact, NULL, NULL);
                error[k] = fmax(error[k], test_relative(next, exact, system.n_x));
            }
            test_integrator_close(&rk);
        }
        test_integrator_close(&flow);
        print_message("%d stages: %.1e, half the step: %.1e\n", stages, error[0], error[1]);
        assert_true(log2(error[0] / error[1]) > 2 * stages - 1.5 || error[1] < 1e-9);
    }
}

/* A memory changes the price, not the result. */
static void memory(void **state) {
    (void)state;
    uint64_t seed = 44;
    double worst = 0, worst_derivative = 0;
    for (int kind = 0; kind < N_KINDS; kind++) {
        mhe_system system;
        test_stateful_system(kinds[kind], &system);
        struct test_integrator rk = test_integrator_open(RK, "max_step: 0.01", &system, NULL);
        double *kept = calloc((size_t)rk.ops->memory_size(rk.self), sizeof *kept);
        double x[N], u[SYSTEM_U];
        assert_non_null(kept);
        test_stateful_state(&system, &seed, x, u);
        for (int trial = 0; trial < 100; trial++) {
            double next[2][N], A[2][N * N], B[2][N * SYSTEM_U];
            double move = pow(10, test_random(&seed, -9, -0.5)), dt = trial % 17 < 14 ? 0.03 : 0.02;
            int linear = trial % 3 > 0;
            for (int32_t i = 0; i < system.n_x; i++) {
                x[i] += move * test_random(&seed, -1, 1) * (i < 4 ? 1 : 0.2);
                x[i] = i < 4 ? x[i] : fmin(1, fmax(0.05, x[i]));
            }
            for (int32_t i = 0; i < system.n_u; i++) {
                u[i] = fmin(1, fmax(0, u[i] + move * test_random(&seed, -1, 1)));
            }
            for (int i = 0; i < 2; i++) {
                const mhe_step_derivatives out = {.size = sizeof out, .A = A[i], .B = B[i]};
                assert_int_equal(rk.ops->step(rk.context, x, u, NULL, dt, i == 0 ? NULL : kept,
                                              next[i], linear ? &out : NULL, NULL),
                                 MHE_OK);
            }
            worst = fmax(worst, test_relative(next[1], next[0], system.n_x));
            for (int i = 0; i < 1 && linear; i++) {
                worst_derivative =
                    fmax(worst_derivative, test_relative(A[1], A[0], system.n_x * system.n_x));
                worst_derivative =
                    fmax(worst_derivative, test_relative(B[1], B[0], system.n_x * system.n_u));
            }
        }
        free(kept);
        test_integrator_close(&rk);
    }
    print_message("with a memory and without: %.1e, A and B %.1e\n", worst, worst_derivative);
    assert_true(worst < 1e-8);
    assert_true(worst_derivative < 1e-4);
}

/* Schemes that remember a wrong start are refused, before anything is made. */
static void refused(void **state) {
    (void)state;
    const mhe_plugin *plugin = test_plugin(RK, MHE_INTEGRATOR_IFACE);
    const mhe_integrator_ops *ops = plugin->ops;
    mhe_system system, plain;
    mhe_error err = {0};
    test_stateful_system(SYSTEM_EXCITATION, &system);
    test_pendulum_system(SYSTEM_EXCITATION, &plain);
    const char *const bad[] = {"scheme: gauss", "scheme: rk4"};
    for (int i = 0; i < 2; i++) {
        assert_int_equal(ops->accepts(&system, test_config(plugin, bad[i]), &err),
                         MHE_E_UNSUPPORTED);
        assert_non_null(strstr(err.text, "radau"));
        assert_int_equal(ops->accepts(&plain, test_config(plugin, bad[i]), &err), MHE_OK);
    }
    assert_int_equal(ops->accepts(&system, test_config(plugin, ""), &err), MHE_OK);
}

/* A state out of the domain or not finite is answered by "another point", and it goes on. */
static void bad_points(void **state) {
    (void)state;
    uint64_t seed = 45;
    mhe_system system;
    test_stateful_system(SYSTEM_EXCITATION, &system);
    struct test_integrator rk = test_integrator_open(RK, "", &system, NULL);
    double x[N], u[SYSTEM_U], next[N];
    mhe_error err = {0};
    test_stateful_state(&system, &seed, x, u);
    for (int32_t i = 0; i < system.n_x; i++) {
        double y[N];
        memcpy(y, x, sizeof y);
        y[i] = NAN;
        assert_true(rk.ops->step(rk.context, y, u, NULL, 0.03, NULL, next, NULL, &err) != MHE_OK);
    }
    double far[N];
    memcpy(far, x, sizeof far);
    far[0] = 11;
    assert_int_equal(rk.ops->step(rk.context, far, u, NULL, 0.03, NULL, next, NULL, &err),
                     MHE_RETRY);
    test_integrate(&rk, x, u, 0.03, next, NULL, NULL);
    test_integrator_close(&rk);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives), cmocka_unit_test(against_cvodes),
        cmocka_unit_test(order),       cmocka_unit_test(memory),
        cmocka_unit_test(refused),     cmocka_unit_test(bad_points)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
