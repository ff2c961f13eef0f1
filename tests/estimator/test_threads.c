/* SPDX-License-Identifier: Apache-2.0 */
/* Estimates of a run have the same bits on any number of threads. */
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <stdlib.h>
#include <string.h>

/* Estimates of the demo one after another: [n][width]. */
typedef struct trace {
    double *values;
    int32_t n, width;
} trace;

static double *put(double *to, const double *from, int32_t n) {
    memcpy(to, from, sizeof(double) * (size_t)n);
    return to + n;
}

static void record(trace *t, const mhe_estimate *e, const mhe_description *d) {
    double *to = t->values + (ptrdiff_t)t->n * t->width;
    to = put(to, e->q, d->n_coordinates);
    to = put(to, e->qdot, d->n_coordinates);
    to = put(to, e->activation, d->n_muscles);
    to = put(to, e->excitation, d->n_muscles);
    to = put(to, e->force, d->n_muscles);
    (void)put(to, (const double[]){e->time, e->status}, 2);
    t->n++;
}

static void follow(const char *preset, int threads, trace *t) {
    const char *demo = MHE_TEST_SOURCE_DIR "/models/arm19";
    char yaml[1024];
    (void)snprintf(yaml, sizeof yaml,
                   "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"
                   "data: {markers: %s/demo_markers.trc, emg: %s/demo_emg.sto}\n"
                   "initial: {q: [-0.1, -0.3, -0.1, 0.1], qdot: [0, 0, 0, 0]}\n"
                   "horizon: {window: 7, ratio: 2}\ncosts: [mhe.cost.emg-markers-high]\n"
                   "solver: {plugin: mhe.solver.rti, preset: %s}\nrealtime: {threads: %d}\n",
                   demo, demo, preset, threads);
    test_fixture f;
    if (test_fixture_open(&f, yaml) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    assert_int_equal(mhi_ocp_face(f.ocp)->n_workers, threads);
    const mhe_description *d = mhi_system_description(f.system);
    mhi_recording *r = NULL;
    assert_int_equal(mhi_recording_read(f.run, d, &f.host, &r, &f.err), MHE_OK);
    *t = (trace){.width = 2 * d->n_coordinates + 3 * d->n_muscles + 2};
    t->values = calloc((size_t)r->n_frames * (size_t)t->width, sizeof(double));
    assert_non_null(t->values);
    for (int32_t k = 0; k < r->n_frames; k++) {
        const mhe_frame frame = {.size = sizeof frame,
                                 .time = r->time[k],
                                 .markers = r->markers + k * 3 * d->n_markers,
                                 .emg = r->emg + k * d->n_muscles};
        mhe_estimate e = {.size = sizeof e};
        int32_t ready = 0;
        assert_int_equal(mhe_estimator_push(f.estimator, &frame, &e, &ready, &f.err), MHE_OK);
        if (ready) {
            record(t, &e, d);
        }
    }
    mhi_recording_free(r);
    test_fixture_close(&f);
}

static void same_bits(const char *preset) {
    trace one;
    follow(preset, 1, &one);
    assert_true(one.n > 100);
    for (int threads = 2; threads <= 3; threads++) {
        trace more;
        follow(preset, threads, &more);
        assert_int_equal(more.n, one.n);
        assert_memory_equal(more.values, one.values,
                            sizeof(double) * (size_t)one.n * (size_t)one.width);
        free(more.values);
    }
    free(one.values);
}

static void real_time_iterations(void **state) {
    (void)state;
    same_bits("speed");
}

static void converged(void **state) {
    (void)state;
    same_bits("robust");
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(real_time_iterations),
                                       cmocka_unit_test(converged)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
