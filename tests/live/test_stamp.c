/* SPDX-License-Identifier: Apache-2.0 */
/* Stamps of packets that jitter, are lost, come from a clock that drifts or is set: the times of
 * the samples must be those of the device. */
#include "live/stamp.h"
#include "support.h"

#include <math.h>

static void assert_within(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.9g is not within %g of %.9g", value, tolerance, expected);
    }
}

/* 0..1, the same every time */
static double noise(int64_t k) {
    const double x = sin(12.9898 * (double)k) * 43758.5453;
    return x - floor(x);
}

static void jitter_is_gone(void **state) {
    (void)state;
    mhi_stamp s;
    mhi_stamp_start(&s, 2000);
    double last = -1, worst = 0;
    for (int64_t k = 0; k < 40000; k++) { /* 20 s, packets of 27, each up to 8 ms late */
        const int64_t packet = k / 27;
        const double true_time = 5 + (double)k / 2000;
        const double stamp = 5 + (double)(27 * packet + 26) / 2000 + 8e-3 * noise(packet);
        const double time = mhi_stamp_next(&s, stamp);
        assert_true(time > last);
        last = time;
        if (k > 4000) { /* the mean delay is no jitter: (13 samples + 4 ms) */
            worst = fmax(worst, fabs(time - true_time - 10.5e-3));
        }
    }
    assert_true(s.n_gaps == 0 && s.n_jumps == 0);
    assert_within(worst, 0, 1e-3);
}

static void drift_is_followed(void **state) {
    (void)state;
    mhi_stamp s;
    mhi_stamp_start(&s, 100);
    for (int64_t k = 0; k < 60000; k++) { /* ten minutes of a clock that is 100 ppm fast */
        const double true_time = (double)k / 100 * 1.0001;
        const double time = mhi_stamp_next(&s, true_time + 2e-3 * noise(k));
        if (k > 2000) {
            assert_within(time, true_time + 1e-3, 5e-4);
        }
    }
}

static void samples_that_are_lost(void **state) {
    (void)state;
    mhi_stamp s;
    mhi_stamp_start(&s, 100);
    int64_t n = 0;
    for (int64_t k = 0; k < 3000; k++) {
        if (k >= 1000 && k < 1050) {
            continue; /* half a second without any */
        }
        const double time = mhi_stamp_next(&s, (double)k / 100 + 2e-3 * noise(k));
        assert_within(time, (double)k / 100 + 1e-3, 2e-3);
        n++;
    }
    assert_int_equal(s.n_gaps, 50);
    assert_int_equal(s.n_jumps, 0);
    assert_int_equal(n, 2950);
}

static void a_clock_that_is_set(void **state) {
    (void)state;
    mhi_stamp s;
    mhi_stamp_start(&s, 100);
    for (int64_t k = 0; k < 500; k++) {
        (void)mhi_stamp_next(&s, 1000 + (double)k / 100);
    }
    for (int64_t k = 0; k < 500; k++) {
        const double time = mhi_stamp_next(&s, 20 + (double)k / 100);
        assert_within(time, 20 + (double)k / 100, 1e-6);
    }
    assert_int_equal(s.n_jumps, 1);
    for (int64_t k = 0; k < 500; k++) { /* half a second back: it is no jitter either */
        (void)mhi_stamp_next(&s, 24.5 + (double)k / 100);
    }
    assert_int_equal(s.n_jumps, 2);
}

static void nonsense(void **state) {
    (void)state;
    mhi_stamp s;
    mhi_stamp_start(&s, 100);
    double last = mhi_stamp_next(&s, NAN);
    for (int64_t k = 1; k < 2000; k++) {
        const double stamp = k % 7 == 0 ? NAN : k % 11 == 0 ? INFINITY : (double)k / 100;
        const double time = mhi_stamp_next(&s, stamp);
        assert_true(time < 1e6 && time > last); /* finite, and forward */
        last = time;
    }
    mhi_stamp_start(&s, 0); /* irregular: as they are */
    assert_within(mhi_stamp_next(&s, 3.25), 3.25, 0);
    assert_within(mhi_stamp_next(&s, 3.26), 3.26, 0);
    assert_true(mhi_stamp_next(&s, 3.26) > 3.26);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(jitter_is_gone),
        cmocka_unit_test(drift_is_followed),
        cmocka_unit_test(samples_that_are_lost),
        cmocka_unit_test(a_clock_that_is_set),
        cmocka_unit_test(nonsense),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
