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

/* Stamps of a sender's clock, known as the sample is there. */
static double next(mhi_stamp *s, double stamp) {
    return mhi_stamp_next(s, stamp, stamp, 0);
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
        const double time = next(&s, stamp);
        assert_true(time > last && time <= stamp + 27 * 5e-7);
        last = time;
        if (k > 4000) { /* of packets that hardly wait the last samples are at their true times */
            worst = fmax(worst, fabs(time - true_time));
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
        const double time = next(&s, true_time + 2e-3 * noise(k));
        if (k > 2000) {
            assert_within(time, true_time, 2e-4);
        }
    }
}

/* A stream that says 100 samples a second and has 50, 98, 150: its own rate counts, soon. */
static void another_rate_than_it_says(void **state) {
    (void)state;
    static const double rates[] = {50, 98, 100.2, 150};
    for (size_t i = 0; i < sizeof rates / sizeof *rates; i++) {
        mhi_stamp s;
        mhi_stamp_start(&s, 100);
        for (int64_t k = 0; k < 3000; k++) {
            const double true_time = (double)k / rates[i];
            const double time = next(&s, true_time + 1e-3 * noise(k));
            if (true_time > 3) {
                assert_within(time, true_time, 1e-3);
            }
        }
        assert_int_equal(s.n_jumps, 0);
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
        const double time = next(&s, (double)k / 100 + 2e-3 * noise(k));
        assert_within(time, (double)k / 100, 2.1e-3);
        n++;
    }
    assert_int_equal(s.n_gaps, 50);
    assert_int_equal(s.n_jumps, 0);
    assert_int_equal(n, 2950);
}

/* A machine that starves the reader for `length` s every `every` s: what waited comes at once. */
static double starved(double time, double every, double length) {
    const double phase = fmod(time, every);
    return phase < length ? time - phase + length : time;
}

/* Receipts of a sender without a clock, while a browser's start takes the cores, then now and then:
 * no sample is of later than it came, and the line is that of the samples in time. */
static void late_bursts(void **state) {
    (void)state;
    mhi_stamp s;
    mhi_stamp_start(&s, 100);
    double last = -1, worst = 0, soon = 0;
    for (int64_t k = 0; k < 6000; k++) {
        const double true_time = 5 + (double)k / 100 * 1.0002;
        double came = true_time + 3e-4 * noise(k);
        came = true_time < 8 ? starved(came, 0.25, 0.12) : starved(came, 7, 0.3);
        const double time = mhi_stamp_next(&s, came, came, 1);
        assert_true(time > last && time <= came + 2e-4); /* samples of one instant: 10 us apart */
        last = time;
        if (true_time > 10) {
            worst = fmax(worst, fabs(time - true_time));
        } else if (true_time > 5.5) {
            soon = fmax(soon, fabs(time - true_time));
        }
    }
    assert_true(s.n_gaps == 0 && s.n_jumps == 0);
    assert_within(worst, 0, 4e-4);
    assert_within(soon, 0, 0.03);
    assert_within(s.period, 0.010002, 2e-7);
}

/* The first samples come late and at once: they do not make the stream a faster one. */
static void a_late_beginning(void **state) {
    (void)state;
    mhi_stamp s;
    mhi_stamp_start(&s, 100);
    double worst = 0;
    for (int64_t k = 0; k < 1000; k++) {
        const double true_time = 5 + (double)k / 100, came = fmax(true_time, 5.4);
        const double time = mhi_stamp_next(&s, came, came, 1);
        assert_true(time <= came + 1e-4 * (double)(k + 1));
        worst = true_time > 5.9 ? fmax(worst, fabs(time - true_time)) : worst;
    }
    assert_within(worst, 0, 0.03);
    assert_within(s.period, 0.01, 1e-9);
}

/* A sender without a clock whose samples are lost: later ones do not catch up, so it was a gap. */
static void receipts_after_a_loss(void **state) {
    (void)state;
    mhi_stamp s;
    mhi_stamp_start(&s, 100);
    for (int64_t k = 0; k < 3000; k++) {
        if (k >= 1000 && k < 1050) {
            continue;
        }
        const double came = (double)k / 100 + 3e-4 * noise(k);
        const double time = mhi_stamp_next(&s, came, came, 1);
        if (k < 1000 || k > 1160) {
            assert_within(time, (double)k / 100, 4e-4);
        }
    }
    assert_int_equal(s.n_gaps, 50);
    assert_int_equal(s.n_jumps, 0);
}

static void a_clock_that_is_set(void **state) {
    (void)state;
    mhi_stamp s;
    mhi_stamp_start(&s, 100);
    for (int64_t k = 0; k < 500; k++) {
        (void)next(&s, 1000 + (double)k / 100);
    }
    for (int64_t k = 0; k < 500; k++) {
        const double time = next(&s, 20 + (double)k / 100);
        assert_within(time, 20 + (double)k / 100, 1e-6);
    }
    assert_int_equal(s.n_jumps, 1);
    for (int64_t k = 0; k < 500; k++) { /* half a second back: it is no jitter either */
        (void)next(&s, 24.5 + (double)k / 100);
    }
    assert_int_equal(s.n_jumps, 2);
}

static void nonsense(void **state) {
    (void)state;
    mhi_stamp s;
    mhi_stamp_start(&s, 100);
    double last = next(&s, NAN);
    for (int64_t k = 1; k < 2000; k++) {
        const double stamp = k % 7 == 0 ? NAN : k % 11 == 0 ? INFINITY : (double)k / 100;
        const double time = next(&s, stamp);
        assert_true(time < 1e6 && time > last); /* finite, and forward */
        last = time;
    }
    mhi_stamp_start(&s, 0); /* irregular: as they are */
    assert_within(next(&s, 3.25), 3.25, 0);
    assert_within(next(&s, 3.26), 3.26, 0);
    assert_true(next(&s, 3.26) > 3.26);
    assert_within(mhi_stamp_next(&s, 3.5, 3.4, 0), 3.4, 0); /* nor later than it came */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(jitter_is_gone),
        cmocka_unit_test(drift_is_followed),
        cmocka_unit_test(another_rate_than_it_says),
        cmocka_unit_test(samples_that_are_lost),
        cmocka_unit_test(late_bursts),
        cmocka_unit_test(a_late_beginning),
        cmocka_unit_test(receipts_after_a_loss),
        cmocka_unit_test(a_clock_that_is_set),
        cmocka_unit_test(nonsense),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
