/* SPDX-License-Identifier: Apache-2.0 */
/* A second of the real abduction: the model holds it, and faults of the data move the estimate by
 * no more than they should. Skipped where the reference data are absent. */
#include "base/pi.h"
#include "believe/exchange.h"
#include "support.h"
#include "track.h"

#include <math.h>
#include <string.h>

#define DEGREES (180 / MHI_PI)

static const char by_activations[] = "abduction.yaml", by_excitations[] = "excitation.yaml";
static track whole, faulty; /* large */

static int measure_whole(void **state) {
    (void)state;
    assert_true(track_open(&whole, by_activations, NULL, 0));
    track_run(&whole);
    return 0;
}

static int close_all(void **state) {
    (void)state;
    track_close(&whole);
    return 0;
}

static double mean(const double *values, int32_t n, int32_t stride) {
    double sum = 0;
    for (int32_t i = 0; i < n; i++) {
        sum += values[(ptrdiff_t)i * stride];
    }
    return sum / n;
}

static void expect_held(const track *t) {
    const int32_t n_q = t->model->n_coordinates, n_m = t->model->n_muscles, n = t->n_estimates;
    const int32_t shoulder = track_coordinate(t, "humerus_shoulder_ele_RotY");
    const double rms = mean(t->marker_rms, n, 1), ik = mean(t->ik_rms, n, 1);
    double apart = 0;
    for (int32_t k = 0; k < n; k++) {
        apart = fmax(apart, fabs(t->q[k * n_q + shoulder] - t->ik_q[k * n_q + shoulder]));
    }
    print_message("markers %.1f mm (inverse kinematics %.1f mm), elevation %.1f to %.1f degrees, "
                  "at most %.1f from it; %d of %d converged\n",
                  1e3 * rms, 1e3 * ik, DEGREES * t->q[shoulder],
                  DEGREES * t->q[(n - 1) * n_q + shoulder], DEGREES * apart, t->n_converged, n);
    assert_true(t->n_converged >= n * 95 / 100);
    assert_int_equal(t->n_predicted, 0);
    assert_true(ik > 0.009 && ik < 0.017); /* as the data's own description says */
    assert_true(rms < 1.2 * ik);           /* the price of a motion the muscles can make */
    assert_true(DEGREES * apart < 5);
    for (int32_t i = 0; i < n_m; i++) {
        int32_t n_full = 0;
        for (int32_t k = 0; k < n; k++) {
            const double a = t->activation[k * n_m + i], force = t->force[k * n_m + i];
            n_full += a > 0.999;
            assert_true(a >= -1e-6 && a <= 1 + 1e-6);
            assert_true(force >= -1 && force < 1500);
        }
        assert_true(n_full < n / 10);
    }
    /* abduction: deltoid and supraspinatus lead, the muscles that adduct rest */
    const double deltoid = mean(t->activation + track_muscle(t, "DELTmed"), n, n_m);
    const double supraspinatus = mean(t->activation + track_muscle(t, "SUPSP"), n, n_m);
    const double latissimus = mean(t->activation + track_muscle(t, "LAT"), n, n_m);
    const double pectoralis = mean(t->activation + track_muscle(t, "PECM3"), n, n_m);
    print_message("activations: deltoid %.2f, supraspinatus %.2f, latissimus %.2f, pectoralis "
                  "%.2f\n",
                  deltoid, supraspinatus, latissimus, pectoralis);
    assert_true(deltoid > 0.1 && supraspinatus > 0.1);
    assert_true(latissimus < 0.5 * deltoid && pectoralis < 0.5 * deltoid);
    for (int32_t i = 0; i < n_m; i++) {
        const double other = mean(t->activation + i, n, n_m);
        assert_true(other <= fmax(deltoid, supraspinatus));
    }
}

static void recording_is_held(void **state) {
    (void)state;
    expect_held(&whole);
}

/* The same with the activations as states: nearly the same motion. */
static void held_by_excitations(void **state) {
    (void)state;
    assert_true(track_open(&faulty, by_excitations, NULL, 0));
    track_run(&faulty);
    expect_held(&faulty);
    const double q = DEGREES * track_change(&whole, whole.q, faulty.q, whole.model->n_coordinates);
    print_message("joint angles %.2f degrees from those by activations\n", q);
    assert_true(q > 0 && q < 2);
    track_close(&faulty);
}

/* Runs the damaged piece; the RMS changes of angles (degrees) and forces (N) must stay below. */
static void expect_change(const char *fault, double most_q, double most_force) {
    track_run(&faulty);
    const double q = DEGREES * track_change(&whole, whole.q, faulty.q, whole.model->n_coordinates);
    const double force = track_change(&whole, whole.force, faulty.force, whole.model->n_muscles);
    print_message("%s: joint angles %.2f degrees, forces %.1f N apart; %d of %d converged\n", fault,
                  q, force, faulty.n_converged, faulty.n_estimates);
    assert_int_equal(faulty.n_predicted, 0);
    assert_true(q > 0 && q < most_q); /* above 0: the fault was seen */
    assert_true(force < most_force);
    track_close(&faulty);
}

static void open_faulty(const char *const *set, int32_t n_set) {
    assert_true(track_open(&faulty, by_activations, set, n_set));
}

