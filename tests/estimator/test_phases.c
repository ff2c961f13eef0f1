/* SPDX-License-Identifier: Apache-2.0 */
/* Phases of the window, the table of channels, and structs of other sizes than ours. */
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define N 7
#define N_K 8
#define N_M 19
#define MODELS MHE_TEST_SOURCE_DIR "/models/arm19/"
#define CONFIG                                                                   \
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"                       \
    "data: {markers: " MODELS "demo_markers.trc, emg: " MODELS "demo_emg.sto}\n" \
    "horizon: {window: 7, ratio: 1}\ncosts: [mhe.cost.emg-markers-high]\n"       \
    "solver: {plugin: mhe.solver.rti, preset: speed}\n"

typedef struct rig {
    test_fixture f;
    mhi_recording *recording;
    mhe_estimate e;
    int32_t ready;
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

static int32_t phase(const rig *r) {
    mhe_estimator_info info = {.size = sizeof info};
    assert_int_equal(mhe_estimator_describe(r->f.estimator, &info), MHE_OK);
    return info.phase;
}

/* Frame k, its markers moved by `by` (NaN: hidden), `late` s after its time; the phase then. */
static int32_t push(rig *r, int32_t k, double by, double late) {
    static double markers[3 * N_K];
    mhe_frame frame = mhi_recording_frame(r->recording, N_K, N_M, k);
    for (int32_t i = 0; i < 3 * N_K; i++) {
        markers[i] = frame.markers[i] + by;
    }
    frame.markers = markers;
    frame.time += late;
    r->e = (mhe_estimate){.size = sizeof r->e};
    assert_int_equal(mhe_estimator_push(r->f.estimator, &frame, &r->e, &r->ready, &r->f.err),
                     MHE_OK);
    return phase(r);
}

static void from_empty_to_running(void **state) {
    (void)state;
    rig r;
    int32_t k = 0;
    rig_open(&r);
    assert_int_equal(phase(&r), MHE_PHASE_EMPTY);
    for (; k < N; k++) {
        assert_int_equal(push(&r, k, NAN, 0), MHE_PHASE_FILLING);
    }
    for (; k < 2 * N; k++) { /* full, but no marker to begin from */
        assert_int_equal(push(&r, k, NAN, 0), MHE_PHASE_BEGINNING);
        assert_int_equal(r.ready, 0);
    }
    for (; k < 3 * N; k++) { /* the oldest node has none yet */
        assert_int_equal(push(&r, k, 0, 0), MHE_PHASE_BEGINNING);
    }
    mhi_estimator_set_deadline(r.f.estimator, 1e-5); /* not enough to settle */
    for (; k < 3 * N + 3; k++) {
        assert_int_equal(push(&r, k, 0, 0), MHE_PHASE_SETTLING);
        assert_int_equal(r.e.phase, MHE_PHASE_SETTLING);
    }
    mhi_estimator_set_deadline(r.f.estimator, 0);
    assert_int_equal(push(&r, k++, 0, 0), MHE_PHASE_RUNNING);
    assert_int_equal(r.e.phase, MHE_PHASE_RUNNING);
    mhi_estimator_set_deadline(r.f.estimator, 1e-5);
    for (int32_t n = 0; n < 2; n++) { /* the motion is lost ... */
        assert_int_equal(push(&r, k++, 0.5, 0), MHE_PHASE_RUNNING);
    }
    assert_int_equal(push(&r, k++, 0.5, 0), MHE_PHASE_SETTLING); /* ... for the third time */
    assert_int_equal(push(&r, k++, 0, 1.0), MHE_PHASE_FILLING);  /* after a second of nothing */
    for (int32_t n = 1; n < N; n++) {
        assert_int_equal(push(&r, k++, 0, 1.0), MHE_PHASE_FILLING);
    }
    assert_int_equal(push(&r, k++, 0, 1.0), MHE_PHASE_SETTLING);
    rig_close(&r);
}

static void the_table_says_what_is_measured(void **state) {
    (void)state;
    static const struct {
        const char *name, *signal, *first_column, *unit;
        int32_t width, n_labels;
    } rows[] = {{"markers", "markers", NULL, "m", 3 * N_K, N_K},
                {"emg", "excitation", NULL, "1", N_M, N_M},
                {"angles", "q", NULL, "rad", 4, 4}};
    rig r;
    char first[64];
    mhe_estimator_info info = {.size = sizeof info};
    rig_open(&r);
    assert_int_equal(mhe_estimator_describe(r.f.estimator, &info), MHE_OK);
    for (int32_t i = 0; i < 3; i++) {
        const int32_t at = mhe_estimator_find_channel(r.f.estimator, rows[i].name);
        const mhe_channel *c = mhe_channel_at(&info, at);
        assert_string_equal(c->name, rows[i].name);
        assert_string_equal(c->signal, rows[i].signal);
        assert_string_equal(c->units[0], rows[i].unit);
        assert_int_equal(c->width, rows[i].width);
        assert_int_equal(c->n_labels, rows[i].n_labels);
        (void)snprintf(first, sizeof first, "%s%s", c->labels[0], c->per_label == 3 ? ".x" : "");
        assert_string_equal(c->columns[0], first);
        assert_true(c->gap == 0);
    }
    for (int32_t k = 0; k <= N; k++) {
        (void)push(&r, k, 0, 0);
    }
    const int32_t emg = mhe_estimator_find_channel(r.f.estimator, "emg");
    assert_float_equal(mhe_channel_at(&info, emg)->gap, 0.01, 1e-9);
    assert_int_equal(mhe_estimator_find_channel(r.f.estimator, "insoles"), -1);
    assert_int_equal(r.e.n_tracked, info.n_channels);
    const int32_t angles = mhe_estimator_find_channel(r.f.estimator, "angles");
    const mhe_tracked *t = mhe_tracked_at(&r.e, angles);
    assert_int_equal(t->n_measured, 0);
    assert_int_equal(t->why[0], MHE_TRACK_MISSING);
    assert_true(isnan(t->rms));
    t = mhe_tracked_at(&r.e, mhe_estimator_find_channel(r.f.estimator, "markers"));
    assert_true(t->rms == r.e.marker_rms);
    assert_int_equal(t->n_left_out, 0);
    rig_close(&r);
}

/* Every block of states and controls, by its name, also those that have a field of their own. */
static void blocks_by_name(void **state) {
    (void)state;
    rig r;
    mhe_estimator_info info = {.size = sizeof info};
    rig_open(&r);
    for (int32_t k = 0; k <= 2 * N; k++) {
        (void)push(&r, k, 0, 0);
    }
    assert_int_equal(mhe_estimator_describe(r.f.estimator, &info), MHE_OK);
    assert_ptr_equal(r.e.layout, info.layout);
    const struct {
        int32_t role;
        const char *name;
        const double *field;
    } fields[] = {{MHE_ROLE_STATE, "q", r.e.q},
                  {MHE_ROLE_STATE, "qdot", r.e.qdot},
                  {MHE_ROLE_STATE, "activation", r.e.activation},
                  {MHE_ROLE_CONTROL, "excitation", r.e.excitation}};
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
        const mhe_block *block = mhe_layout_find(info.layout, fields[i].role, fields[i].name);
        assert_non_null(block);
        assert_memory_equal(mhe_estimate_block(&r.e, block), fields[i].field,
                            sizeof(double) * (size_t)block->count);
    }
    rig_close(&r);
}

