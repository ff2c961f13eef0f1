/* SPDX-License-Identifier: Apache-2.0 */
/* The EMG's errors beyond the paper: clocks, crosstalk, gain, failing electrodes. */
#include "rig.h"

#include <math.h>
#include <string.h>

static int32_t muscle(const noise_rig *rig, const char *name) {
    for (int32_t i = 0; i < rig->model->n_muscles; i++) {
        if (strcmp(rig->model->muscles[i].name, name) == 0) {
            return i;
        }
    }
    fail_msg("no muscle %s", name);
    return -1;
}

static double at(const mhi_record *r, int32_t k, int32_t channel) {
    return r->values[(ptrdiff_t)k * r->n_channels + channel];
}

static double true_e(const noise_rig *rig, int32_t k, int32_t channel) {
    return rig->truth->reference.excitation[(ptrdiff_t)k * rig->model->n_muscles + channel];
}

/* 1 000 Hz on a 100 Hz truth: each row is held for ten samples. */
static void rate(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    const mhi_noise noise = {.emg.clock.rate = 1000};
    mhi_record emg;
    rig_emg(&rig, &noise, &emg);
    assert_int_equal(emg.n_samples, 8001);
    assert_true(emg.rate == 1000);
    for (int32_t k = 0; k < emg.n_samples; k++) {
        assert_true(fabs(emg.time[k] - (0.25 + k / 1000.0)) < 1e-12);
        assert_true(at(&emg, k, 3) == true_e(&rig, k / 10, 3));
    }
    mhi_record_free(&emg);
    rig_close(&rig);
}

/* 20 ms late: two rows; before them the reference's first row. Early: the last row. */
static void latency(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    for (int32_t shift = -2; shift <= 2; shift += 4) {
        const mhi_noise noise = {.emg.clock.latency = 0.01 * shift};
        mhi_record emg;
        rig_emg(&rig, &noise, &emg);
        for (int32_t k = 0; k < RIG_FRAMES; k++) {
            int32_t row = k - shift;
            row = row < 0 ? 0 : row >= RIG_FRAMES ? RIG_FRAMES - 1 : row;
            assert_true(at(&emg, k, 7) == true_e(&rig, row, 7));
        }
        mhi_record_free(&emg);
    }
    rig_close(&rig);
}

/* A clock 1 % slow: sample 400 shows row 404. */
static void clock_error(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    const mhi_noise noise = {.emg.clock.clock_error = 0.01};
    mhi_record emg;
    rig_emg(&rig, &noise, &emg);
    for (int32_t k = 0; k <= 700; k += 100) {
        assert_true(at(&emg, k, 0) == true_e(&rig, k + k / 100, 0));
    }
    mhi_record_free(&emg);
    rig_close(&rig);
}

static void crosstalk(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    static const char *const keys[] = {"BRA", "BRD"};
    static const char *const values[] = {"BRD 0.2, BicepsLong 0.1", "BRA\t1"};
    const mhi_noise noise = {.emg.crosstalk = {.keys = keys, .values = values, .n = 2}};
    const int32_t bra = muscle(&rig, "BRA"), brd = muscle(&rig, "BRD");
    const int32_t biceps = muscle(&rig, "BicepsLong");
    mhi_record emg;
    rig_emg(&rig, &noise, &emg);
    for (int32_t k = 0; k < RIG_FRAMES; k++) {
        for (int32_t i = 0; i < emg.n_channels; i++) {
            double expected = true_e(&rig, k, i);
            expected += i == bra   ? 0.2 * true_e(&rig, k, brd) + 0.1 * true_e(&rig, k, biceps)
                        : i == brd ? true_e(&rig, k, bra)
                                   : 0;
            assert_true(fabs(at(&emg, k, i) - expected) < 1e-15);
        }
    }
    mhi_record_free(&emg);
    rig_close(&rig);
}

/* Factors over 200 seeds and all muscles: mean 1, spread gain_sd, constant over a trial. */
static void gain(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    const double sd = 0.15;
    const int32_t n_m = rig.model->n_muscles, seeds = 200, n = n_m * seeds;
    double mean = 0, square = 0;
    for (int32_t seed = 0; seed < seeds; seed++) {
        const mhi_noise noise = {.seed = seed, .emg.gain_sd = sd};
        mhi_record emg;
        rig_emg(&rig, &noise, &emg);
        for (int32_t i = 0; i < n_m; i++) {
            const double factor = at(&emg, 0, i) / true_e(&rig, 0, i);
            mean += factor / n;
            square += (factor - 1) * (factor - 1) / n;
            for (int32_t k = 0; k < RIG_FRAMES; k += 50) {
                assert_true(fabs(at(&emg, k, i) - factor * true_e(&rig, k, i)) < 1e-14);
            }
        }
        mhi_record_free(&emg);
    }
    assert_within_5(mean, 1, sd / sqrt(n), "mean gain");
    assert_within_5(square, sd * sd, sd * sd * sqrt(2.0 / n), "variance of the gain");
    rig_close(&rig);
}

