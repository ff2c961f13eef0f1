/* SPDX-License-Identifier: Apache-2.0 */
/* mhe.integrator.rk on closed-form systems: derivatives, order, linear systems, energy, CVODES. */
#include "systems.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RK "mhe.integrator.rk"
#define FINE "{stages: 4, max_step: 0.015, activation_step: 1.7, tolerance: 5e-6}"

static const char *const schemes[] = {"stages: 1",
                                      "stages: 2",
                                      "stages: 3",
                                      "stages: 4",
                                      "{scheme: rk4, max_step: 0.008}",
                                      "{stages: 2, max_step: 0.007}"};
#define N_SCHEMES (sizeof schemes / sizeof schemes[0])

static void derivatives(void **state) {
    (void)state;
    test_derivatives_of_steps(RK, schemes, N_SCHEMES, 10, 0.01, 0.05, 1e-6);
}

/* The step with derivatives ends where the step without them does. */
static void same_step_with_derivatives(void **state) {
    (void)state;
    uint64_t seed = 6;
    mhe_system system;
    test_pendulum_system(SYSTEM_EXCITATION, &system);
    struct test_integrator rk = test_integrator_open(RK, FINE, &system, NULL);
    double worst = 0;
    for (int trial = 0; trial < 50; trial++) {
        double x[SYSTEM_X], u[SYSTEM_U], plain[SYSTEM_X], full[SYSTEM_X];
        double A[SYSTEM_X * SYSTEM_X], B[SYSTEM_X * SYSTEM_U];
        test_pendulum_state(&seed, &system, x, u);
        test_integrate(&rk, x, u, 0.03, plain, NULL, NULL);
        test_integrate(&rk, x, u, 0.03, full, A, B);
        worst = fmax(worst, test_relative(plain, full, system.n_x));
    }
    print_message("with and without derivatives: %.1e\n", worst);
    assert_true(worst < 1e-9);
    test_integrator_close(&rk);
}

/* A memory changes the price, not the result: along a line of starts, in steps of all sizes, with
 * values and derivatives asked for in turn. With a tolerance it may tip the scales of a step that
 * is close to it. */
