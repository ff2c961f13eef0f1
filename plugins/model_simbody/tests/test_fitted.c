/* SPDX-License-Identifier: Apache-2.0 */
/* Fitted paths: as good as asked where they were fitted, exact elsewhere, kept in a cache, and
 * fitted to a motion where one is known. */
#include "leg.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TOLERANCE 2e-3 /* m */

static test_instance exact;

static int setup(void **state) {
    (void)state;
    assert_int_equal(setenv("XDG_CACHE_HOME", MHE_TEST_BINARY_DIR "/paths-cache", 1), 0);
    assert_int_equal(system("rm -rf '" MHE_TEST_BINARY_DIR "/paths-cache'"), 0);
    test_open(&exact, &leg, 0);
    return 0;
}

static int teardown(void **state) {
    (void)state;
    test_close(&exact);
    return 0;
}

static mhe_coordinate ranged[N_Q];
static mhe_description fitted_leg;

/* Over half of +-0.5, or about a motion [2 x N_Q] where there is one. */
static void fitted_open(test_instance *out, const double *motion) {
    fitted_leg = leg;
    memcpy(ranged, leg_coordinates, sizeof ranged);
    for (int i = 0; i < N_Q; i++) {
        ranged[i].lower = i == 4 ? -0.05 : -0.5;
        ranged[i].upper = -ranged[i].lower;
        ranged[i].rotational = i != 4;
    }
    fitted_leg.coordinates = ranged;
    fitted_leg.motion_lower = motion;
    fitted_leg.motion_upper = motion != NULL ? motion + N_Q : NULL;
    test_open_fitted(out, &fitted_leg, TOLERANCE, 0.5);
}

/* RMS difference of the lengths [N_P] at 200 poses centre +- half; how many are not exact. */
static int fit_errors(const test_instance *fitted, const double *centre, const double *half,
                      double *rms) {
    uint64_t seed = 99;
    int off = 0;
    memset(rms, 0, N_P * sizeof *rms);
    for (int trial = 0; trial < 200; trial++) {
        double q[N_Q], a[N_P], b[N_P];
        for (int i = 0; i < N_Q; i++) {
            q[i] = centre[i] + half[i] * test_random(&seed, -1, 1);
        }
        assert_int_equal(leg_lengths(&exact, q, a, NULL, NULL), 0);
        assert_int_equal(leg_lengths(fitted, q, b, NULL, NULL), 0);
        for (int i = 0; i < N_P; i++) {
            rms[i] += (a[i] - b[i]) * (a[i] - b[i]) / 200;
        }
    }
    for (int i = 0; i < N_P; i++) {
        rms[i] = sqrt(rms[i]);
        off += rms[i] > 1e-7;
    }
    return off;
}

/* Errors are what was asked for, on poses that the fit has not seen; derivatives are those of the
 * fitted length; beyond the range it is exact, and points are still there to draw. */
static void fitted_paths_keep_their_tolerance(void **state) {
    (void)state;
    static const double middle[N_Q] = {0}, half[N_Q] = {0.25, 0.25, 0.25, 0.25, 0.025, 0.25};
    test_instance fitted;
    uint64_t seed = 299;
    double rms[N_P];
    fitted_open(&fitted, NULL);
    int off = fit_errors(&fitted, middle, half, rms);
    for (int i = 0; i < N_P; i++) {
        print_message("%s: %.3f mm RMS\n", leg_paths[i].name, 1e3 * rms[i]);
        assert_true(rms[i] < 1.3 * TOLERANCE);
    }
    assert_true(off >= 4);
    for (int trial = 0; trial < 5; trial++) {
        double q[N_Q], gradient[N_P * N_Q], hessian[N_P * N_Q * N_Q], at[3 * 64];
        for (int i = 0; i < N_Q; i++) {
            q[i] = half[i] * test_random(&seed, -1, 1);
        }
        assert_int_equal(leg_lengths(&fitted, q, NULL, gradient, hessian), 0);
        for (int32_t i = 0; i < N_P; i++) {
            leg_watch watch = {&fitted, i};
            assert_true(
                test_jacobian_error(leg_length_of_q, &watch, q, N_Q, 1, gradient + i * N_Q) < 1e-7);
            assert_true(test_jacobian_error(leg_gradient_of_q, &watch, q, N_Q, N_Q,
                                            hessian + i * N_Q * N_Q) < 1e-5);
        }
        assert_true(fitted.ops->path_points(fitted.context, 2, at, 64) >= 2);
    }
    double out[N_Q] = {0.1, 0.2, 0.7, 0.8, 0.02, 0.9}, a[N_P], b[N_P];
    assert_int_equal(leg_lengths(&fitted, out, b, NULL, NULL), 0);
    assert_int_equal(leg_lengths(&exact, out, a, NULL, NULL), 0);
    for (int i = 0; i < N_P; i++) { /* (what does not depend on those stays fitted) */
        assert_true(fabs(b[i] - a[i]) <= (i == 0 || i == 7 ? 1e-2 : 1e-12));
    }
    test_close(&fitted);
    assert_non_null(strstr(test_told, "outside their range, and exact there"));
}

