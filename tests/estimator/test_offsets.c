/* SPDX-License-Identifier: Apache-2.0 */
/* data.marker_offset: markers that are not where the model has them, each moved in its segment. */
#include "estimator/estimator_private.h"
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <string.h>

#define N_Q 4
#define N_M 19
#define N_K 8
#define N (3 * N_K)
#define RATIO 3
#define WINDOW 4
#define MODELS MHE_TEST_SOURCE_DIR "/models/arm19/"
#define CONFIG                                                                                  \
    "model: {file: $ARM19}\nmuscle: {curves: paper2021, passive_ramp: 0.02}\n"                  \
    "data: {markers: " MODELS "demo_markers.trc, emg: " MODELS "demo_emg.sto, "                 \
    "reference: " MODELS "demo_reference.sto%s}\nhorizon: {window: 4, ratio: 3}\ncosts: [%s]\n" \
    "output: {skip_first: 0, skip_last: 0}\n"

typedef struct outcome {
    double angle, late; /* root of the mean squared error, rad; of the second half alone */
    double place;       /* how far the model's markers are from the true places, RMS m */
    double last_q[N_Q];
} outcome;

/* The markers of a posture with each moved by offset [N] in its segment. */
static void move_markers(const test_fixture *f, mhi_system_context *context, const double *q,
                         const double *offset, double *markers) {
    const mhe_description *d = mhi_system_description(f->system);
    double body[12 * 64];
    assert_true(d->n_bodies <= 64);
    assert_int_equal(mhi_system_bodies(context, q, body, NULL, NULL), MHE_OK);
    for (int32_t i = 0; i < N; i++) {
        const double *r = body + 12 * d->markers[i / 3].body + 3 + 3 * (i % 3);
        const double *b = offset + i / 3 * 3;
        markers[i] += r[0] * b[0] + r[1] * b[1] + r[2] * b[2];
    }
}

static void open_config(test_fixture *f, const char *cost, const char *data) {
    char yaml[2048];
    (void)snprintf(yaml, sizeof yaml, CONFIG, data, cost);
    if (test_fixture_open(f, yaml) != MHE_OK) {
        fail_msg("%s", f->err.text);
    }
}

/* The demo with markers `off` (m, a direction each), those of `missing` (-1: none) not seen. */
static outcome run(const char *cost, const char *data, double off, int32_t missing) {
    test_fixture f;
    mhi_recording *r = NULL;
    mhi_system_context *context = NULL;
    outcome out = {0};
    double offset[N];
    uint64_t seed = 64;
    int32_t n = 0, n_late = 0;
    open_config(&f, cost, data);
    assert_int_equal(
        mhi_recording_read(f.run, mhi_system_description(f.system), &f.host, &r, &f.err), MHE_OK);
    assert_int_equal(mhi_system_context_create(f.system, &context, &f.err), MHE_OK);
    for (int32_t i = 0; i < N; i++) {
        offset[i] = off * test_random(&seed, -1, 1);
    }
    for (int32_t k = 0; k < r->n_frames; k++) {
        mhe_frame frame = mhi_recording_frame(r, N_K, N_M, k);
        mhe_estimate e = {.size = sizeof e};
        double markers[N];
        int32_t ready = 0;
        memcpy(markers, frame.markers, sizeof markers);
        move_markers(&f, context, r->reference.q + (ptrdiff_t)k * N_Q, offset, markers);
        for (int32_t i = 0; i < 3 && missing >= 0; i++) {
            markers[3 * missing + i] = NAN;
        }
        frame.markers = markers;
        assert_int_equal(mhe_estimator_push(f.estimator, &frame, &e, &ready, &f.err), MHE_OK);
        const double *truth = r->reference.q + (ptrdiff_t)(k - WINDOW * RATIO) * N_Q;
        for (int32_t j = 0; j < N_Q && ready; j++) {
            const double square = pow(e.q[j] - truth[j], 2);
            out.angle += square;
            out.late += 2 * k > r->n_frames ? square : 0;
            n_late += 2 * k > r->n_frames;
            n++;
            out.last_q[j] = e.q[j];
        }
    }
    const double *found = f.estimator->rates.offsets.value;
    for (int32_t i = 0; i < N && found != NULL; i++) {
        out.place += pow(found[i] - offset[i], 2) / N;
        assert_true(i / 3 != missing || found[i] == 0); /* nothing is known of it */
    }
    double told[N] = {0};
    assert_int_equal(mhe_estimator_marker_offsets(f.estimator, told), found != NULL);
    for (int32_t i = 0; i < N; i++) {
        assert_true(told[i] == (found == NULL ? 0 : found[i]));
    }
    out.place = sqrt(out.place);
    out.angle = sqrt(out.angle / n);
    out.late = sqrt(out.late / n_late);
    mhi_system_context_free(context);
    mhi_recording_free(r);
    test_fixture_close(&f);
    return out;
}

