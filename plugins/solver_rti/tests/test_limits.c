/* SPDX-License-Identifier: Apache-2.0 */
/* What solver_rti does beyond what every solver must where a solve cannot go well, what its presets
 * promise, and that a solve takes no memory. */
#include "allocations.h"
#include "solver_rig.h"
#include "support.h"

#include <malloc.h>
#include <math.h>
#include <string.h>

static void assert_optimal(const rig *r, double tolerance) {
    const rig_kkt kkt = rig_check(r);
    assert_int_equal(r->info.outcome, MHE_SOLVE_CONVERGED);
    assert_true(kkt.stationarity < tolerance);
    assert_true(kkt.primal < tolerance);
    assert_true(kkt.complementarity < tolerance);
    assert_true(kkt.dual <= 0);
}

/* Bounds are kept, even where no motion meets them. */
static void test_out_of_reach(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 5, "{max_iterations: 500}");
    toy_x_lower(&t, 1)[0] = 3; /* upright within one interval */
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_INFEASIBLE);
    assert_true(r.at.x[2] >= 3);
    rig_close_both(&r, &t);
}

/* A later state may be fixed as well, and a control, and the first state free. */
static void test_fixed_and_free(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 20, "{tolerance: 1e-8, max_iterations: 200}");
    toy_x_lower(&t, 20)[0] = toy_x_upper(&t, 20)[0] = 3.0;
    *toy_u_lower(&t, 4) = *toy_u_upper(&t, 4) = 1.5;
    toy_x_lower(&t, 0)[1] = -1;
    toy_x_upper(&t, 0)[1] = 1;
    assert_int_equal(rig_solve(&r, NULL), MHE_OK);
    assert_optimal(&r, 1e-6);
    assert_true(fabs(r.at.x[2 * 20] - 3) < 1e-9);
    assert_true(r.at.u[4] == 1.5);
    assert_true(r.at.x[0] == 0);
    rig_close_both(&r, &t);
}

/* A deadline that was over before: nothing is evaluated, and the start stays as it came. */
static void test_too_late(void **state) {
    (void)state;
    toy t;
    rig r;
    rig_open_pendulum(&r, &t, 20, "{}");
    t.evaluations = 0;
    const mhe_solve_control control = {.size = sizeof control, .deadline = 1e-3}; /* long ago */
    assert_int_equal(rig_solve(&r, &control), MHE_OK);
    assert_int_equal(r.info.outcome, MHE_SOLVE_DEADLINE);
    for (int i = 0; i < 2 * 21; i++) {
        assert_true(r.at.x[i] == 0);
    }
    assert_int_equal(r.at.has_multipliers, 0);
    assert_int_equal(t.evaluations, 0);
    rig_close_both(&r, &t);
}

/* Cold, every preset converges; then the first state moves and each takes the iterations that it
 * may: the more, the nearer. The third of `balanced` no longer moves much, the one of `speed` does.
 */
static void test_presets(void **state) {
    (void)state;
    static const char *const yaml[] = {"{preset: robust, tolerance: 1e-7}",
                                       "{preset: balanced, tolerance: 1e-7, settled: 0.01}",
                                       "{preset: speed, tolerance: 1e-7, settled: 0.01}"};
    double x[3][2 * 21];
    for (int i = 0; i < 3; i++) {
        toy t;
        rig r;
        rig_open_pendulum(&r, &t, 20, yaml[i]);
        assert_int_equal(rig_solve(&r, NULL), MHE_OK);
        assert_int_equal(r.info.outcome, MHE_SOLVE_CONVERGED);
        toy_x_lower(&t, 0)[0] = toy_x_upper(&t, 0)[0] = 0.05;
        t.evaluations = t.linearisations = 0;
        assert_int_equal(rig_solve(&r, NULL), MHE_OK);
        memcpy(x[i], r.at.x, sizeof x[i]);
        assert_int_equal(r.info.outcome, i < 2 ? MHE_SOLVE_CONVERGED : MHE_SOLVE_ITERATION_LIMIT);
        if (i > 0) { /* one linearisation an iteration; of the result the first gap alone */
            const int iterations = i == 1 ? 3 : 1;
            assert_int_equal(r.info.iterations, iterations);
            assert_int_equal(t.linearisations, 21 * iterations);
            assert_int_equal(t.evaluations, 21 * iterations + 1);
        }
        rig_close_both(&r, &t);
    }
    double off[3] = {0};
    for (int i = 1; i < 3; i++) {
        for (int j = 0; j < 2 * 21; j++) {
            off[i] = fmax(off[i], fabs(x[i][j] - x[0][j]));
        }
    }
    print_message("off the converged solution: balanced %.1e, speed %.1e\n", off[1], off[2]);
    assert_true(off[1] < off[2] && off[2] < 0.05);
}

/* A joint that one muscle and a torque of its own turn; the torque is counted in `unit` of N m. */
static double unit;

