/* SPDX-License-Identifier: Apache-2.0 */
/* data.rates: velocities that the markers say, frame by frame, against the known motion; and
 * controls that are held over intervals, at the time of a node. */
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <string.h>

#define N_Q 4
#define N_M 19
#define N_K 8
#define N_FRAMES 90
#define MODELS MHE_TEST_SOURCE_DIR "/models/arm19/"
#define HEAD                                                                               \
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\nhorizon: {window: 5, ratio: 3}\n" \
    "solver: {plugin: mhe.solver.rti}\n"                                                   \
    "costs: [mhe.cost.min-excitation, {plugin: mhe.cost.track, signal: qdot, sigma: 0.5}]\n"
#define DATA "markers: " MODELS "demo_markers.trc, reference: " MODELS "demo_reference.sto"

#define ANGLES "angles: " MODELS "demo_reference.sto, reference: " MODELS "demo_reference.sto"

typedef struct seen {
    double rates[N_FRAMES][N_Q], qdot[N_FRAMES][N_Q]; /* what an estimate's node tracked, and is */
    double activation[N_FRAMES][N_M], control[N_FRAMES][N_M];
    double truth[N_FRAMES][N_Q];
    int32_t n;
} seen;

static void run(const char *config, int32_t hide_from, int32_t hide_to, int32_t has_rates,
                seen *out) {
    test_fixture f;
    mhi_recording *r = NULL;
    if (test_fixture_open(&f, config) != MHE_OK ||
        mhi_recording_read(f.run, mhi_system_description(f.system), &f.host, &r, &f.err) !=
            MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    out->n = 0;
    for (int32_t k = 0; k < N_FRAMES; k++) {
        mhe_estimate e = {.size = sizeof e};
        int32_t ready = 0, row = -1;
        mhe_frame frame = mhi_recording_frame(r, N_K, N_M, k);
        frame.markers = k >= hide_from && k < hide_to ? NULL : frame.markers;
        assert_int_equal(mhe_estimator_push(f.estimator, &frame, &e, &ready, &f.err), MHE_OK);
        if (!ready) {
            continue;
        }
        for (int32_t i = 0; i < e.n_tracked; i++) {
            const mhe_tracked *t = &e.tracked[i];
            mhe_estimator_info info = {.size = sizeof info};
            assert_int_equal(mhe_estimator_describe(f.estimator, &info), MHE_OK);
            row = strcmp(mhe_channel_at(&info, t->channel)->name, "rates") == 0 ? i : row;
        }
        assert_true((row >= 0) == has_rates);
        for (int32_t i = 0; i < N_Q; i++) {
            out->rates[out->n][i] = row < 0 ? NAN : e.tracked[row].measured[i];
            const ptrdiff_t at = (ptrdiff_t)llround((e.time - r->time[0]) * r->rate);
            out->truth[out->n][i] = r->reference.qdot[at * N_Q + i];
        }
        memcpy(out->qdot[out->n], e.qdot, sizeof out->qdot[0]);
        memcpy(out->activation[out->n], e.activation, sizeof out->activation[0]);
        memcpy(out->control[out->n++], e.controls, sizeof out->control[0]);
    }
    mhi_recording_free(r);
    test_fixture_close(&f);
}

/* The demo's markers are exact: what is left is what a slope over 30 ms to each side leaves. */
static void rates_are_those_of_the_motion(void **state) {
    static seen s;
    double squares = 0, truth = 0;
    (void)state;
    run(HEAD "data: {" DATA ", rates: true}\n", 0, 0, 1, &s);
    assert_true(s.n > 15);
    for (int32_t k = 1; k < s.n; k++) {
        for (int32_t i = 0; i < N_Q; i++) {
            assert_true(isfinite(s.rates[k][i]));
            squares += pow(s.rates[k][i] - s.truth[k][i], 2);
            truth += pow(s.truth[k][i], 2);
        }
    }
    assert_true(squares < 0.01 * truth); /* a tenth of the velocity */
}

/* Angles measured elsewhere, without a marker: their slopes. */
static void rates_of_measured_angles(void **state) {
    static seen s;
    double squares = 0, truth = 0;
    (void)state;
    run(HEAD "data: {" ANGLES ", rates: true}\n", 0, 0, 1, &s);
    assert_true(s.n > 15);
    for (int32_t k = 1; k < s.n; k++) {
        for (int32_t i = 0; i < N_Q; i++) {
            assert_true(isfinite(s.rates[k][i]));
            squares += pow(s.rates[k][i] - s.truth[k][i], 2);
            truth += pow(s.truth[k][i], 2);
        }
    }
    assert_true(squares < 0.01 * truth);
}

static void rates_are_missing_beside_missing_markers(void **state) {
    static seen s;
    int32_t n_missing = 0;
    (void)state;
    run(HEAD "data: {" DATA ", rates: true}\n", 40, 52, 1, &s);
    for (int32_t k = 0; k < s.n; k++) {
        n_missing += isnan(s.rates[k][0]);
    }
    assert_true(n_missing >= 2 && n_missing <= 6); /* four frames of the window's rate are hidden */
}

static void without_there_is_no_such_channel(void **state) {
    static seen s;
    (void)state;
    run(HEAD "data: {" DATA "}\n", 0, 0, 0, &s);
    assert_true(s.n > 15);
}

/* Activation-driven: at a node the mean of what is held before and after it. */
static void held_controls_meet_at_nodes(void **state) {
    static seen s;
    (void)state;
    run(HEAD "formulation: activation\ndata: {" DATA "}\n", 0, 0, 0, &s);
    for (int32_t k = 1; k < s.n; k++) {
        for (int32_t i = 0; i < N_M; i++) {
            const double mean = 0.5 * (s.control[k - 1][i] + s.control[k][i]);
            assert_true(fabs(s.activation[k][i] - mean) < 1e-12);
        }
    }
    assert_true(s.activation[0][0] == s.control[0][0]); /* nothing is known of before */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rates_are_those_of_the_motion),
        cmocka_unit_test(rates_of_measured_angles),
        cmocka_unit_test(rates_are_missing_beside_missing_markers),
        cmocka_unit_test(without_there_is_no_such_channel),
        cmocka_unit_test(held_controls_meet_at_nodes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
