/* SPDX-License-Identifier: Apache-2.0 */
/* Raw EMG: what the pipeline of core/src/emg makes of it is proportional to the excitation. */
#include "base/pi.h"
#include "config/options.h"
#include "emg/envelope.h"
#include "emg/filter.h"
#include "rig.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RATE 2000.0
#define LOW 20.0
#define HIGH 450.0
#define SETTLED 2000 /* samples */
#define SEEDS 12
#define MVC_A 0.0005
#define MVC_B 0.002

static const char *const keys[] = {"A", "B"};
static const char *const values[] = {"BRA 1", "BRA 0.25, TricepsLat 0.5"};
static const double mvcs[] = {MVC_A, MVC_B};

static mhi_noise two_electrodes(int32_t seed) {
    return (mhi_noise){.seed = seed,
                       .raw_emg = {.clock.rate = RATE,
                                   .electrodes = {.keys = keys, .values = values, .n = 2},
                                   .mvc = {.values = mvcs, .n = 2},
                                   .band_low = LOW,
                                   .band_high = HIGH}};
}

static void record(noise_rig *rig, const mhi_noise *noise, mhi_record *out) {
    if (mhi_noise_raw_emg(noise, rig->truth, rig->model, out, &rig->err) != MHE_OK) {
        fail_msg("%s", rig->err.text);
    }
}

static double excitation(const noise_rig *rig, const char *muscle, int32_t row) {
    for (int32_t i = 0; i < rig->model->n_muscles; i++) {
        if (strcmp(rig->model->muscles[i].name, muscle) == 0) {
            return rig->truth->reference.excitation[row * rig->model->n_muscles + i];
        }
    }
    fail_msg("no muscle %s", muscle);
    return 0;
}

static double read_by(const noise_rig *rig, int32_t electrode, int32_t sample) {
    const int32_t row = sample / 20 < RIG_FRAMES ? sample / 20 : RIG_FRAMES - 1;
    const double bra = excitation(rig, "BRA", row);
    return electrode == 0 ? bra : 0.25 * bra + 0.5 * excitation(rig, "TricepsLat", row);
}

static mhi_emg_section pipeline(void) {
    mhi_emg_section options = {0};
    mhi_arena arena = {0};
    int32_t n = 0;
    const mhe_option *table = mhi_run_section("emg", &n);
    (void)mhi_options_fill(table, n, NULL, NULL, NULL, 0, "emg", NULL, &arena, &options, NULL);
    mhi_arena_free(&arena);
    return options;
}

/* What the pipeline's band-pass leaves of noise of variance 1 in the band: its spread. */
static double left_by_the_band_pass(const mhi_emg_section *o) {
    mhi_filter made, taken;
    double a[2 * MHI_FILTER_SECTIONS_MAX] = {0}, b[2 * MHI_FILTER_SECTIONS_MAX] = {0};
    double all = 0, left = 0;
    assert_int_equal(mhi_filter_band_pass(4, LOW, HIGH, RATE, &made, NULL), MHE_OK);
    assert_int_equal(
        mhi_filter_band_pass(o->band_order, o->band_low, o->band_high, RATE, &taken, NULL), MHE_OK);
    for (int32_t k = 0; k < 4000; k++) {
        const double h = mhi_filter_step(&made, a, k == 0);
        const double g = mhi_filter_step(&taken, b, h);
        all += h * h;
        left += g * g;
    }
    return sqrt(left / all);
}

/* Slope of the pipeline's envelope over what its low-pass alone makes of mvc times the excitation,
 * and the share of the envelope's spread that this does not explain. */
static double slope(const noise_rig *rig, const mhi_record *emg, int32_t electrode,
                    double *unexplained) {
    const mhi_emg_section o = pipeline();
    mhi_envelope *envelope = NULL;
    mhi_filter low;
    double state[2 * MHI_FILTER_SECTIONS_MAX] = {0}, xy = 0, xx = 0, yy = 0;
    assert_int_equal(mhi_envelope_create(&o, 2, RATE, &envelope, NULL), MHE_OK);
    assert_int_equal(mhi_filter_low_pass(o.low_pass_order, o.low_pass, RATE, &low, NULL), MHE_OK);
    for (int32_t k = 0; k < emg->n_samples; k++) {
        double y[2];
        mhi_envelope_step(envelope, emg->values + 2 * (ptrdiff_t)k, y);
        const double x = mhi_filter_step(&low, state, mvcs[electrode] * read_by(rig, electrode, k));
        if (k >= SETTLED) {
            xy += x * y[electrode];
            xx += x * x;
            yy += y[electrode] * y[electrode];
        }
    }
    mhi_envelope_free(envelope);
    *unexplained = sqrt((yy - xy * xy / xx) / yy);
    return xy / xx;
}

/* Twelve seeds and two electrodes: the mean slope is what the band-pass leaves, within five
 * standard errors (about 0.6 % each); a single envelope is off by about 9 %, as rectified noise is.
 */