/* As the arm moves markers say where they are. What is left of the offsets is mostly what no motion
 * of this arm shows (forearm markers turned about the elbow together). */
static void offsets_are_learnt(void **state) {
    (void)state;
    for (int32_t missing = -1; missing < N_K; missing += 5) {
        const outcome without = run("mhe.cost.emg-markers", ", rates: true", 0.015, missing);
        const outcome with =
            run("mhe.cost.emg-markers", ", rates: true, marker_offset: 0.01", 0.015, missing);
        print_message("marker %d missing: angles %.4f and %.4f rad, later %.4f and %.4f; places "
                      "%.2f mm\n",
                      (int)missing, without.angle, with.angle, without.late, with.late,
                      1e3 * with.place);
        assert_true(with.angle < 0.8 * without.angle);
        assert_true(with.late < 0.7 * without.late);
    }
}

/* Whatever the cost, and how far off markers may be is a guess: half of it or twice serves. */
static void whatever_the_cost_and_the_guess(void **state) {
    static const char *const guesses[] = {", marker_offset: 0.005", ", marker_offset: 0.02"};
    (void)state;
    const outcome without = run("mhe.cost.emg-markers-high", "", 0.015, -1);
    for (size_t i = 0; i < 2; i++) {
        const outcome with = run("mhe.cost.emg-markers-high", guesses[i], 0.015, -1);
        print_message("angles %.4f and %.4f rad\n", without.late, with.late);
        assert_true(with.late < 0.6 * without.late);
    }
}

/* Markers in their places stay there. */
static void exact_markers_have_no_offsets(void **state) {
    (void)state;
    const outcome without = run("mhe.cost.emg-markers", ", rates: true", 0, -1);
    const outcome with = run("mhe.cost.emg-markers", ", rates: true, marker_offset: 0.01", 0, -1);
    print_message("places %.2g m, angles %.2g and %.2g rad\n", with.place, without.angle,
                  with.angle);
    assert_true(with.place < 1e-6);
    for (int32_t j = 0; j < N_Q; j++) {
        assert_true(fabs(with.last_q[j] - without.last_q[j]) < 1e-6);
    }
}

/* A look's `follow` is the derivative of the nearest posture: against postures searched for. */
static void postures_go_with_offsets(void **state) {
    test_fixture f;
    mhi_start *start = NULL;
    const double q[N_Q] = {-0.2, -1, -0.4, 0.4}, step = 1e-4;
    double markers[N], moved[N], offset[N] = {0}, window[N_Q], move[N_Q], rms;
    (void)state;
    open_config(&f, "mhe.cost.emg-markers", ", marker_offset: 0.01");
    mhi_offsets *o = &f.estimator->rates.offsets;
    mhi_system_context *context = o->context;
    assert_int_equal(mhi_start_create(f.system, context, &start, &f.err), MHE_OK);
    assert_int_equal(mhi_system_markers(context, q, markers, NULL, &f.err), MHE_OK);
    memcpy(window, q, sizeof q);
    mhi_offsets_learn(o, 0, markers, window);
    for (int32_t i = 0; i < N; i++) {
        double found[2][N_Q];
        for (int32_t side = 0; side < 2; side++) {
            memcpy(moved, markers, sizeof moved);
            offset[i] = side == 0 ? -step : step; /* taken off the markers */
            move_markers(&f, context, q, offset, moved);
            for (int32_t j = 0; j < N; j++) {
                moved[j] = 2 * markers[j] - moved[j];
            }
            memcpy(found[side], q, sizeof q);
            assert_int_equal(mhi_start_posture(start, moved, found[side], &rms, &f.err), MHE_OK);
        }
        offset[i] = 1;
        mhi_offset_follow_move(&o->node[0].follow, offset, N, N_Q, move);
        offset[i] = 0;
        for (int32_t j = 0; j < N_Q; j++) {
            const double slope = (found[1][j] - found[0][j]) / (2 * step);
            assert_true(fabs(move[j] - slope) < 1e-4 * (1 + fabs(slope)));
        }
    }
    mhi_start_free(start);
    test_fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(offsets_are_learnt),
        cmocka_unit_test(whatever_the_cost_and_the_guess),
        cmocka_unit_test(exact_markers_have_no_offsets),
        cmocka_unit_test(postures_go_with_offsets),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
