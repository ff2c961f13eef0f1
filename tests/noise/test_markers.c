/* SPDX-License-Identifier: Apache-2.0 */
/* The markers' errors, seen from the segments: probes on every body give its frame over time. */
#include "base/arena.h"
#include "rig.h"

#include <math.h>
#include <string.h>

static double *at(const mhi_record *r, int32_t k, int32_t marker) {
    return r->values + (ptrdiff_t)k * r->n_channels + 3 * marker;
}

/* Every marker's position in its body: out [n_samples x n_channels]. Probes at the body's origin
 * and at the ends of its unit vectors are recorded along the same motion. */
static void to_segments(noise_rig *rig, const mhi_record *record, mhi_record *out) {
    const mhe_description *d = rig->model;
    mhi_arena arena = {0};
    mhe_description probed = *d;
    mhe_marker *probes = MHI_TAKE(&arena, mhe_marker, 4 * d->n_bodies);
    for (int32_t i = 0; i < 4 * d->n_bodies; i++) {
        probes[i] = (mhe_marker){.name = "probe", .body = i / 4};
        if (i % 4 > 0) {
            probes[i].location[i % 4 - 1] = 1;
        }
    }
    probed.markers = probes;
    probed.n_markers = 4 * d->n_bodies;
    const mhi_noise none = {0};
    mhi_record frames;
    assert_int_equal(mhi_noise_markers(&none, rig->truth, &probed, rig->plugin, rig->config,
                                       test_host(), &frames, &rig->err),
                     MHE_OK);
    assert_int_equal(frames.n_samples, record->n_samples);
    assert_int_equal(mhi_noise_markers(&none, rig->truth, d, rig->plugin, rig->config, test_host(),
                                       out, &rig->err),
                     MHE_OK);
    for (int32_t k = 0; k < record->n_samples; k++) {
        for (int32_t i = 0; i < d->n_markers; i++) {
            const double *origin = at(&frames, k, 4 * d->markers[i].body);
            for (int32_t axis = 0; axis < 3; axis++) {
                const double *end = origin + 3 * (axis + 1);
                double sum = 0;
                for (int32_t c = 0; c < 3; c++) {
                    sum += (end[c] - origin[c]) * (at(record, k, i)[c] - origin[c]);
                }
                at(out, k, i)[axis] = sum;
            }
        }
    }
    mhi_record_free(&frames);
    mhi_arena_free(&arena);
}

static void no_noise_is_the_model(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    const mhi_noise none = {0};
    mhi_record markers, local;
    rig_markers(&rig, &none, &markers);
    assert_int_equal(markers.n_samples, RIG_FRAMES);
    to_segments(&rig, &markers, &local);
    for (int32_t k = 0; k < RIG_FRAMES; k++) {
        for (int32_t i = 0; i < rig.model->n_markers; i++) {
            for (int32_t axis = 0; axis < 3; axis++) {
                assert_true(fabs(at(&local, k, i)[axis] - rig.model->markers[i].location[axis]) <
                            1e-12);
            }
        }
    }
    mhi_record_free(&markers);
    mhi_record_free(&local);
    rig_close(&rig);
}

/* Displacements do not change in the segment; over seeds, markers and axes they are N(0, sd). */
static void offsets(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    const double sd = 0.005;
    const int32_t seeds = 40, n = seeds * 3 * rig.model->n_markers;
    double mean = 0, square = 0;
    for (int32_t seed = 0; seed < seeds; seed++) {
        const mhi_noise noise = {.seed = seed, .markers.sd = sd};
        mhi_record markers, local;
        rig_markers(&rig, &noise, &markers);
        to_segments(&rig, &markers, &local);
        for (int32_t i = 0; i < rig.model->n_markers; i++) {
            for (int32_t axis = 0; axis < 3; axis++) {
                const double offset = at(&local, 0, i)[axis] - rig.model->markers[i].location[axis];
                mean += offset / n;
                square += offset * offset / n;
                for (int32_t k = 1; k < RIG_FRAMES; k++) {
                    assert_true(fabs(at(&local, k, i)[axis] - at(&local, 0, i)[axis]) < 1e-12);
                }
            }
        }
        mhi_record_free(&markers);
        mhi_record_free(&local);
    }
    assert_within_5(mean, 0, sd / sqrt(n), "mean offset");
    assert_within_5(square, sd * sd, sd * sd * sqrt(2.0 / n), "variance of the offset");
    rig_close(&rig);
}