static void envelope_is_proportional_to_the_excitation(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    const mhi_emg_section o = pipeline();
    const double expected = left_by_the_band_pass(&o);
    assert_true(expected > 0.9 && expected < 1);
    for (int32_t electrode = 0; electrode < 2; electrode++) {
        double sum = 0, squares = 0;
        for (int32_t seed = 0; seed < SEEDS; seed++) {
            const mhi_noise noise = two_electrodes(seed);
            mhi_record emg;
            double unexplained = 0;
            record(&rig, &noise, &emg);
            const double s = slope(&rig, &emg, electrode, &unexplained);
            assert_true(unexplained > 0.04 && unexplained < 0.16);
            sum += s;
            squares += s * s;
            mhi_record_free(&emg);
        }
        const double mean = sum / SEEDS;
        const double error = sqrt((squares / SEEDS - mean * mean) / (SEEDS - 1));
        assert_true(error < 0.015);
        assert_within_5(mean, expected, error, keys[electrode]);
    }
    rig_close(&rig);
}

/* A constant excitation: variance as said, rectified mean mvc, and nearly nothing below the band
 * (mean over 50 ms) or in common with another electrode. */
static void the_signal_is_noise_in_the_band(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    for (int32_t i = 0; i < RIG_FRAMES * rig.model->n_muscles; i++) {
        rig.truth->reference.excitation[i] = 0.4;
    }
    const mhi_noise noise = two_electrodes(3);
    mhi_record emg;
    record(&rig, &noise, &emg);
    const int32_t n = emg.n_samples;
    double rectified = 0, square = 0, both = 0, other = 0, slow = 0;
    for (int32_t k = 0; k + 100 <= n; k += 100) {
        double mean = 0;
        for (int32_t j = k; j < k + 100; j++) {
            const double a = emg.values[2 * j], b = emg.values[2 * j + 1];
            mean += a / 100;
            rectified += fabs(a);
            square += a * a;
            other += b * b;
            both += a * b;
        }
        slow += mean * mean * 100;
    }
    const double deviates = n * (HIGH - LOW) / (RATE / 2); /* independent ones: about this many */
    const double mvc = 0.4 * MVC_A;
    assert_within_5(rectified / n / mvc, 1, sqrt((MHI_PI / 2 - 1) / deviates), "rectified mean");
    assert_within_5(square / n / (MHI_PI / 2 * mvc * mvc), 1, sqrt(2 / deviates), "variance");
    assert_within_5(both / sqrt(square * other), 0, sqrt(1 / deviates), "common part");
    assert_true(slow < 0.02 * square); /* white noise: 1 */
    mhi_record_free(&emg);
    rig_close(&rig);
}

static void seeds_streams_and_the_amplifier(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    mhi_noise noise = two_electrodes(5);
    mhi_record first, second;
    record(&rig, &noise, &first);
    assert_int_equal(first.n_samples, 16001);
    assert_int_equal(first.n_channels, 2);
    record(&rig, &noise, &second);
    assert_memory_equal(first.values, second.values, sizeof(double) * 32002);
    mhi_record_free(&second);
    noise.raw_emg.amplifier_sd = 1e-5; /* added to the same signal */
    record(&rig, &noise, &second);
    double square = 0;
    for (int32_t i = 0; i < 32002; i++) {
        const double more = second.values[i] - first.values[i];
        square += more * more / 32002;
    }
    assert_within_5(square, 1e-10, 1e-10 * sqrt(2.0 / 32002), "variance of the amplifier");
    mhi_record_free(&second);
    noise = two_electrodes(6);
    record(&rig, &noise, &second);
    assert_memory_not_equal(first.values, second.values, sizeof(double) * 32002);
    mhi_record_free(&second);
    mhi_record_free(&first);
    rig_close(&rig);
}

static void refused(noise_rig *rig, const mhi_noise *noise, const char *text) {
    mhi_record emg;
    assert_int_equal(mhi_noise_raw_emg(noise, rig->truth, rig->model, &emg, &rig->err),
                     MHE_E_CONFIG);
    assert_null(emg.values);
    if (strstr(rig->err.text, text) == NULL) {
        fail_msg("'%s' is not in '%s'", text, rig->err.text);
    }
}

static void bad_options(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    static const double three[] = {1, 1, 1};
    static const char *const slip[] = {"BRX 1"}, *const bare[] = {"BRA"};
    mhi_noise noise = two_electrodes(1);
    noise.raw_emg.electrodes.n = 0;
    refused(&rig, &noise, "there are no 'electrodes'");
    noise = two_electrodes(1);
    noise.raw_emg.mvc = (mhe_real_list){.values = three, .n = 3};
    refused(&rig, &noise, "'mvc' has 3 values; 1 or one for each of the 2 electrodes");
    noise = two_electrodes(1);
    noise.raw_emg.clock.rate = 800;
    refused(&rig, &noise, "noise.raw_emg: a band-pass from 20 to 450 Hz needs");
    noise = two_electrodes(1);
    noise.raw_emg.mvc.n = 1;
    noise.raw_emg.electrodes = rig_map(keys, slip);
    refused(&rig, &noise, "electrodes: 'BRX' is no muscle of the model (did you mean 'BRA'");
    noise.raw_emg.electrodes = rig_map(keys, bare);
    refused(&rig, &noise, "'BRA' of 'A' is no list of muscles and fractions");
    mhi_recording *recording = NULL;
    noise = two_electrodes(1);
    assert_int_equal(mhi_noise_recording(&noise, rig.truth, rig.model, rig.plugin, rig.config,
                                         test_host(), &recording, &rig.err),
                     MHE_E_CONFIG);
    assert_null(recording);
    rig_close(&rig);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(envelope_is_proportional_to_the_excitation),
        cmocka_unit_test(the_signal_is_noise_in_the_band),
        cmocka_unit_test(seeds_streams_and_the_amplifier),
        cmocka_unit_test(bad_options),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