/* A large spread never turns a signal over. */
static void gain_is_not_negative(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    const mhi_noise noise = {.seed = 4, .emg.gain_sd = 5};
    mhi_record emg;
    rig_emg(&rig, &noise, &emg);
    int32_t dead = 0;
    for (int32_t i = 0; i < emg.n_channels; i++) {
        assert_true(at(&emg, 100, i) >= 0);
        dead += at(&emg, 100, i) == 0;
    }
    assert_true(dead > 0);
    mhi_record_free(&emg);
    rig_close(&rig);
}

static void electrode_failure(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    static const char *const key[] = {"TricepsLat"}, *const value[] = {"1..1.5 , 3 .. 4"};
    const int32_t triceps = muscle(&rig, "TricepsLat");
    mhi_noise noise = {.seed = 2, .emg = {.level = 1}};
    mhi_record healthy, emg;
    rig_emg(&rig, &noise, &healthy);
    noise.emg.failures = rig_map(key, value);
    for (noise.emg.failed_electrode = MHI_FAILED_MISSING; noise.emg.failed_electrode < 2;
         noise.emg.failed_electrode++) {
        rig_emg(&rig, &noise, &emg);
        int32_t n_off = 0;
        for (int32_t k = 0; k < RIG_FRAMES; k++) {
            const double t = emg.time[k];
            const int off = (t >= 1 && t <= 1.5) || (t >= 3 && t <= 4);
            n_off += off;
            for (int32_t i = 0; i < emg.n_channels; i++) {
                const double got = at(&emg, k, i);
                if (i != triceps || !off) {
                    assert_true(got == at(&healthy, k, i));
                } else if (noise.emg.failed_electrode == MHI_FAILED_ZERO) {
                    assert_true(got == 0);
                } else {
                    assert_true(isnan(got));
                }
            }
        }
        assert_int_equal(n_off, 51 + 101);
        mhi_record_free(&emg);
    }
    mhi_record_free(&healthy);
    rig_close(&rig);
}

static void refused(noise_rig *rig, const mhi_noise *noise, mhe_status status, const char *text) {
    mhi_record emg;
    assert_int_equal(mhi_noise_emg(noise, rig->truth, rig->model, &emg, &rig->err), status);
    assert_null(emg.values);
    if (strstr(rig->err.text, text) == NULL) {
        fail_msg("'%s' is not in '%s'", text, rig->err.text);
    }
}

static void bad_options(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    static const char *const slip[] = {"TricepLat"}, *const right[] = {"TricepsLat"};
    static const char *const span[] = {"1..2"};
    static const char *const no_spans[] = {"",     "1",     "1..",   "..2",    "2..1",
                                           "a..b", "1..2,", "1...2", "1..inf", "1..2 3..4"};
    static const char *const no_fractions[] = {"", "BRA", "BRA x", "BRA 1.5", "BRA -0.1", "0.2"};
    static const char *const nobody[] = {"BRX 0.1"};
    mhi_noise noise = {.emg.failures = rig_map(slip, span)};
    refused(&rig, &noise, MHE_E_CONFIG, "failures: 'TricepLat' is no muscle of the model (did you");
    for (size_t i = 0; i < sizeof no_spans / sizeof no_spans[0]; i++) {
        noise = (mhi_noise){.emg.failures = rig_map(right, &no_spans[i])};
        refused(&rig, &noise, MHE_E_CONFIG, "is no list of spans");
    }
    for (size_t i = 0; i < sizeof no_fractions / sizeof no_fractions[0]; i++) {
        noise = (mhi_noise){.emg.crosstalk = rig_map(right, &no_fractions[i])};
        refused(&rig, &noise, MHE_E_CONFIG, "is no list of muscles and fractions");
    }
    noise = (mhi_noise){.emg.crosstalk = rig_map(right, nobody)};
    refused(&rig, &noise, MHE_E_CONFIG, "crosstalk: 'BRX' is no muscle");
    noise = (mhi_noise){.emg = {.level = 1, .clock.rate = 2}};
    refused(&rig, &noise, MHE_E_INPUT, "needs more than 32 samples of EMG; there are 17");
    rig.truth->reference.excitation[3 * rig.model->n_muscles + 1] = NAN;
    noise = (mhi_noise){0};
    refused(&rig, &noise, MHE_E_INPUT, "no excitation of 'Pectoral3' at 0.28 s");
    rig_close(&rig);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(rate),
                                       cmocka_unit_test(latency),
                                       cmocka_unit_test(clock_error),
                                       cmocka_unit_test(crosstalk),
                                       cmocka_unit_test(gain),
                                       cmocka_unit_test(gain_is_not_negative),
                                       cmocka_unit_test(electrode_failure),
                                       cmocka_unit_test(bad_options)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
