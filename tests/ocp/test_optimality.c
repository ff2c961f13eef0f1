/* SPDX-License-Identifier: Apache-2.0 */
/* Solutions of a solver, whichever (RIG_SOLVER): optimality, signs of multipliers, warm start, real
 * size. */
#include "solver_rig.h"
#include "support.h"

#include <math.h>
#include <string.h>
#include <time.h>

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* Double integrator, pulled to 1. */
static void linear_rate(const toy *t, const double *x, const double *u, double *f, double *fx,
                        double *fu) {
    (void)t;
    f[0] = x[1];
    f[1] = u[0];
    fx[1] = 1;
    fu[1] = 1;
}

static void linear_residual(const toy *t, int k, const double *x, const double *u, double *r,
                            double *w, double *rx, double *ru) {
    (void)t, (void)k;
    r[0] = x[0] - 1;
    r[1] = x[1];
    rx[0] = rx[3] = 1;
    w[0] = 1;
    w[1] = 0.1;
    if (u != NULL) {
        r[2] = u[0];
        w[2] = 0.01;
        ru[2] = 1;
    }
}

static void toy_linear(toy *t) {
    toy_init(t, 10, 2, 1, 0.2, 1, linear_rate, linear_residual, 3, 2);
    for (int i = 0; i < 2; i++) {
        toy_x_lower(t, 0)[i] = toy_x_upper(t, 0)[i] = 0.1;
    }
}

static void assert_optimal(const rig *r, double tolerance) {
    rig_kkt kkt = rig_check(r);
    assert_true(kkt.stationarity < tolerance);
    assert_true(kkt.primal < tolerance);
    assert_true(kkt.complementarity < tolerance);
    assert_true(kkt.dual <= 0);
}

/* Without bounds the optimum is the solution of linear equations: Riccati recursion. */
static void test_linear_quadratic(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_linear(&t);
    assert_int_equal(rig_open(&r, &t, "{tolerance: 1e-9}"), MHE_OK);
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    assert_optimal(&r, 1e-7);

    double A[4], B[2], u = 0, x[2] = {0.1, 0.1}, next[2];
    double P[11][4] = {{0}}, p[11][2] = {{0}}; /* cost to go 1/2 x'Px + p'x */
    toy_step(&t, x, &u, next, A, B);
    P[10][0] = 1, P[10][3] = 0.1, p[10][0] = -1;
    double K[10][2], d[10];
    for (int k = 9; k >= 0; k--) {
        double *P1 = P[k + 1], *p1 = p[k + 1], PB[2], PA[4];
        for (int i = 0; i < 2; i++) {
            PB[i] = P1[2 * i] * B[0] + P1[2 * i + 1] * B[1];
            for (int j = 0; j < 2; j++) {
                PA[2 * i + j] = P1[2 * i] * A[j] + P1[2 * i + 1] * A[2 + j];
            }
        }
        double R = 0.01 + B[0] * PB[0] + B[1] * PB[1];
        d[k] = -(B[0] * p1[0] + B[1] * p1[1]) / R;
        for (int j = 0; j < 2; j++) {
            K[k][j] = -(B[0] * PA[j] + B[1] * PA[2 + j]) / R;
        }
        for (int i = 0; i < 2; i++) {
            double AtPB = A[i] * PB[0] + A[2 + i] * PB[1];
            for (int j = 0; j < 2; j++) {
                P[k][2 * i + j] = A[i] * PA[j] + A[2 + i] * PA[2 + j] + AtPB * K[k][j];
            }
            p[k][i] = A[i] * p1[0] + A[2 + i] * p1[1] + AtPB * d[k];
        }
        P[k][0] += 1, P[k][3] += 0.1, p[k][0] += -1;
    }
    for (int k = 0; k < 10; k++) {
        u = K[k][0] * x[0] + K[k][1] * x[1] + d[k];
        assert_true(fabs(r.at.u[k] - u) < 1e-7);
        toy_step(&t, x, &u, next, NULL, NULL);
        memcpy(x, next, sizeof x);
        for (int i = 0; i < 2; i++) { /* lambda_k = - d(cost to go)/dx at x_{k+1} */
            double slope = P[k + 1][2 * i] * x[0] + P[k + 1][2 * i + 1] * x[1] + p[k + 1][i];
            assert_true(fabs(r.at.lambda[2 * k + i] + slope) < 1e-6);
        }
    }
    rig_close(&r);
    toy_free(&t);
}

/* A convex problem: its optimality conditions are sufficient. */
static void test_bounds(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_linear(&t);
    for (int k = 0; k < 10; k++) {
        *toy_u_lower(&t, k) = -0.8;
        *toy_u_upper(&t, k) = 1.5;
        toy_x_upper(&t, k + 1)[1] = 0.6;
    }
    assert_int_equal(rig_open(&r, &t, "{tolerance: 1e-8, max_iterations: 50}"), MHE_OK);
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
    assert_optimal(&r, 1e-6);
    assert_true(r.at.zu_upper[0] > 1e-3);                      /* pushed at full force first */
    assert_true(r.at.zx_upper[2 * 2 + 1] > 1e-3);              /* then at full speed */
    assert_true(r.at.zx_lower[0] > 0 || r.at.zx_upper[0] > 0); /* and held at the start */
    rig_close(&r);
    toy_free(&t);
}

