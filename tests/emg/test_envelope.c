/* SPDX-License-Identifier: Apache-2.0 */
/* Envelopes: what the parts are is what comes out, sample by sample; gaps; delay. */
#include "emg/envelope.h"

#include "base/pi.h"
#include "emg/filter.h"
#include "near.h"
#include "rig.h"

#include <math.h>

#define N 4000

static void signal_of(double *x) {
    uint64_t seed = 7;
    for (int k = 0; k < N; k++) {
        x[k] = rig_force(k / RIG_RATE) * test_random(&seed, -1, 1);
    }
}

static void run(const mhi_emg_section *o, const double *x, double *y, double *settling) {
    mhi_envelope *e = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_envelope_create(o, 1, RIG_RATE, &e, &err), MHE_OK);
    for (int k = 0; k < N; k++) {
        mhi_envelope_step(e, &x[k], &y[k]);
    }
    *settling = mhi_envelope_settling(e);
    mhi_envelope_free(e);
}

static void low_pass_is_filters_in_a_row(void **state) {
    (void)state;
    const mhi_emg_section o = rig_options();
    double x[N], y[N], settling = 0, a[16] = {0}, b[16] = {0};
    mhi_filter band, low;
    mhe_error err = {0};
    signal_of(x);
    run(&o, x, y, &settling);
    assert_int_equal(mhi_filter_band_pass(2, 20, 450, RIG_RATE, &band, &err), MHE_OK);
    assert_int_equal(mhi_filter_low_pass(2, 6, RIG_RATE, &low, &err), MHE_OK);
    const int first = (int)(settling * RIG_RATE + 0.5);
    assert_in_range(first, 100, 400);
    for (int k = 0; k < N; k++) {
        const double want = mhi_filter_step(&low, b, fabs(mhi_filter_step(&band, a, x[k])));
        if (k < first) {
            assert_true(isnan(y[k]));
        } else {
            assert_true(y[k] == want);
        }
    }
}

static void windows_are_means(void **state) {
    (void)state;
    for (int32_t kind = MHI_EMG_AVERAGE; kind <= MHI_EMG_RMS; kind++) {
        mhi_emg_section o = rig_options();
        double x[N], y[N], settling = 0;
        o.band_order = 0;
        o.envelope = kind;
        o.window = 0.05; /* 100 samples */
        signal_of(x);
        run(&o, x, y, &settling);
        for (int k = 200; k < N; k++) {
            double sum = 0;
            for (int i = k - 99; i <= k; i++) {
                sum += kind == MHI_EMG_RMS ? x[i] * x[i] : fabs(x[i]);
            }
            const double mean = kind == MHI_EMG_RMS ? sqrt(sum / 100) : sum / 100;
            assert_near(y[k], mean, 1e-14); /* a hundred additions in another order */
        }
    }
}

/* Shift between the envelope of a modulated carrier and its modulation, by their correlation with
 * the modulation's frequency. */
static void delay_is_that_of_a_modulated_carrier(void **state) {
    (void)state;
    const double pi = MHI_PI, slow = 0.5;
    for (int32_t kind = MHI_EMG_LOW_PASS; kind <= MHI_EMG_RMS; kind++) {
        mhi_emg_section o = rig_options();
        mhi_envelope *e = NULL;
        mhe_error err = {0};
        o.envelope = kind;
        assert_int_equal(mhi_envelope_create(&o, 1, RIG_RATE, &e, &err), MHE_OK);
        const double carrier = mhi_filter_band_centre(20, 450, RIG_RATE);
        double c = 0, s = 0;
        for (int k = 0; k < 12000; k++) {
            const double t = k / RIG_RATE;
            double y = (1 + 0.3 * cos(2 * pi * slow * t)) * sin(2 * pi * carrier * t);
            mhi_envelope_step(e, &y, &y);
            if (k >= 4000) { /* two periods */
                c += y * cos(2 * pi * slow * t);
                s += y * sin(2 * pi * slow * t);
            }
        }
        const double measured = atan2(s, c) / (2 * pi * slow);
        assert_true(mhi_envelope_delay(e) > 0.02);
        assert_near(measured, mhi_envelope_delay(e), 0.0005); /* a sample */
        mhi_envelope_free(e);
    }
}