static void memory_of(const char *yaml, double most) {
    uint64_t seed = 12;
    double worst = 0, worst_derivative = 0;
    for (int32_t flags = 0; flags < SYSTEM_N_FLAGS; flags++) {
        mhe_system system;
        test_pendulum_system(flags, &system);
        struct test_integrator rk = test_integrator_open(RK, yaml, &system, NULL);
        double *kept = calloc((size_t)rk.ops->memory_size(rk.self), sizeof *kept);
        double x[SYSTEM_X], u[SYSTEM_U];
        assert_non_null(kept);
        test_pendulum_state(&seed, &system, x, u);
        for (int trial = 0; trial < 200; trial++) {
            double next[2][SYSTEM_X], A[2][SYSTEM_X * SYSTEM_X], B[2][SYSTEM_X * SYSTEM_U];
            double move = pow(10, test_random(&seed, -9, -0.5)), dt = trial % 17 < 14 ? 0.03 : 0.02;
            int linear = trial % 3 > 0;
            for (int32_t i = 0; i < system.n_x; i++) {
                x[i] += move * test_random(&seed, -1, 1) * (i < 4 ? 1 : 0.2 * x[i]);
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
            if (linear) {
                worst_derivative =
                    fmax(worst_derivative, test_relative(A[1], A[0], system.n_x * system.n_x));
                worst_derivative =
                    fmax(worst_derivative, test_relative(B[1], B[0], system.n_x * system.n_u));
            }
        }
        free(kept);
        test_integrator_close(&rk);
    }
    print_message("%s, with and without a memory: values %.1e, A and B %.1e\n", yaml, worst,
                  worst_derivative);
    assert_true(worst < most);
    assert_true(worst_derivative < 1e-5); /* stages off by at most RK_LAST */
}

static void memory(void **state) {
    (void)state;
    memory_of("stages: 3", 1e-9); /* newton_tolerance and what follows from it */
    memory_of("{stages: 3, tolerance: 1e-6}", 1e-6);
}

/* Mean error of (q, v) after 80 ms over some random states. */
static double mean_error(const mhe_system *system, const char *scheme, double max_step) {
    char yaml[96];
    (void)snprintf(yaml, sizeof yaml, "{%s, max_step: %g, newton_tolerance: 1e-13, tolerance: 0}",
                   scheme, max_step);
    struct test_integrator rk = test_integrator_open(RK, yaml, system, NULL);
    struct test_integrator fine =
        test_integrator_open(RK, "{stages: 6, max_step: 0.004}", system, NULL);
    uint64_t seed = 8;
    double sum = 0;
    for (int trial = 0; trial < 10; trial++) {
        double x[SYSTEM_X], u[SYSTEM_U], next[SYSTEM_X], exact[SYSTEM_X];
        test_pendulum_state(&seed, system, x, u);
        test_integrate(&rk, x, u, 0.08, next, NULL, NULL);
        test_integrate(&fine, x, u, 0.08, exact, NULL, NULL);
        sum += test_relative(next, exact, 4);
    }
    test_integrator_close(&rk);
    test_integrator_close(&fine);
    return sum / 10;
}

/* Halving the step divides the error by 2^order, until it is rounding. With constant activations:
 * their transients are over in a step of this length. */
static void order(void **state) {
    (void)state;
    const struct {
        const char *scheme;
        double step;
        int order;
    } cases[] = {{"stages: 1", 0.02, 2}, {"stages: 2", 0.02, 4},  {"stages: 3", 0.02, 6},
                 {"stages: 4", 0.02, 8}, {"stages: 5", 0.04, 10}, {"scheme: rk4", 0.01, 4}};
    mhe_system system;
    test_pendulum_system(SYSTEM_RESIDUALS, &system);
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        double whole = mean_error(&system, cases[k].scheme, cases[k].step);
        double half = mean_error(&system, cases[k].scheme, cases[k].step / 2);
        double seen = log2(whole / half);
        print_message("%s: errors %.1e %.1e, order %.2f\n", cases[k].scheme, whole, half, seen);
        assert_true(fabs(seen - cases[k].order) < 0.5);
    }
}

/* out [n x n] = exp(a): Taylor series of a / 2^8, squared 8 times. */
static void exponential(const double *a, int n, double *out) {
    double term[144], sum[144], product[144];
    assert_true(n * n <= 144);
    for (int i = 0; i < n * n; i++) {
        term[i] = sum[i] = i % (n + 1) == 0;
    }
    for (int k = 1; k < 8; k++) {
        memset(product, 0, sizeof product);
        for (int i = 0; i < n; i++) {
            for (int j = 0; j < n; j++) {
                for (int m = 0; m < n; m++) {
                    product[i * n + j] += term[i * n + m] * a[m * n + j] * 0x1p-8 / k;
                }
            }
        }
        memcpy(term, product, sizeof term);
        for (int i = 0; i < n * n; i++) {
            sum[i] += term[i];
        }
    }
    for (int squaring = 0; squaring < 8; squaring++) {
        memset(product, 0, sizeof product);
        for (int i = 0; i < n; i++) {
            for (int j = 0; j < n; j++) {
                for (int m = 0; m < n; m++) {
                    product[i * n + j] += sum[i * n + m] * sum[m * n + j];
                }
            }
        }
        memcpy(sum, product, sizeof sum);
    }
    memcpy(out, sum, sizeof(double) * (size_t)(n * n));
}

