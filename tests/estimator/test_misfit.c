/* SPDX-License-Identifier: Apache-2.0 */
/* mhe.cost.emg-markers takes the markers' noise from how far they stay from the model, and that of
 * EMG from how much a channel varies, of which little is known at the start. */
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <string.h>

#define N_M 19
#define N_K 8
#define RATIO 3
#define WINDOW 4
#define SKIP 10
#define FIRST 30 /* frames */
#define MODELS MHE_TEST_SOURCE_DIR "/models/arm19/"

typedef struct outcome {
    double force, angle;    /* root of the mean squared error */
    double first_angle;     /* of the first frames alone */
    double last_force[N_M]; /* of the last estimate */
} outcome;

/* Of a frame's angles. */
static double squares_of(const mhe_estimate *e, const double *truth) {
    double sum = 0;
    for (int32_t j = 0; j < 4; j++) {
        sum += (e->q[j] - truth[j]) * (e->q[j] - truth[j]);
    }
    return sum;
}

/* With every marker's place `off` (m), a direction each, and the truth's EMG, but of a muscle that
 * is `silent` (NULL: none). */
static outcome run_with(const char *cost, const char *data, double off, const char *silent) {
    test_fixture f;
    mhi_recording *r = NULL;
    char yaml[2048];
    outcome out = {0};
    int32_t n = 0;
    uint64_t seed = 16;
    double offset[3 * N_K];
    (void)snprintf(yaml, sizeof yaml,
                   "model: {file: $ARM19}\nmuscle: {curves: paper2021, passive_ramp: 0.02}\n"
                   "data: {markers: " MODELS "demo_markers.trc, emg: " MODELS "demo_emg.sto, "
                   "reference: " MODELS "demo_reference.sto%s}\n"
                   "horizon: {window: 4, ratio: 3}\ncosts: [%s]\n",
                   data, cost);
    if (test_fixture_open(&f, yaml) != MHE_OK ||
        mhi_recording_read(f.run, mhi_system_description(f.system), &f.host, &r, &f.err) !=
            MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    for (int32_t i = 0; i < 3 * N_K; i++) {
        offset[i] = off * test_random(&seed, -1, 1);
    }
    for (int32_t k = 0; k < r->n_frames; k++) {
        mhe_frame frame = mhi_recording_frame(r, N_K, N_M, k);
        double markers[3 * N_K], emg[N_M];
        for (int32_t i = 0; i < 3 * N_K; i++) {
            markers[i] = frame.markers[i] + offset[i];
        }
        for (int32_t m = 0; m < N_M && frame.emg != NULL; m++) {
            const char *name = mhi_system_description(f.system)->muscles[m].name;
            emg[m] = silent != NULL && strcmp(name, silent) == 0 ? 0 : frame.emg[m];
        }
        frame.markers = markers;
        frame.emg = frame.emg == NULL ? NULL : emg;
        mhe_estimate e = {.size = sizeof e};
        int32_t ready = 0;
        assert_int_equal(mhe_estimator_push(f.estimator, &frame, &e, &ready, &f.err), MHE_OK);
        if (!ready) {
            continue;
        }
        const int32_t at = k - WINDOW * RATIO;
        if (n++ < FIRST) {
            out.first_angle += squares_of(&e, r->reference.q + at * 4) / (4 * FIRST);
        }
        if (n <= SKIP) {
            continue;
        }
        for (int32_t m = 0; m < N_M; m++) {
            const double d = e.force[m] - r->reference.force[at * N_M + m];
            out.force += d * d;
        }
        out.angle += squares_of(&e, r->reference.q + at * 4);
        memcpy(out.last_force, e.force, sizeof out.last_force);
    }
    out.force = sqrt(out.force / ((n - SKIP) * N_M));
    out.angle = sqrt(out.angle / ((n - SKIP) * 4));
    out.first_angle = sqrt(out.first_angle);
    mhi_recording_free(r);
    test_fixture_close(&f);
    return out;
}

static outcome run(const char *cost, double off, const char *silent) {
    return run_with(cost, "", off, silent);
}

/* Markers that are off by the same in all frames say how fast the arm moves as well as ever. With
 * velocities measured they may be far off for the posture without the motion following EMG. */
static void velocities_are_free_of_offsets(void **state) {
    (void)state;
    const outcome without = run("mhe.cost.emg-markers", 0.015, NULL);
    const outcome with = run_with("mhe.cost.emg-markers", ", rates: true", 0.015, NULL);
    const outcome exact = run_with("mhe.cost.emg-markers", ", rates: true", 0, NULL);
    print_message("force %.2f N and %.2f N (%.2f), angles %.4f and %.4f rad (%.4f)\n",
                  without.force, with.force, exact.force, without.angle, with.angle, exact.angle);
    assert_true(with.force < without.force);
    assert_true(with.angle < without.angle);
    assert_true(exact.angle < 1e-3 && exact.force < 2);
}

/* Markers a centimetre off that are believed to a millimetre bend the forces; those of a model that
 * they fit change nothing. */
static void markers_that_do_not_fit_are_believed_less(void **state) {
    (void)state;
    const outcome firm = run("{plugin: mhe.cost.emg-markers, markers_misfit: 0}", 0.015, NULL);
    const outcome learnt = run("{plugin: mhe.cost.emg-markers, markers_misfit: 1}", 0.015, NULL);
    print_message("force %.2f N and %.2f N, angles %.4f and %.4f rad\n", firm.force, learnt.force,
                  firm.angle, learnt.angle);
    assert_true(learnt.force < 0.9 * firm.force);
    assert_true(learnt.angle < firm.angle);
    const outcome fits = run("{plugin: mhe.cost.emg-markers, markers_misfit: 1}", 0, NULL);
    const outcome fits_firm = run("{plugin: mhe.cost.emg-markers, markers_misfit: 0}", 0, NULL);
    assert_memory_equal(fits.last_force, fits_firm.last_force, sizeof fits.last_force);
}

/* EMG that is silent from the first frame on has varied by nothing. Were it believed to the last
 * for it, the arm would hang where its muscle does nothing. */
static void a_silent_channel_does_not_move_the_arm(void **state) {
    (void)state;
    const outcome all = run("mhe.cost.emg-markers", 0, NULL);
    const outcome silent = run("mhe.cost.emg-markers", 0, "Deltoid2");
    const outcome paper = run("mhe.cost.emg-markers-high", 0, "Deltoid2");
    print_message(
        "first angles %.5f rad, with a silent channel %.5f, by the paper's weights %.5f\n",
        all.first_angle, silent.first_angle, paper.first_angle);
    assert_true(silent.first_angle < 2 * paper.first_angle);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(markers_that_do_not_fit_are_believed_less),
        cmocka_unit_test(velocities_are_free_of_offsets),
        cmocka_unit_test(a_silent_channel_does_not_move_the_arm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