/* Where the motion is known paths are fitted to it and a margin, wherever it lies in the ranges;
 * what it says nothing of (NaN) is as without it. More of them meet the tolerance. */
static void a_motion_that_is_known_is_what_is_fitted(void **state) {
    (void)state;
    static const double motion[2][N_Q] = {{0.3, -0.1, 0.1, 0.3, NAN, -0.45},
                                          {0.4, 0.1, 0.3, 0.45, NAN, -0.3}};
    static const double centre[N_Q] = {0.35, 0, 0.2, 0.375, 0, -0.375};
    static const double half[N_Q] = {0.05, 0.1, 0.1, 0.075, 0.025, 0.075};
    /* of the width a fifth, at least 0.05 rad */
    static const double wider[N_Q] = {0.095, 0.14, 0.14, 0.12, 0.025, 0.12};
    double rms[N_P], at[N_Q], a[N_P], b[N_P];
    test_instance wide, fitted;
    fitted_open(&wide, NULL);
    fitted_open(&fitted, motion[0]);
    assert_non_null(strstr(test_told, "7 of 9 paths are polynomials; what misses paths_tolerance"));
    int few = fit_errors(&wide, centre, half, rms), off = fit_errors(&fitted, centre, wider, rms);
    print_message("%d of %d paths are fitted there, without the motion %d\n", off, N_P, few);
    assert_true(off > few);
    for (int i = 0; i < N_P; i++) {
        assert_true(rms[i] < 1.3 * TOLERANCE);
    }
    memcpy(at, centre, sizeof at);
    at[0] = 0.5; /* in the coordinate's range, but 0.05 beyond the margin */
    assert_int_equal(leg_lengths(&fitted, at, b, NULL, NULL), 0);
    assert_int_equal(leg_lengths(&exact, at, a, NULL, NULL), 0);
    for (int i = 1; i < N_P; i++) { /* all but 'moving' and the polynomial cross it */
        assert_true(i == 7 || fabs(b[i] - a[i]) <= 1e-12);
    }
    test_close(&wide);
    test_close(&fitted);
}

/* From the cache come the same bits; a file that is damaged is not believed. */
static void fits_are_kept(void **state) {
    (void)state;
    test_instance opened[3];
    double q[N_Q] = {0.1, -0.2, 0.2, 0.2, 0.01, -0.2}, length[3][N_P];
    for (int i = 0; i < 3; i++) {
        if (i == 2) {
            assert_int_equal(system("for f in '" MHE_TEST_BINARY_DIR
                                    "/paths-cache'/mhe/paths-*.fit; do head -c 500 \"$f\" > "
                                    "\"$f.cut\" && mv \"$f.cut\" \"$f\"; done"),
                             0);
        }
        fitted_open(&opened[i], NULL);
        assert_int_equal(leg_lengths(&opened[i], q, length[i], NULL, NULL), 0);
        assert_memory_equal(length[i], length[0], sizeof length[0]);
    }
    for (int i = 0; i < 3; i++) {
        test_close(&opened[i]);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fitted_paths_keep_their_tolerance),
        cmocka_unit_test(a_motion_that_is_known_is_what_is_fitted),
        cmocka_unit_test(fits_are_kept),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
