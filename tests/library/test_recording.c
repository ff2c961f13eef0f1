/* SPDX-License-Identifier: Apache-2.0 */
/* The demo's files as an application reads them, and its frames through an estimator. */
#include "outside.h"

#include <math.h>
#include <mhe/findings.h>

static mhe_recording *open_recording(mhe_config *config, mhe_recording_info *info) {
    mhe_recording *recording = NULL;
    mhe_error err = {0};
    expect_done(mhe_recording_open(config, &recording, &err), &err);
    *info = (mhe_recording_info){.size = sizeof *info};
    expect_done(mhe_recording_describe(recording, info, &err), &err);
    return recording;
}

static void frames_and_truth_are_there(void **state) {
    (void)state;
    mhe_config *config = read_demo(NULL);
    mhe_recording_info info;
    mhe_error err = {0};
    mhe_recording *recording = open_recording(config, &info);
    assert_int_equal(info.n_q, 4);
    assert_int_equal(info.n_muscles, 19);
    assert_true(info.has_markers && info.has_emg && info.has_reference && !info.has_angles);
    assert_int_equal(info.n_markers_found, info.n_markers);
    assert_int_equal(info.emg_channels, 0);
    assert_true(fabs(info.rate - 100) < 1e-6);
    assert_string_equal(info.muscle_names[0], "Pectoral2");
    mhe_frame frame = {.size = sizeof frame};
    mhe_truth truth = {.size = sizeof truth};
    for (int32_t k = 0; k < info.n_frames; k += 50) {
        expect_done(mhe_recording_frame(recording, k, &frame, &err), &err);
        assert_true(frame.time == info.time[k]);
        assert_true(frame.markers != NULL && !isnan(frame.markers[0]));
        expect_done(mhe_recording_truth(recording, k, &truth, &err), &err);
        assert_true(truth.time == info.time[k] && fabs(truth.q[0]) < 3);
    }
    mhe_recording_close(recording);
    mhe_config_close(config);
}

static void nothing_is_written_beyond_the_callers_size(void **state) {
    (void)state;
    struct {
        mhe_frame frame;
        unsigned char behind[64];
    } shorter;
    mhe_config *config = read_demo(NULL);
    mhe_recording_info info;
    mhe_error err = {0};
    mhe_recording *recording = open_recording(config, &info);
    memset(&shorter, 0x5a, sizeof shorter);
    const size_t known = offsetof(mhe_frame, emg); /* of a program that knows no EMG yet */
    shorter.frame.size = (uint32_t)known;
    expect_done(mhe_recording_frame(recording, 3, &shorter.frame, &err), &err);
    assert_int_equal(shorter.frame.size, known);
    assert_true(shorter.frame.time == info.time[3]);
    for (size_t i = known; i < sizeof shorter; i++) {
        assert_int_equal(((unsigned char *)&shorter)[i], 0x5a);
    }
    shorter.frame.size = 0;
    assert_int_equal(mhe_recording_frame(recording, 3, &shorter.frame, &err), MHE_E_ARGUMENT);
    assert_string_equal(err.text, "mhe_recording_frame: a struct whose 'size' is not set");
    mhe_recording_close(recording);
    mhe_config_close(config);
}