static int count_missing(const double *y, int from, int to) {
    int n = 0;
    for (int k = from; k < to; k++) {
        n += isnan(y[k]);
    }
    return n;
}

static void gaps_hold_then_begin_anew(void **state) {
    (void)state;
    const mhi_emg_section o = rig_options();
    double x[N], y[N], settling = 0;
    signal_of(x);
    for (int k = 1000; k < 1020; k++) { /* 10 ms */
        x[k] = NAN;
    }
    for (int k = 2000; k < 2100; k++) { /* 50 ms */
        x[k] = INFINITY;
    }
    run(&o, x, y, &settling);
    const int settled = (int)(settling * RIG_RATE + 0.5);
    for (int k = 1000; k < 1020; k++) {
        assert_true(y[k] == y[999]);
    }
    assert_int_equal(count_missing(y, 1020, 2020), 0);
    assert_int_equal(count_missing(y, 2020, 2100 + settled), 80 + settled);
    assert_int_equal(count_missing(y, 2100 + settled, N), 0);
}

static void flat_signals_are_missing(void **state) {
    (void)state;
    const mhi_emg_section o = rig_options();
    double x[N], y[N], settling = 0;
    signal_of(x);
    for (int k = 1000; k < 2500; k++) {
        x[k] = 0.02;
    }
    run(&o, x, y, &settling);
    const int settled = (int)(settling * RIG_RATE + 0.5);
    assert_int_equal(count_missing(y, 1000, 2000), 0);
    assert_int_equal(count_missing(y, 2000, 2500 + settled), 500 + settled);
    assert_int_equal(count_missing(y, 2500 + settled, N), 0);
}

static void zero_phase_has_no_delay_and_spares_gaps(void **state) {
    (void)state;
    for (int32_t kind = MHI_EMG_LOW_PASS; kind <= MHI_EMG_RMS; kind++) {
        mhi_emg_section o = rig_options();
        double x[N];
        mhe_error err = {0};
        o.envelope = kind;
        for (int k = 0; k < N; k++) {
            x[k] = rig_force(k / RIG_RATE) * sin(2 * MHI_PI * 95 * k / RIG_RATE);
        }
        for (int k = 3000; k < 3200; k++) {
            x[k] = NAN;
        }
        assert_int_equal(mhi_envelope_zero_phase(&o, RIG_RATE, x, N, &err), MHE_OK);
        assert_int_equal(count_missing(x, 0, N), 200);
        assert_int_equal(count_missing(x, 3000, 3200), 200);
        const double full = kind == MHI_EMG_RMS ? sqrt(0.5) : 2 / MHI_PI;
        for (int k = 400; k < 2600; k++) { /* 6 Hz twice and 0.1 s flatten 1 Hz by a few percent */
            assert_near(x[k] / full, rig_force(k / RIG_RATE), 0.04);
        }
    }
}

static void corners_above_half_of_the_rate_are_refused(void **state) {
    (void)state;
    const mhi_emg_section o = rig_options();
    mhi_envelope *e = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_envelope_create(&o, 1, 900, &e, &err), MHE_E_INPUT);
    assert_null(e);
    double x[4] = {0};
    assert_int_equal(mhi_envelope_zero_phase(&o, 100, x, 4, &err), MHE_E_INPUT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(low_pass_is_filters_in_a_row),
        cmocka_unit_test(windows_are_means),
        cmocka_unit_test(delay_is_that_of_a_modulated_carrier),
        cmocka_unit_test(gaps_hold_then_begin_anew),
        cmocka_unit_test(flat_signals_are_missing),
        cmocka_unit_test(zero_phase_has_no_delay_and_spares_gaps),
        cmocka_unit_test(corners_above_half_of_the_rate_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