static void third_of_the_markers_missing(void **state) {
    (void)state;
    open_faulty(NULL, 0);
    uint64_t seed = 3;
    for (int32_t i = 0; i < faulty.recording->n_frames * faulty.model->n_markers; i++) {
        if (test_random(&seed, 0, 1) < 0.3) {
            faulty.recording->markers[3 * i] = NAN;
            faulty.recording->markers[3 * i + 1] = NAN;
            faulty.recording->markers[3 * i + 2] = NAN;
        }
    }
    expect_change("30 % of the samples missing", 3, 20);
}

static void segment_hidden_for_half_a_second(void **state) {
    (void)state;
    static const char *const upper_arm[] = {"EPICl", "EPICm", "DELT", "ARMl"};
    open_faulty(NULL, 0);
    for (int32_t k = TRACK_FIRST + 20; k < TRACK_FIRST + 70; k++) {
        for (int i = 0; i < 4; i++) {
            double *marker = track_marker(&faulty, k, upper_arm[i]);
            marker[0] = marker[1] = marker[2] = NAN;
        }
    }
    expect_change("upper arm without markers for 0.5 s", 8, 20);
}

static void three_electrodes_dead(void **state) {
    (void)state;
    static const char *const muscles[] = {"DELTmed", "TRPsup", "TRPsup_bis", "bic_l", "bic_b"};
    open_faulty(NULL, 0);
    for (int32_t k = 0; k < faulty.recording->n_frames; k++) {
        for (int i = 0; i < 5; i++) {
            *track_emg(&faulty, k, muscles[i]) = NAN;
        }
    }
    expect_change("three electrodes dead", 2, 100);
}

/* A reflection that is taken for a marker, for 0.1 s, too near for data.marker_outlier: 0.15 m. */
static void put_outlier(track *t) {
    for (int32_t k = TRACK_FIRST + 40; k < TRACK_FIRST + 50; k++) {
        track_marker(t, k, "DELT")[0] += 0.15;
    }
}

static void robust_loss_resists_an_outlier(void **state) {
    (void)state;
    static const char *const squares[] = {"costs.0.huber=0", "costs.1.huber=0"};
    open_faulty(squares, 2);
    put_outlier(&faulty);
    track_run(&faulty);
    const double plain = track_change(&whole, whole.q, faulty.q, whole.model->n_coordinates);
    track_close(&faulty);
    open_faulty(NULL, 0);
    put_outlier(&faulty);
    track_run(&faulty);
    const double robust = track_change(&whole, whole.q, faulty.q, whole.model->n_coordinates);
    print_message("outlier: %.2f degrees with Huber's loss, %.2f without\n", DEGREES * robust,
                  DEGREES * plain);
    assert_true(robust < 0.5 * plain);
    track_close(&faulty);
}

static void exchange_columns(mhi_recording *r, int32_t n_k, int32_t a, int32_t b) {
    for (int32_t k = 0; k < r->n_frames; k++) {
        for (int32_t i = 0; i < 3; i++) {
            double *row = r->markers + (ptrdiff_t)k * 3 * n_k, value = row[3 * a + i];
            row[3 * a + i] = row[3 * b + i];
            row[3 * b + i] = value;
        }
    }
}

/* Two of a segment, of neighbours, left and right of the elbow: each is found, alone; and none is
 * where all are right. */
static void exchanged_labels_are_named(void **state) {
    (void)state;
    static const char *const pairs[][2] = {
        {"EPICl", "EPICm"}, {"SCAP_IA", "SCAP_AA"}, {"DELT", "ARMl"}, {"CLAV_AC", "Acrom"}};
    mhe_estimator *estimator = NULL;
    mhe_error err = {0};
    mhi_exchange found[3];
    open_faulty(NULL, 0);
    const int32_t n_k = faulty.model->n_markers;
    uint8_t suspect[64];
    memset(suspect, 1, sizeof suspect);
    assert_in_range(n_k, 1, 64);
    if (mhi_estimator_create(faulty.run, &track_host, &estimator, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    const mhi_system *system = mhi_estimator_system(estimator);
    assert_int_equal(mhi_exchange_find(system, faulty.recording, suspect, found, 3), 0);
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        const ptrdiff_t first = track_marker(&faulty, 0, pairs[i][0]) - faulty.recording->markers;
        const ptrdiff_t other = track_marker(&faulty, 0, pairs[i][1]) - faulty.recording->markers;
        const int32_t a = (int32_t)first / 3, b = (int32_t)other / 3;
        exchange_columns(faulty.recording, n_k, a, b);
        assert_int_equal(mhi_exchange_find(system, faulty.recording, suspect, found, 3), 1);
        print_message("%s and %s: %.1f mm, exchanged %.1f mm\n", pairs[i][0], pairs[i][1],
                      1e3 * found[0].as_is, 1e3 * found[0].fixed);
        assert_true((found[0].a == a && found[0].b == b) || (found[0].a == b && found[0].b == a));
        exchange_columns(faulty.recording, n_k, a, b);
    }
    mhe_estimator_close(estimator);
    track_close(&faulty);
}

int main(void) {
    char data[512];
    if (test_data_path(data, sizeof data, "abduction") == NULL) {
        (void)puts("the recording is absent: skipped");
        return TEST_SKIPPED;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(recording_is_held),
        cmocka_unit_test(held_by_excitations),
        cmocka_unit_test(third_of_the_markers_missing),
        cmocka_unit_test(segment_hidden_for_half_a_second),
        cmocka_unit_test(three_electrodes_dead),
        cmocka_unit_test(robust_loss_resists_an_outlier),
        cmocka_unit_test(exchanged_labels_are_named),
    };
    return cmocka_run_group_tests(tests, measure_whole, close_all);
}