static void start_pendulum(rig *r) {
    rig_reset(r);
    for (int k = 0; k <= 20; k++) {
        r->at.x[2 * k] = acos(-1) * k / 20;
    }
}

static void test_pendulum_warm(void **state) {
    (void)state;
    toy t;
    rig cold, warm;
    toy_pendulum(&t, 20);
    const char *yaml = "{tolerance: 1e-8, max_iterations: 200}";
    assert_int_equal(rig_open(&cold, &t, yaml), MHE_OK);
    assert_int_equal(rig_open(&warm, &t, yaml), MHE_OK);
    start_pendulum(&cold);
    start_pendulum(&warm);
    assert_int_equal(rig_solve(&warm, NULL), MHE_OK);
    assert_int_equal(warm.info.outcome, MHE_SOLVE_CONVERGED);
    assert_optimal(&warm, 1e-6);
    assert_true(fabs(warm.at.x[2 * 20] - acos(-1)) < 0.2); /* it is up */
    for (int side = 0; side < 2; side++) {                 /* a slightly other start */
        (side == 0 ? toy_x_lower : toy_x_upper)(&t, 0)[0] = 0.02;
    }
    assert_int_equal(rig_solve(&cold, NULL), MHE_OK);
    assert_int_equal(rig_solve(&warm, NULL), MHE_OK);
    assert_int_equal(cold.info.outcome, MHE_SOLVE_CONVERGED);
    assert_int_equal(warm.info.outcome, MHE_SOLVE_CONVERGED);
    for (int i = 0; i < 2 * 21; i++) {
        assert_true(fabs(warm.at.x[i] - cold.at.x[i]) < 1e-6);
    }
    for (int i = 0; i < 20; i++) {
        assert_true(fabs(warm.at.u[i] - cold.at.u[i]) < 1e-6);
    }
    print_message("pendulum: %d iterations cold, %d warm\n", (int)cold.info.iterations,
                  (int)warm.info.iterations);
    assert_true(warm.info.iterations < cold.info.iterations);
    rig_close(&cold);
    rig_close(&warm);
    toy_free(&t);
}

/* One linearisation an iteration, and values alone only where a step was shortened. */
static void test_evaluations(void **state) {
    (void)state;
    toy t;
    rig r;
    toy_linear(&t);
    assert_int_equal(rig_open(&r, &t, "{objective_scale: 1}"), MHE_OK);
    t.evaluations = t.linearisations = 0;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(t.evaluations, 11 * (r.info.iterations + 1));
    assert_int_equal(t.linearisations, t.evaluations);
    rig_close(&r);
    toy_free(&t);
}

enum { FRAMES = 60, WINDOW = 7 };

/* The moving horizon at the real size; times are for the reader, not asserted. */
static void test_real_size(void **state) {
    (void)state;
    static double target[FRAMES + 1][TOY_ARM_TARGET], x[FRAMES + 2][TOY_ARM_X];
    toy t;
    rig r;
    double dt = 0.03, total = 0, evaluation = 0, worst = 0;
    int iterations = 0, solves = 0;
    toy_arm(&t, WINDOW, dt);
    t.target = target[0];
    for (int i = 8; i < TOY_ARM_X; i++) {
        x[0][i] = 0.2;
    }
    toy_arm_motion(&t, FRAMES + 1, x[0], target[0]);
    memcpy(toy_x_lower(&t, 0), x[0], sizeof x[0]);
    memcpy(toy_x_upper(&t, 0), x[0], sizeof x[0]);
    assert_int_equal(rig_open(&r, &t, "{}"), MHE_OK);
    for (int k = 0; k <= WINDOW; k++) {
        memcpy(r.at.x + k * TOY_ARM_X, x[k], sizeof x[k]);
    }
    for (int frame = 0; frame + WINDOW <= FRAMES; frame++) {
        t.target = target[frame];
        double start = now();
        assert_int_equal(rig_solve(&r, NULL), MHE_OK);
        double seconds = now() - start;
        assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
        for (int i = 0; i < 4; i++) {
            assert_true(fabs(r.at.x[i] - x[frame][i]) < 1e-4);
        }
        if (frame > 0) {
            total += seconds;
            worst = fmax(worst, seconds);
            evaluation += r.info.evaluation_time;
            iterations += r.info.iterations;
            solves++;
        }
        rig_shift(&r);
    }
    print_message("real size: %.1f ms a warm solve (worst %.1f), %.1f of it evaluation, %.1f "
                  "iterations\n",
                  1e3 * total / solves, 1e3 * worst, 1e3 * evaluation / solves,
                  (double)iterations / solves);
    rig_close(&r);
    toy_free(&t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_linear_quadratic), cmocka_unit_test(test_bounds),
        cmocka_unit_test(test_pendulum_warm),    cmocka_unit_test(test_evaluations),
        cmocka_unit_test(test_real_size),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
