/* SPDX-License-Identifier: Apache-2.0 */
/* An application with raw EMG has one object, the estimator: it gives it frames and samples as they
 * come, in time or in packets that are late. */
#include "outside.h"

#include <math.h>
#include <mhe/recording.h>
#include <mhe/table.h>

#define FRAMES 120
#define FORCES 19

typedef struct rig {
    mhe_config *config;
    mhe_recording *recording;
    mhe_recording_info info;
    mhe_table *raw;
    mhe_table_info is;
    mhe_error err;
} rig;

static rig open_rig(void) {
    rig r = {.info = {.size = sizeof r.info}, .is = {.size = sizeof r.is}};
    const char *set[] = {"data.marker_outlier=0", "horizon.window=5"};
    expect_done(mhe_config_read(ARM19 "/demo_raw.yaml", set, 2, 0, NULL, &r.config, &r.err),
                &r.err);
    expect_done(mhe_recording_open(r.config, &r.recording, &r.err), &r.err);
    expect_done(mhe_recording_describe(r.recording, &r.info, &r.err), &r.err);
    expect_done(mhe_table_read_signals(ARM19 "/demo_recording.c3d", &r.raw, &r.err), &r.err);
    expect_done(mhe_table_describe(r.raw, &r.is, &r.err), &r.err);
    return r;
}

static void close_rig(rig *r) {
    mhe_table_close(r->raw);
    mhe_recording_close(r->recording);
    mhe_config_close(r->config);
}

/* How the EMG gets in. */
#define BY_FRAMES -1.0 /* of the recording, as mhe-run does it */

typedef struct outcome {
    double force[FRAMES][FORCES], emg[FRAMES][FORCES];
    int32_t n;
    int64_t n_empty; /* nodes that left the window without EMG */
} outcome;

static void push_samples(rig *r, mhe_estimator *e, int32_t *next, double until) {
    while (*next < r->is.n_rows && r->is.time[*next] <= until + 1e-9) {
        const double *row = r->is.values + (ptrdiff_t)*next * r->is.n_columns;
        expect_done(mhe_estimator_push_emg(e, r->is.time[(*next)++], row, &r->err), &r->err);
    }
}

/* Samples are there `late` s after their time, in packets of `packet` s. */
static void run(rig *r, double late, double packet, outcome *out) {
    mhe_estimator *e = NULL;
    int32_t next = 0;
    *out = (outcome){.n = 0};
    expect_done(mhe_estimator_create(r->config, &e, &r->err), &r->err);
    if (late != BY_FRAMES) {
        expect_done(mhe_estimator_open_emg(e, r->is.labels, r->is.n_columns, r->is.rate, &r->err),
                    &r->err);
        assert_int_equal(
            mhe_estimator_open_emg(e, r->is.labels, r->is.n_columns, r->is.rate, &r->err),
            MHE_E_ARGUMENT);
    }
    for (int32_t k = 0; k < FRAMES; k++) {
        mhe_frame frame = {.size = sizeof frame};
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        expect_done(mhe_recording_frame(r->recording, k, &frame, &r->err), &r->err);
        if (late != BY_FRAMES) {
            frame.emg = NULL;
            push_samples(r, e, &next, packet * floor((frame.time - late) / packet + 1e-6));
        }
        expect_done(mhe_estimator_push(e, &frame, &estimate, &ready, &r->err), &r->err);
        if (ready) {
            const mhe_tracked *t = mhe_tracked_at(&estimate, mhe_estimator_find_channel(e, "emg"));
            memcpy(out->force[out->n], estimate.force, sizeof out->force[0]);
            memcpy(out->emg[out->n++], t->measured, sizeof out->emg[0]);
        }
    }
    mhe_channel_counts counts = {.size = sizeof counts};
    expect_done(mhe_estimator_counts(e, mhe_estimator_find_channel(e, "emg"), &counts), &r->err);
    out->n_empty = counts.n_empty;
    if (late != BY_FRAMES) {
        assert_true(mhe_estimator_emg_lag(e) == r->info.emg_lag);
    }
    mhe_estimator_close(e);
}

static outcome recorded, live;

static void samples_in_time_give_the_bits_of_the_recording(void **state) {
    (void)state;
    rig r = open_rig();
    run(&r, BY_FRAMES, 1, &recorded);
    run(&r, 0, 0.0005, &live);
    assert_int_equal(recorded.n, live.n);
    assert_true(live.n > FRAMES / 2);
    assert_memory_equal(recorded.force, live.force, sizeof live.force);
    close_rig(&r);
}

static void packets_that_are_late_lose_nothing(void **state) {
    (void)state;
    rig r = open_rig();
    run(&r, BY_FRAMES, 1, &recorded);
    run(&r, 0.012, 0.0135, &live); /* 27 samples at 2 kHz, 12 ms late: up to 25 ms */
    assert_int_equal(recorded.n, live.n);
    assert_int_equal(recorded.n_empty, live.n_empty);
    int32_t n = 0;
    for (int32_t k = 0; k < live.n; k++) { /* the window's oldest node has long got its EMG */
        for (int32_t i = 0; i < FORCES; i++) {
            const double a = live.emg[k][i], b = recorded.emg[k][i];
            assert_true(a == b || (isnan(a) && isnan(b)));
            n += !isnan(a);
        }
    }
    assert_true(n > 10 * live.n);
    close_rig(&r);
}

static void mistakes_are_told(void **state) {
    (void)state;
    rig r = open_rig();
    mhe_estimator *e = NULL;
    const double sample[64] = {0};
    expect_done(mhe_estimator_create(r.config, &e, &r.err), &r.err);
    assert_int_equal(mhe_estimator_push_emg(e, 0, sample, &r.err), MHE_E_ARGUMENT);
    assert_string_equal(r.err.text, "mhe_estimator_push_emg: mhe_estimator_open_emg comes first");
    assert_int_equal(mhe_estimator_open_emg(e, NULL, 1, 2000, &r.err), MHE_E_ARGUMENT);
    const char *const holes[] = {"Biceps", NULL};
    assert_int_equal(mhe_estimator_open_emg(e, holes, 2, 2000, &r.err), MHE_E_ARGUMENT);
    const char *const others[] = {"Force1", "Force2"};
    assert_int_equal(mhe_estimator_open_emg(e, others, 2, 2000, &r.err), MHE_E_INPUT);
    assert_non_null(strstr(r.err.text, "no column for any channel"));
    assert_int_equal(mhe_estimator_open_emg(e, r.is.labels, r.is.n_columns, -1, &r.err),
                     MHE_E_ARGUMENT);
    expect_done(mhe_estimator_open_emg(e, r.is.labels, r.is.n_columns, 2000, &r.err), &r.err);
    assert_int_equal(mhe_estimator_push_emg(e, 0, NULL, &r.err), MHE_E_ARGUMENT);
    mhe_estimator_close(e);
    close_rig(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_in_time_give_the_bits_of_the_recording),
        cmocka_unit_test(packets_that_are_late_lose_nothing), cmocka_unit_test(mistakes_are_told)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
