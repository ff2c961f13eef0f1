/* SPDX-License-Identifier: Apache-2.0 */
/* How a run begins, where its first frames are not as they should be: no markers, a clock in ms,
 * long gaps; and how it is told to stop. */
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <string.h>

#define N 7
#define N_Q 4
#define N_M 19
#define N_K 8
#define MODELS MHE_TEST_SOURCE_DIR "/models/arm19/"
#define CONFIG                                                                   \
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"                       \
    "data: {markers: " MODELS "demo_markers.trc, emg: " MODELS "demo_emg.sto,\n" \
    "       reference: " MODELS "demo_reference.sto}\nhorizon: {window: 7}\n"    \
    "costs: [mhe.cost.emg-markers-high]\nsolver: {plugin: mhe.solver.rti, preset: speed}\n"

typedef struct rig {
    test_fixture f;
    mhi_recording *recording;
    double markers[3 * N_K];
} rig;

static void rig_open(rig *r) {
    if (test_fixture_open(&r->f, CONFIG) != MHE_OK ||
        mhi_recording_read(r->f.run, mhi_system_description(r->f.system), &r->f.host, &r->recording,
                           &r->f.err) != MHE_OK) {
        fail_msg("%s", r->f.err.text);
    }
}

static void rig_close(rig *r) {
    mhi_recording_free(r->recording);
    test_fixture_close(&r->f);
}

/* Frame k at a time of its own; with its markers hidden where asked for. */
static mhe_status push(rig *r, int32_t k, double time, int hidden, mhe_estimate *e,
                       int32_t *ready) {
    mhe_frame frame = mhi_recording_frame(r->recording, N_K, N_M, k);
    for (int32_t i = 0; i < 3 * N_K; i++) {
        r->markers[i] = hidden ? NAN : frame.markers[i];
    }
    frame.markers = r->markers;
    frame.time = time;
    *e = (mhe_estimate){.size = sizeof *e};
    return mhe_estimator_push(r->f.estimator, &frame, e, ready, &r->f.err);
}

/* Largest error of the joint angles, rad. */
static double error_of(const rig *r, const mhe_estimate *e) {
    const int32_t k = (int32_t)lround(100 * e->time);
    double most = 0;
    for (int32_t i = 0; i < N_Q; i++) {
        most = fmax(most, fabs(e->q[i] - r->recording->reference.q[k * N_Q + i]));
    }
    return most;
}

static void no_markers_in_the_first_second(void **state) {
    (void)state;
    rig r;
    mhe_estimate e = {.size = sizeof e};
    int32_t ready = 0, n = 0;
    double most = 0;
    rig_open(&r);
    const int32_t warned = r.f.n_warnings;
    for (int32_t k = 0; k < 200; k++) {
        assert_int_equal(push(&r, k, r.recording->time[k], k < 100, &e, &ready), MHE_OK);
        assert_int_equal(ready, k >= 100 + N);
        most = ready ? fmax(most, error_of(&r, &e)) : most;
        n += ready && e.status == MHE_FRAME_OK;
    }
    print_message("joint angles at most %.4f rad off; %d of 93 converged\n", most, n);
    assert_true(most < 0.02);
    assert_true(n > 80);
    assert_int_equal(r.f.n_warnings, warned + 1); /* said once */
    rig_close(&r);
}

static void no_markers_at_all(void **state) {
    (void)state;
    rig r;
    mhe_estimate e = {.size = sizeof e};
    int32_t ready = 0;
    rig_open(&r);
    for (int32_t k = 0; k < 50; k++) {
        assert_int_equal(push(&r, k, r.recording->time[k], 1, &e, &ready), MHE_OK);
        assert_int_equal(ready, 0);
    }
    rig_close(&r);
}

/* A window of 70 s would be integrated in hundreds of steps an interval. */
static void frames_in_ms(void **state) {
    (void)state;
    rig r;
    mhe_estimate e = {.size = sizeof e};
    int32_t ready = 0;
    rig_open(&r);
    for (int32_t k = 0; k < 20; k++) {
        const mhe_status status = push(&r, k, 1e3 * r.recording->time[k], 0, &e, &ready);
        assert_int_equal(status, k < N ? MHE_OK : MHE_E_INPUT);
    }
    assert_non_null(strstr(r.f.err.text, "10 s apart: are their times in ms"));
    rig_close(&r);
}

static void long_gaps_in_the_first_window(void **state) {
    (void)state;
    rig r;
    mhe_estimate e = {.size = sizeof e};
    int32_t ready = 0;
    rig_open(&r);
    for (int32_t k = 0; k < 40; k++) {
        const double late = k < 3 ? 0 : k < 5 ? 20 : 40;
        assert_int_equal(push(&r, k, late + r.recording->time[k], 0, &e, &ready), MHE_OK);
        assert_int_equal(ready, k >= 5 + N);
    }
    mhe_estimator_info info = {.size = sizeof info};
    mhe_estimator_describe(r.f.estimator, &info);
    assert_float_equal(info.interval, 0.01, 1e-9);
    rig_close(&r);
}

static void told_to_stop(void **state) {
    (void)state;
    static atomic_int stop;
    rig r;
    mhe_estimate e = {.size = sizeof e};
    int32_t ready = 0;
    rig_open(&r);
    mhi_estimator_set_stop(r.f.estimator, &stop);
    for (int32_t k = 0; k < 30; k++) {
        stop = k == 20;
        const mhe_status status = push(&r, k, r.recording->time[k], 0, &e, &ready);
        assert_int_equal(status, stop ? MHE_E_INTERRUPTED : MHE_OK);
        assert_int_equal(ready, k >= N && !stop);
    }
    assert_true(error_of(&r, &e) < 0.02); /* it went on where it was */
    rig_close(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_markers_in_the_first_second),
        cmocka_unit_test(no_markers_at_all),
        cmocka_unit_test(frames_in_ms),
        cmocka_unit_test(long_gaps_in_the_first_window),
        cmocka_unit_test(told_to_stop),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