static void a_seed_is_a_trial(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    mhi_noise noise = {
        .seed = 3, .markers = {.sd = 0.01, .white_sd = 1e-3, .drift_sd = 1e-3, .drift_time = 1}};
    mhi_record first, again, other;
    rig_markers(&rig, &noise, &first);
    noise.emg = (mhi_emg_noise){.level = 2, .gain_sd = 1};
    rig_markers(&rig, &noise, &again);
    noise.seed = 4;
    rig_markers(&rig, &noise, &other);
    const size_t bytes = sizeof(double) * (size_t)(RIG_FRAMES * first.n_channels);
    assert_memory_equal(first.values, again.values, bytes);
    assert_memory_not_equal(first.values, other.values, bytes);
    mhi_record_free(&first);
    mhi_record_free(&again);
    mhi_record_free(&other);
    rig_close(&rig);
}

/* Differences from the noiseless record. */
static void added(noise_rig *rig, const mhi_noise *noise, mhi_record *out) {
    const mhi_noise none = {0};
    mhi_record clean;
    rig_markers(rig, &none, &clean);
    rig_markers(rig, noise, out);
    for (int32_t i = 0; i < out->n_samples * out->n_channels; i++) {
        out->values[i] -= clean.values[i];
    }
    mhi_record_free(&clean);
}

static void white_noise(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    const double sd = 0.002;
    const mhi_noise noise = {.seed = 8, .markers.white_sd = sd};
    mhi_record e;
    added(&rig, &noise, &e);
    const int32_t n = e.n_samples * e.n_channels, n_c = e.n_channels;
    double mean = 0, square = 0, next = 0, beside = 0;
    for (int32_t i = 0; i < n; i++) {
        mean += e.values[i] / n;
        square += e.values[i] * e.values[i] / n;
        next += i + n_c < n ? e.values[i] * e.values[i + n_c] / n : 0;
        beside += i + 1 < n ? e.values[i] * e.values[i + 1] / n : 0;
    }
    assert_within_5(mean, 0, sd / sqrt(n), "mean");
    assert_within_5(square, sd * sd, sd * sd * sqrt(2.0 / n), "variance");
    assert_within_5(next, 0, sd * sd / sqrt(n), "correlation in time");
    assert_within_5(beside, 0, sd * sd / sqrt(n), "correlation between axes and markers");
    mhi_record_free(&e);
    rig_close(&rig);
}

/* Over seeds: variance drift_sd^2 at the first and the last sample, correlation exp(-t / time). */
static void drift(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    const double sd = 0.003, time = 0.7;
    const int32_t seeds = 100, lag = 35, last = RIG_FRAMES - 1;
    const int32_t n = seeds * 3 * rig.model->n_markers;
    double first_square = 0, last_square = 0, product = 0;
    for (int32_t seed = 0; seed < seeds; seed++) {
        const mhi_noise noise = {.seed = seed, .markers = {.drift_sd = sd, .drift_time = time}};
        mhi_record e;
        added(&rig, &noise, &e);
        for (int32_t c = 0; c < e.n_channels; c++) {
            const double a = e.values[c], b = e.values[(ptrdiff_t)lag * e.n_channels + c];
            const double z = e.values[(ptrdiff_t)last * e.n_channels + c];
            first_square += a * a / n;
            last_square += z * z / n;
            product += a * b / n;
        }
        mhi_record_free(&e);
    }
    const double rho = exp(-lag / RIG_RATE / time);
    assert_within_5(first_square, sd * sd, sd * sd * sqrt(2.0 / n), "variance at the start");
    assert_within_5(last_square, sd * sd, sd * sd * sqrt(2.0 / n), "variance at the end");
    assert_within_5(product, rho * sd * sd, sd * sd * sqrt((1 + rho * rho) / n), "correlation");
    rig_close(&rig);
}

static void gaps(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    static const char *const marker[] = {"EPICl"}, *const spans[] = {"1..1.5, 2..2.1"};
    static const char *const segment[] = {"LowerArm1"}, *const span[] = {"4..8"};
    const mhi_noise noise = {
        .markers = {.gaps = rig_map(marker, spans), .segment_gaps = rig_map(segment, span)}};
    mhi_record record;
    rig_markers(&rig, &noise, &record);
    int32_t of_segment = 0;
    for (int32_t i = 0; i < rig.model->n_markers; i++) {
        const mhe_marker *m = &rig.model->markers[i];
        const int lower = strcmp(rig.model->bodies[m->body].name, "LowerArm1") == 0;
        of_segment += lower;
        for (int32_t k = 0; k < RIG_FRAMES; k++) {
            const double t = record.time[k];
            const int hidden =
                (strcmp(m->name, "EPICl") == 0 && ((t >= 1 && t <= 1.5) || (t >= 2 && t <= 2.1))) ||
                (lower && t >= 4 && t <= 8);
            for (int32_t axis = 0; axis < 3; axis++) {
                assert_int_equal(isnan(at(&record, k, i)[axis]) != 0, hidden);
            }
        }
    }
    assert_true(of_segment > 0);
    mhi_record_free(&record);
    rig_close(&rig);
}

