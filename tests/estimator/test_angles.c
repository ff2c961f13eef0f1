/* SPDX-License-Identifier: Apache-2.0 */
/* Measured joint angles in the place of markers: the demo's motion, with a gap. */
#define _DEFAULT_SOURCE /* mkstemps */
#include "base/pi.h"
#include "estimator/recording.h"
#include "fixture.h"
#include "io/table.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define N_Q 4
#define N_M 19
#define N_FRAMES 121
#define MODELS MHE_TEST_SOURCE_DIR "/models/arm19/"
#define HEAD                                                                               \
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\nhorizon: {window: 7, ratio: 3}\n" \
    "solver: {plugin: mhe.solver.rti}\n"
#define BY_MARKERS                                                                    \
    HEAD "data: {markers: " MODELS "demo_markers.trc, emg: " MODELS "demo_emg.sto}\n" \
         "costs: [mhe.cost.emg-markers-high]\n"
#define ANGLE_COSTS                                                               \
    "costs:\n  - {plugin: mhe.cost.track, signal: q, sigma: 0.001, weight: 30}\n" \
    "  - {plugin: mhe.cost.track, signal: excitation, sigma: 0.1, weight: 30}\n"
#define BY_ANGLES \
    HEAD "data: {angles: " MODELS "demo_reference.sto, emg: " MODELS "demo_emg.sto}\n" ANGLE_COSTS

typedef struct motion {
    int32_t n;
    double q[N_FRAMES][N_Q], force[N_FRAMES][N_M];
} motion;

/* Estimates over the first frames, those from `gap` [2] on without angles. */
static void estimate(const char *config, const int32_t gap[2], motion *out) {
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
        int32_t ready = 0;
        for (int32_t i = 0; k >= gap[0] && k < gap[1] && i < N_Q; i++) {
            r->angles[k * N_Q + i] = NAN;
        }
        const mhe_frame frame = mhi_recording_frame(r, 8, N_M, k);
        assert_int_equal(mhe_estimator_push(f.estimator, &frame, &e, &ready, &f.err), MHE_OK);
        if (ready) {
            assert_true(e.status == MHE_FRAME_OK || e.status == MHE_FRAME_ITERATION_LIMIT);
            memcpy(out->q[out->n], e.q, sizeof out->q[0]);
            memcpy(out->force[out->n++], e.force, sizeof out->force[0]);
        }
    }
    mhi_recording_free(r);
    test_fixture_close(&f);
}

static double apart(const double *a, const double *b, int32_t n) {
    double squares = 0;
    for (int32_t i = 0; i < n; i++) {
        squares += (a[i] - b[i]) * (a[i] - b[i]);
    }
    return sqrt(squares / n);
}

/* RMS differences of two motions from the sixth estimate on. */
static void compare(const motion *a, const motion *b, double *q, double *force) {
    assert_int_equal(a->n, b->n);
    assert_true(a->n > 30);
    *q = apart(a->q[5], b->q[5], (a->n - 5) * N_Q);
    *force = apart(a->force[5], b->force[5], (a->n - 5) * N_M);
}

static const int32_t no_gap[2] = {0, 0};
static motion markers, angles; /* large */

static void forces_are_those_by_markers(void **state) {
    (void)state;
    double q = 0, force = 0;
    estimate(BY_MARKERS, no_gap, &markers);
    estimate(BY_ANGLES, no_gap, &angles);
    compare(&markers, &angles, &q, &force);
    print_message("by angles and by markers: %.4f rad, %.2f N apart\n", q, force);
    assert_true(q < 0.005);
    assert_true(force < 10);
}

static void gaps_are_bridged(void **state) {
    (void)state;
    static const int32_t gap[2] = {60, 66}; /* 2 of 8 nodes */
    static motion bridged;
    double q = 0, force = 0;
    estimate(BY_ANGLES, gap, &bridged);
    compare(&angles, &bridged, &q, &force);
    print_message("with a gap: %.4f rad, %.2f N apart\n", q, force);
    assert_true(q > 0 && q < 0.01); /* above 0: the gap was seen */
    assert_true(force < 10);
}

/* The reference's angles as another program writes them: in degrees under plain names,
 * said by the header, or in radians as OpenSim's states are called. */
static void write_angles(const char *path, int32_t degrees) {
    mhi_table *t = NULL;
    assert_int_equal(mhi_sto_read(MODELS "demo_reference.sto", &t, NULL), MHE_OK);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    (void)fprintf(file, "angles\nversion=3\ninDegrees=%s\nendheader\ntime", degrees ? "yes" : "no");
    for (int32_t i = 0; i < N_Q; i++) {
        const char *name = t->labels[i] + 2; /* of q_NAME */
        (void)fprintf(file, degrees ? "\tq_%s" : "\t/jointset/j/%s/value", name);
    }
    for (int32_t k = 0; k < t->n_rows; k++) {
        (void)fprintf(file, "\n%.17g", t->time[k]);
        for (int32_t i = 0; i < N_Q; i++) {
            (void)fprintf(file, "\t%.17g",
                          t->values[k * t->n_columns + i] * (degrees ? 180 / MHI_PI : 1));
        }
    }
    assert_int_equal(fclose(file), 0);
    mhi_table_free(t);
}

static void expect_the_same(int32_t degrees) {
    static motion by_degrees;
    char folder[256], path[300], config[2048];
    double q = 0, force = 0;
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(path, sizeof path, "%s/angles.sto", folder);
    write_angles(path, degrees);
    (void)snprintf(config, sizeof config,
                   HEAD "data: {angles: %s, emg: " MODELS "demo_emg.sto}\n" ANGLE_COSTS, path);
    estimate(config, no_gap, &by_degrees);
    compare(&angles, &by_degrees, &q, &force);
    print_message("in degrees and in radians: %.1e rad, %.1e N apart\n", q, force);
    assert_true(q < 1e-7); /* the reference has 12 digits */
    assert_true(force < 1e-3);
}

static void degrees_are_converted(void **state) {
    (void)state;
    expect_the_same(1);
}

static void paths_of_states_are_names(void **state) {
    (void)state;
    expect_the_same(0);
}

static void mistakes_are_named(void **state) {
    (void)state;
    test_fixture f;
    mhi_recording *r = NULL;
    assert_int_equal(test_fixture_open(&f, HEAD "data: {angles: " MODELS "demo_emg.sto}\n"
                                                "costs: [mhe.cost.min-excitation]\n"),
                     MHE_OK);
    assert_int_equal(
        mhi_recording_read(f.run, mhi_system_description(f.system), &f.host, &r, &f.err),
        MHE_E_INPUT);
    assert_non_null(strstr(f.err.text, "no column is a coordinate of the model"));
    test_fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(forces_are_those_by_markers), cmocka_unit_test(gaps_are_bridged),
        cmocka_unit_test(degrees_are_converted), cmocka_unit_test(paths_of_states_are_names),
        cmocka_unit_test(mistakes_are_named)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