/* The same by fields and by channel: the same bits. */
static void frames_by_channel(void **state) {
    (void)state;
    rig a, b;
    rig_open(&a);
    rig_open(&b);
    for (int32_t k = 0; k < 3 * N; k++) {
        const mhe_frame frame = mhi_recording_frame(a.recording, N_K, N_M, k);
        const double *channels[3] = {NULL};
        channels[mhe_estimator_find_channel(b.f.estimator, "markers")] = frame.markers;
        channels[mhe_estimator_find_channel(b.f.estimator, "emg")] = frame.emg;
        const mhe_frame by_channel = {
            .size = sizeof by_channel, .time = frame.time, .n_channels = 3, .channels = channels};
        a.e = b.e = (mhe_estimate){.size = sizeof a.e};
        assert_int_equal(mhe_estimator_push(a.f.estimator, &frame, &a.e, &a.ready, NULL), MHE_OK);
        assert_int_equal(mhe_estimator_push(b.f.estimator, &by_channel, &b.e, &b.ready, NULL),
                         MHE_OK);
        assert_int_equal(a.ready, b.ready);
        if (a.ready) {
            assert_memory_equal(a.e.force, b.e.force, sizeof(double) * N_M);
        }
    }
    rig_close(&a);
    rig_close(&b);
}