static void joint_rate(const toy *t, const double *x, const double *u, double *f, double *fx,
                       double *fu) {
    const double curve = exp(-x[0] * x[0]);
    (void)t;
    f[0] = x[1];
    f[1] = 60 * curve * u[0] + 2 * unit * u[1] - 30 * sin(x[0]) - x[1];
    fx[1] = 1;
    fx[2] = -120 * x[0] * curve * u[0] - 30 * cos(x[0]);
    fx[3] = -1;
    fu[2] = 60 * curve;
    fu[3] = 2 * unit;
}

static void joint_residual(const toy *t, int k, const double *x, const double *u, double *r,
                           double *w, double *rx, double *ru) {
    r[0] = x[0] - t->target[k];
    w[0] = 1 / (0.001 * 0.001);
    rx[0] = 1;
    if (u != NULL) {
        r[1] = u[0];
        w[1] = 1 / (0.3 * 0.3);
        ru[2] = 1;
        r[2] = u[1];
        w[2] = unit * unit / (10 * 10);
        ru[5] = 1;
    }
}

/* Whether a window settled does not depend on the unit of a torque beside activations. */
static void test_units_of_torques(void **state) {
    (void)state;
    static const char *const yaml[] = {"{preset: balanced, objective_scale: 1, settled: 0.05}",
                                       "{preset: balanced, objective_scale: 1, settled: 1e-9}"};
    const double units[] = {1, 1e-3};
    double target[8 + 1 + 6];
    int32_t outcome[2][2][6];
    for (int k = 0; k < 15; k++) {
        target[k] = 0.6 * sin(0.7 * k);
    }
    for (int i = 0; i < 4; i++) {
        toy t;
        rig r;
        unit = units[i / 2];
        toy_init(&t, 8, 2, 2, 0.03, 2, joint_rate, joint_residual, 3, 1);
        for (int k = 0; k < 8; k++) {
            toy_u_lower(&t, k)[0] = 0;
            toy_u_upper(&t, k)[0] = 1;
            toy_u_lower(&t, k)[1] = -1000 / unit;
            toy_u_upper(&t, k)[1] = 1000 / unit;
        }
        t.target = target;
        assert_int_equal(rig_open(&r, &t, yaml[i % 2]), MHE_OK);
        for (int window = 0; window < 6; window++) {
            t.target = target + window;
            assert_int_equal(rig_solve(&r, NULL), MHE_OK);
            outcome[i / 2][i % 2][window] = r.info.outcome;
            rig_shift(&r);
        }
        rig_close_both(&r, &t);
    }
    assert_memory_equal(outcome[0], outcome[1], sizeof outcome[0]);
    for (int window = 1; window < 6; window++) { /* and it is not that nothing moved */
        assert_int_equal(outcome[0][0][window], MHE_SOLVE_CONVERGED);
        assert_int_equal(outcome[0][1][window], MHE_SOLVE_ITERATION_LIMIT);
    }
}

#ifdef MHE_COUNT_ALLOCATIONS
/* Bytes that a solver of the arm's size takes when it is created. */
static double megabytes(int n_intervals) {
    toy t;
    rig r;
    toy_arm(&t, n_intervals, 0.03);
    const struct mallinfo2 before = mallinfo2();
    assert_int_equal(rig_open(&r, &t, "{}"), MHE_OK);
    const struct mallinfo2 after = mallinfo2();
    rig_close_both(&r, &t);
    return 1e-6 *
           ((double)(after.uordblks + after.hblkhd) - (double)(before.uordblks + before.hblkhd));
}

static void test_memory(void **state) {
    (void)state;
    const double half = megabytes(50), whole = megabytes(100);
    print_message("50 intervals %.1f MB, 100 intervals %.1f MB\n", half, whole);
    assert_true(whole > 1 && whole < 25); /* half of what a whole run may have */
    assert_true(whole < 2.05 * half);
}

static void test_no_memory_taken(void **state) {
    (void)state;
    static const char *const yaml[] = {"{preset: robust}", "{preset: balanced}", "{preset: speed}"};
    static double target[8 * TOY_ARM_TARGET];
    for (int i = 0; i < 3; i++) {
        toy t;
        rig r;
        toy_arm(&t, 7, 0.03);
        t.target = target;
        assert_int_equal(rig_open(&r, &t, yaml[i]), MHE_OK);
        const uint64_t before = mhi_allocations();
        const int n_windows = i < 2 ? 10 : 100;
        for (int window = 0; window < n_windows; window++) {
            assert_int_equal(r.ops->prepare(r.solver, &r.at, NULL), MHE_OK);
            assert_int_equal(rig_solve(&r, NULL), MHE_OK);
            assert_true(window > 0 || r.info.iterations > 0);
            rig_shift(&r);
        }
        assert_int_equal(mhi_allocations() - before, 0);
        rig_close_both(&r, &t);
    }
}
#endif

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_out_of_reach),     cmocka_unit_test(test_fixed_and_free),
        cmocka_unit_test(test_too_late),         cmocka_unit_test(test_presets),
        cmocka_unit_test(test_units_of_torques),
#ifdef MHE_COUNT_ALLOCATIONS
        cmocka_unit_test(test_memory),           cmocka_unit_test(test_no_memory_taken),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