/* Markers between the rows against those of the motion itself: with velocities the error of a cubic
 * Hermite polynomial, h^4 / 384 |q''''|, is below 1e-9 rad; without, h^2 / 8 |q''| below 1e-4. */
static void clock_between_rows(void **state) {
    (void)state;
    for (int with_speed = 1; with_speed >= 0; with_speed--) {
        noise_rig rig;
        rig_open(&rig);
        const int32_t n_q = rig.model->n_coordinates;
        if (!with_speed) {
            for (int32_t i = 0; i < RIG_FRAMES * n_q; i++) {
                rig.truth->reference.qdot[i] = NAN;
            }
        }
        const mhi_noise noise = {.markers.clock = {.rate = 83.3, .latency = 0.0031}};
        mhi_record markers, exact;
        rig_markers(&rig, &noise, &markers);
        assert_int_equal(markers.n_samples, 667);         /* floor(8 s 83.3 Hz) + 1 */
        for (int32_t k = 0; k < markers.n_samples; k++) { /* a reference with those rows */
            rig.truth->time[k] = markers.time[k];
            for (int32_t i = 0; i < n_q; i++) {
                rig.truth->reference.q[k * n_q + i] =
                    rig_q(i, fmax(markers.time[k] - 0.0031, 0.25));
            }
        }
        rig.truth->n_frames = markers.n_samples;
        const mhi_noise none = {0};
        rig_markers(&rig, &none, &exact);
        double worst = 0;
        for (int32_t i = 0; i < exact.n_samples * exact.n_channels; i++) {
            worst = fmax(worst, fabs(markers.values[i] - exact.values[i]));
        }
        assert_true(worst < (with_speed ? 1e-8 : 1e-4));
        assert_true(worst > 0);
        mhi_record_free(&markers);
        mhi_record_free(&exact);
        rig_close(&rig);
    }
}

static void refused(noise_rig *rig, const mhi_noise *noise, mhe_status status, const char *text) {
    mhi_record out;
    assert_int_equal(mhi_noise_markers(noise, rig->truth, rig->model, rig->plugin, rig->config,
                                       test_host(), &out, &rig->err),
                     status);
    assert_null(out.values);
    if (strstr(rig->err.text, text) == NULL) {
        fail_msg("'%s' is not in '%s'", text, rig->err.text);
    }
}

static void bad_options(void **state) {
    (void)state;
    noise_rig rig;
    rig_open(&rig);
    static const char *const slip[] = {"DELTT"}, *const body[] = {"LoweArm1"};
    static const char *const right[] = {"DELT"}, *const span[] = {"1..2"}, *const bad[] = {"2..1"};
    mhi_noise noise = {.markers.gaps = rig_map(slip, span)};
    refused(&rig, &noise, MHE_E_CONFIG, "gaps: 'DELTT' is no marker of the model (did you mean");
    noise = (mhi_noise){.markers.segment_gaps = rig_map(body, span)};
    refused(&rig, &noise, MHE_E_CONFIG, "segment_gaps: 'LoweArm1' is no segment");
    noise = (mhi_noise){.markers.gaps = rig_map(right, bad)};
    refused(&rig, &noise, MHE_E_CONFIG, "'2..1' of 'DELT' is no list of spans");
    rig.truth->time[RIG_FRAMES - 1] = 1e9;
    noise = (mhi_noise){.markers.clock.rate = 1e5};
    refused(&rig, &noise, MHE_E_CONFIG, "lower the rate");
    rig.truth->reference.q[9] = NAN;
    refused(&rig, &noise, MHE_E_INPUT, "no value of 'Arm_RotX' at 0.27 s");
    rig_close(&rig);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(no_noise_is_the_model),
                                       cmocka_unit_test(offsets),
                                       cmocka_unit_test(a_seed_is_a_trial),
                                       cmocka_unit_test(white_noise),
                                       cmocka_unit_test(drift),
                                       cmocka_unit_test(gaps),
                                       cmocka_unit_test(clock_between_rows),
                                       cmocka_unit_test(bad_options)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