/* A program built when structs were shorter; what stands behind them stays as it was. */
static void shorter_structs(void **state) {
    (void)state;
    enum { SHORT = offsetof(mhe_estimate, latency), INFO = offsetof(mhe_estimator_info, node) };
    rig r;
    mhe_estimate e;
    mhe_estimator_info info;
    int32_t ready = 0, n = 0;
    rig_open(&r);
    for (int32_t k = 0; k < 2 * N; k++) {
        mhe_frame frame = mhi_recording_frame(r.recording, N_K, N_M, k);
        frame.size = offsetof(mhe_frame, angles);
        frame.angles = (const double *)(uintptr_t)8; /* not theirs: must not be read */
        frame.channels = (const double *const *)(uintptr_t)8;
        frame.n_channels = 3;
        memset(&e, 0x5a, sizeof e);
        e.size = SHORT;
        assert_int_equal(mhe_estimator_push(r.f.estimator, &frame, &e, &ready, NULL), MHE_OK);
        for (size_t i = SHORT; i < sizeof e; i++) {
            assert_int_equal(((const uint8_t *)&e)[i], 0x5a);
        }
        assert_int_equal(e.size, SHORT);
        n += ready && e.force[0] >= 0;
    }
    assert_int_equal(n, N);
    memset(&info, 0x5a, sizeof info);
    info.size = INFO;
    assert_int_equal(mhe_estimator_describe(r.f.estimator, &info), MHE_OK);
    assert_int_equal(info.n_muscles, N_M);
    assert_int_equal(((const uint8_t *)&info)[INFO], 0x5a);
    rig_close(&r);
}

static void what_is_needed_and_not_there(void **state) {
    (void)state;
    rig r;
    const double values[3 * N_K] = {0};
    mhe_frame frame = {.size = sizeof frame};
    mhe_estimate e = {.size = sizeof e}, unset = {.size = 0};
    mhe_channel_counts counts = {.size = sizeof counts};
    int32_t ready = 0;
    rig_open(&r);
    mhe_estimator *s = r.f.estimator;
    assert_int_equal(mhe_estimator_push(NULL, &frame, &e, &ready, NULL), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_push(s, NULL, &e, &ready, NULL), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_push(s, &frame, NULL, &ready, NULL), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_push(s, &frame, &e, NULL, NULL), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_push(s, &frame, &unset, &ready, &r.f.err), MHE_E_ARGUMENT);
    assert_non_null(strstr(r.f.err.text, "estimate's size is not set"));
    assert_int_equal(mhe_estimator_prepare(NULL, NULL), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_describe(s, NULL), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_counts(s, 99, &counts), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_measure(s, 0, 1, NULL, NULL), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_measure(s, -1, 1, values, NULL), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_measure(s, 0, NAN, values, NULL), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_open(NULL, NULL, 0, NULL, &s, NULL), MHE_E_ARGUMENT);
    assert_int_equal(mhe_estimator_open("a.yaml", NULL, 0, NULL, NULL, NULL), MHE_E_ARGUMENT);
    assert_int_equal(phase(&r), MHE_PHASE_EMPTY); /* nothing was taken */
    rig_close(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(from_empty_to_running), cmocka_unit_test(the_table_says_what_is_measured),
        cmocka_unit_test(blocks_by_name),        cmocka_unit_test(frames_by_channel),
        cmocka_unit_test(shorter_structs),       cmocka_unit_test(what_is_needed_and_not_there)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