/* A and B are blocks of the exponential of [[J, J_u], [0, 0]] dt. */
static void linear_system(void **state) {
    (void)state;
    uint64_t seed = 9;
    for (int32_t flags = 0; flags < SYSTEM_N_FLAGS; flags++) {
        mhe_system system;
        test_linear_system(flags, &system);
        int32_t n_x = system.n_x, n_u = system.n_u, n = n_x + n_u;
        double rate[144] = {0}, flow[144], x[SYSTEM_X], u[SYSTEM_U], next[SYSTEM_X];
        double A[SYSTEM_X * SYSTEM_X], B[SYSTEM_X * SYSTEM_U], worst = 0;
        const double dt = 0.03;
        test_linear_matrix(&system, rate);
        for (int i = 0; i < n_x * n; i++) {
            rate[i] *= dt;
        }
        exponential(rate, n, flow);
        test_pendulum_state(&seed, &system, x, u);
        struct test_integrator rk = test_integrator_open(RK, FINE, &system, NULL);
        test_integrate(&rk, x, u, dt, next, A, B);
        for (int32_t i = 0; i < n_x; i++) {
            double expected = 0;
            for (int32_t j = 0; j < n; j++) {
                double value = j < n_x ? A[i * n_x + j] : B[i * n_u + j - n_x];
                expected += flow[i * n + j] * (j < n_x ? x[j] : u[j - n_x]);
                worst = fmax(worst, fabs(value - flow[i * n + j]));
            }
            worst = fmax(worst, fabs(next[i] - expected));
        }
        print_message("linear system %d against the exponential: %.1e\n", flags, worst);
        assert_true(worst < 1e-6);
        test_integrator_close(&rk);
    }
}

/* Without muscles the pendulum keeps its energy; a symplectic scheme does not drift. */
static void energy(void **state) {
    (void)state;
    mhe_system system;
    test_pendulum_system(0, &system);
    struct test_integrator rk = test_integrator_open(RK, FINE, &system, NULL);
    double x[4] = {0.3, 0.9, 2, -1}, u[SYSTEM_M] = {0, 0, 0}, start, middle = 0, end = 0;
    start = test_pendulum_energy(x, x + 2);
    for (int k = 0; k < 4000; k++) {
        test_integrate(&rk, x, u, 0.01, x, NULL, NULL);
        double off = fabs(test_pendulum_energy(x, x + 2) - start);
        *(k < 2000 ? &middle : &end) = fmax(k < 2000 ? middle : end, off);
    }
    print_message("energy over 40 s: off by %.1e in the first half, %.1e in the second\n", middle,
                  end);
    assert_true(end < 1e-7);
    assert_true(end < 3 * middle);
    test_integrator_close(&rk);
}

static void against_cvodes(void **state) {
    (void)state;
    uint64_t seed = 10;
    double worst = 0, worst_derivative = 0;
    for (int32_t flags = 0; flags < SYSTEM_N_FLAGS; flags++) {
        mhe_system system;
        test_pendulum_system(flags, &system);
        struct test_integrator rk = test_integrator_open(RK, FINE, &system, NULL);
        struct test_integrator reference = test_integrator_open(
            "mhe.integrator.sundials", "{rtol: 1e-10, atol: 1e-12}", &system, NULL);
        if (reference.ops == NULL) {
            test_integrator_close(&rk);
            skip();
        }
        for (int trial = 0; trial < 30; trial++) {
            double x[SYSTEM_X], u[SYSTEM_U], next[2][SYSTEM_X];
            double A[2][SYSTEM_X * SYSTEM_X], B[2][SYSTEM_X * SYSTEM_U];
            test_pendulum_state(&seed, &system, x, u);
            double dt = test_random(&seed, 0.01, 0.06);
            test_integrate(&rk, x, u, dt, next[0], A[0], B[0]);
            test_integrate(&reference, x, u, dt, next[1], A[1], B[1]);
            worst = fmax(worst, test_relative(next[0], next[1], system.n_x));
            worst_derivative =
                fmax(worst_derivative, test_relative(A[0], A[1], system.n_x * system.n_x));
            worst_derivative =
                fmax(worst_derivative, test_relative(B[0], B[1], system.n_x * system.n_u));
        }
        test_integrator_close(&rk);
        test_integrator_close(&reference);
    }
    print_message("against CVODES (1e-10): state %.1e, A and B %.1e\n", worst, worst_derivative);
    assert_true(worst < 1e-5);
    assert_true(worst_derivative < 1e-3);
}

/* ---- a system that answers badly ---- */

static void bad_points(void **state) {
    (void)state;
    test_integrator_meets_bad_points(RK);
}

/* ---- a force that jumps, or has a kink, where a coordinate passes 0 ---- */

static int32_t broken_power; /* 0: a jump, 1: a kink */
static int64_t broken_calls;