static void what_is_not_there_is_refused(void **state) {
    (void)state;
    mhe_config *config = read_demo("data.reference=null");
    mhe_recording_info info;
    mhe_error err = {0};
    mhe_recording *recording = open_recording(config, &info), *none = NULL;
    mhe_frame frame = {.size = sizeof frame};
    mhe_truth truth = {.size = sizeof truth};
    assert_int_equal(mhe_recording_frame(recording, -1, &frame, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_recording_frame(recording, info.n_frames, &frame, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_recording_truth(recording, 0, &truth, &err), MHE_E_INPUT);
    assert_string_equal(err.text, "the recording has no reference");
    assert_int_equal(mhe_recording_frame(NULL, 0, &frame, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_recording_frame(recording, 0, NULL, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_recording_describe(recording, NULL, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_recording_open(NULL, &none, &err), MHE_E_ARGUMENT);
    mhe_recording_close(recording);
    mhe_config_close(config);
    config = read_demo("data.markers=no_such.trc");
    assert_int_equal(mhe_recording_open(config, &none, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "no_such.trc"));
    assert_null(none);
    mhe_config_close(config);
}

static void an_estimator_takes_the_frames(void **state) {
    (void)state;
    mhe_config *config = read_demo("horizon.window=3");
    mhe_recording_info info;
    mhe_error err = {0};
    mhe_recording *recording = open_recording(config, &info);
    mhe_estimator *estimator = NULL;
    expect_done(mhe_estimator_create(config, &estimator, &err), &err);
    int32_t n = 0;
    for (int32_t k = 0; k < 60; k++) {
        mhe_frame frame = {.size = sizeof frame};
        mhe_truth truth = {.size = sizeof truth};
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        expect_done(mhe_recording_frame(recording, k, &frame, &err), &err);
        expect_done(mhe_estimator_push(estimator, &frame, &estimate, &ready, &err), &err);
        if (ready) { /* the window's oldest frame: three used ones back */
            expect_done(mhe_recording_truth(recording, k - 9, &truth, &err), &err);
            assert_true(fabs(estimate.time - truth.time) < 1e-9);
            assert_true(fabs(estimate.q[3] - truth.q[3]) < 0.01); /* rad */
            n++;
        }
    }
    assert_int_equal(n, 17); /* every third frame from the tenth on */
    mhe_estimator_close(estimator);
    mhe_recording_close(recording);
    mhe_config_close(config);
}

/* Frames 0 .. 59 into an estimator, estimates into findings; the status of the last push. */
static mhe_status push_all(mhe_recording *recording, mhe_estimator *estimator,
                           mhe_findings *findings, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k < 60 && status == MHE_OK; k++) {
        mhe_frame frame = {.size = sizeof frame};
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        expect_done(mhe_recording_frame(recording, k, &frame, err), err);
        status = mhe_estimator_push(estimator, &frame, &estimate, &ready, err);
        if (status == MHE_OK && ready) {
            expect_done(mhe_findings_add(findings, &estimate, err), err);
        }
    }
    return status;
}

static void findings_tell_errors_and_lines(void **state) {
    (void)state;
    mhe_config *config = read_demo("horizon.window=3");
    mhe_recording_info info;
    mhe_error err = {0};
    mhe_recording *recording = open_recording(config, &info);
    mhe_estimator *estimator = NULL;
    mhe_findings *findings = NULL;
    mhe_rmse rmse = {.size = sizeof rmse};
    char *text = NULL;
    expect_done(mhe_estimator_create(config, &estimator, &err), &err);
    expect_done(mhe_findings_open(config, estimator, recording, &findings, &err), &err);
    expect_done(push_all(recording, estimator, findings, &err), &err);
    expect_done(mhe_findings_rmse(findings, 5, 0, &rmse, &err), &err);
    assert_true(rmse.q > 0 && rmse.q < 1e-3 && rmse.force > 0 && rmse.force < 20);
    assert_true(mhe_findings_distances(findings)[0] < 0.005); /* m */
    expect_done(mhe_findings_write(findings, &text, &err), &err);
    assert_non_null(strstr(text, "markers: 0.0 % of the samples missing"));
    mhe_free(text);
    mhe_estimate empty = {.size = sizeof empty};
    assert_int_equal(mhe_findings_add(findings, &empty, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_findings_add(findings, NULL, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_findings_open(config, NULL, recording, &findings, &err), MHE_E_ARGUMENT);
    mhe_findings_close(findings);
    mhe_estimator_close(estimator);
    mhe_recording_close(recording);
    mhe_config_close(config);
}

static void an_estimator_is_steered_from_outside(void **state) {
    (void)state;
    mhe_config *config = read_demo("horizon.window=3");
    mhe_recording_info info;
    mhe_error err = {0};
    mhe_recording *recording = open_recording(config, &info);
    mhe_estimator *estimator = NULL;
    mhe_findings *findings = NULL;
    mhe_estimator_info is = {.size = sizeof is};
    expect_done(mhe_estimator_create(config, &estimator, &err), &err);
    expect_done(mhe_findings_open(config, estimator, recording, &findings, &err), &err);
    expect_done(mhe_estimator_set_node(estimator, 3, &err), &err);
    mhe_estimator_describe(estimator, &is);
    assert_int_equal(is.node, 3);
    assert_int_equal(mhe_estimator_set_node(estimator, 4, &err), MHE_E_ARGUMENT);
    assert_string_equal(err.text, "mhe_estimator_set_node: 4 is no node of the window, 0 .. 3");
    assert_int_equal(mhe_estimator_set_node(estimator, -1, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_set_node(NULL, 0, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_set_deadline(estimator, NAN, &err), MHE_E_ARGUMENT);
    expect_done(mhe_estimator_set_deadline(estimator, 0, &err), &err);
    expect_done(mhe_estimator_set_start(estimator, NULL, NULL, &err), &err);
    mhe_estimator_stop(NULL, 1);
    mhe_estimator_stop(estimator, 1);
    assert_int_equal(push_all(recording, estimator, findings, &err), MHE_E_INTERRUPTED);
    mhe_findings_close(findings);
    mhe_estimator_close(estimator);
    mhe_recording_close(recording);
    mhe_config_close(config);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(findings_tell_errors_and_lines),
                                       cmocka_unit_test(an_estimator_is_steered_from_outside),
                                       cmocka_unit_test(frames_and_truth_are_there),
                                       cmocka_unit_test(nothing_is_written_beyond_the_callers_size),
                                       cmocka_unit_test(what_is_not_there_is_refused),
                                       cmocka_unit_test(an_estimator_takes_the_frames)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