static mhe_status broken_acceleration(const mhe_system *system, void *context,
                                      const mhe_system_point *at, const mhe_acceleration *out,
                                      mhe_error *err) {
    const double *q = at->q, *v = at->v;
    (void)system, (void)context, (void)err;
    double push = broken_power == 0 ? -20 : -400 * q[0], pull = broken_power == 0 ? 0 : -400;
    broken_calls++;
    out->vdot[0] = 10 + (q[0] > 0 ? push : 0);
    out->vdot[1] = -v[1];
    if (out->vdot_q != NULL) {
        memset(out->vdot_q, 0, sizeof(double) * SYSTEM_Q * SYSTEM_Q);
        memset(out->vdot_v, 0, sizeof(double) * SYSTEM_Q * SYSTEM_Q);
        memset(out->vdot_a, 0, sizeof(double) * SYSTEM_Q * SYSTEM_M);
        out->vdot_q[0] = q[0] > 0 ? pull : 0;
        out->vdot_v[3] = -1;
    }
    return MHE_OK;
}

/* (q, v) of the broken coordinate after dt from (q < 0, v > 0): a parabola up to 0, then another or
 * a sine. */
static void broken_exact(double q, double v, double dt, double *next) {
    double t = (sqrt(v * v - 20 * q) - v) / 10; /* of the passage */
    if (t >= dt) {
        next[0] = q + v * dt + 5 * dt * dt;
        next[1] = v + 10 * dt;
        return;
    }
    double w = v + 10 * t, left = dt - t;
    if (broken_power == 0) {
        next[0] = w * left - 5 * left * left;
        next[1] = w - 10 * left;
    } else { /* q'' = 10 - 400 q */
        next[0] = 0.025 + w / 20 * sin(20 * left) - 0.025 * cos(20 * left);
        next[1] = w * cos(20 * left) + 0.5 * sin(20 * left);
    }
}

static void broken_forces(void **state) {
    (void)state;
    mhe_system system;
    test_pendulum_system(0, &system);
    system.acceleration = broken_acceleration;
    for (int stages = 1; stages <= 6; stages++) {
        char yaml[2][64];
        (void)snprintf(yaml[0], sizeof yaml[0], "{stages: %d, tolerance: 0}", stages);
        (void)snprintf(yaml[1], sizeof yaml[1], "{stages: %d, tolerance: 1e-6}", stages);
        for (broken_power = 0; broken_power < 2; broken_power++) {
            double worst[2] = {0, 0}, price[2] = {0, 0};
            for (int refined = 0; refined < 2; refined++) {
                struct test_integrator rk = test_integrator_open(RK, yaml[refined], &system, NULL);
                uint64_t seed = 12;
                broken_calls = 0;
                for (int trial = 0; trial < 200; trial++) {
                    double x[4] = {test_random(&seed, -0.02, 0), 0, test_random(&seed, 0.2, 1), 0};
                    double u[SYSTEM_M] = {0, 0, 0}, next[4], exact[2];
                    test_integrate(&rk, x, u, 0.03, next, NULL, NULL);
                    broken_exact(x[0], x[2], 0.03, exact);
                    worst[refined] = fmax(worst[refined], fabs(next[0] - exact[0]));
                    worst[refined] = fmax(worst[refined], fabs(next[2] - exact[1]));
                }
                price[refined] = (double)broken_calls / 200;
                test_integrator_close(&rk);
            }
            print_message("%d stages, %s: fixed %.1e (%.0f accelerations), refined %.1e (%.0f)\n",
                          stages, broken_power == 0 ? "jump" : "kink", worst[0], price[0], worst[1],
                          price[1]);
            assert_true(worst[0] > 1e-5);
            assert_true(worst[1] < 1e-6);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives),    cmocka_unit_test(same_step_with_derivatives),
        cmocka_unit_test(memory),         cmocka_unit_test(order),
        cmocka_unit_test(linear_system),  cmocka_unit_test(energy),
        cmocka_unit_test(against_cvodes), cmocka_unit_test(bad_points),
        cmocka_unit_test(broken_forces)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
