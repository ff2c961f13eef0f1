/* SPDX-License-Identifier: Apache-2.0 */
/* Once the first window is solved, a frame takes no memory: pushed, prepared, with faults in the
 * data, on one thread and on several. */
#include "allocations.h"
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <stdio.h>

#define FRAMES 100 /* counted */
#define MANY 5000

/* Estimates after the first one, and what all threads allocated for them. */
typedef struct tally {
    int32_t n_estimates;
    uint64_t n_allocations;
} tally;

static void open_demo(test_fixture *f, const char *formulation, const char *preset, int threads,
                      mhi_recording **recording) {
    char yaml[2048];
    const char *demo = MHE_TEST_SOURCE_DIR "/models/arm19";
    (void)snprintf(yaml, sizeof yaml,
                   "model: {file: $ARM19}\nformulation: %s\n"
                   "data: {markers: %s/demo_markers.trc, emg: %s/demo_emg.sto}\n"
                   "horizon: {window: 7, ratio: 1}\ncosts: [mhe.cost.emg-markers-high]\n"
                   "solver: {plugin: mhe.solver.rti, preset: %s, tolerance: 1e-5}\n"
                   "realtime: {threads: %d}\n",
                   formulation, demo, demo, preset, threads);
    if (test_fixture_open(f, yaml) != MHE_OK) {
        fail_msg("%s", f->err.text);
    }
    if (mhi_recording_read(f->run, mhi_system_description(f->system), &f->host, recording,
                           &f->err) != MHE_OK) {
        fail_msg("%s", f->err.text);
    }
}

/* Every kind of missing or wrong measurement; after the last one, three frames in a row that do
 * not fit, the window begins again from its measurements. */
static void spoil(int32_t counted, mhe_frame *frame, double *far, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        far[i] = frame->markers[i] + 0.5;
    }
    frame->markers = counted == 20 ? NULL : counted >= 60 && counted < 64 ? far : frame->markers;
    frame->emg = counted == 30 ? NULL : frame->emg;
}

/* The recording to and fro, without end. */
static int32_t to_and_fro(int32_t k, int32_t n) {
    const int32_t at = k % (2 * n - 2);
    return at < n ? at : 2 * n - 2 - at;
}

static void count(const char *formulation, const char *preset, int threads, int32_t n_estimates,
                  tally *result) {
    test_fixture f;
    mhi_recording *r = NULL;
    double far[512];
    int32_t begun = 0;
    open_demo(&f, formulation, preset, threads, &r);
    const mhe_description *d = mhi_system_description(f.system);
    assert_true(3 * d->n_markers <= 512);
    assert_true(mhi_allocations_of_all() > 0); /* so they are counted */
    *result = (tally){0};
    for (int32_t k = 0; k < 2 * n_estimates && result->n_estimates < n_estimates; k++) {
        const ptrdiff_t at = to_and_fro(k, r->n_frames);
        mhe_frame frame = {.size = sizeof frame,
                           .time = k / r->rate,
                           .markers = r->markers + at * 3 * d->n_markers,
                           .emg = r->emg + at * d->n_muscles};
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        spoil(result->n_estimates, &frame, far, 3 * d->n_markers);
        const uint64_t before = mhi_allocations_of_all();
        assert_int_equal(mhe_estimator_push(f.estimator, &frame, &estimate, &ready, &f.err),
                         MHE_OK);
        assert_int_equal(mhe_estimator_prepare(f.estimator, &f.err), MHE_OK);
        result->n_allocations += begun ? mhi_allocations_of_all() - before : 0;
        result->n_estimates += begun && ready;
        begun |= ready;
    }
    mhi_recording_free(r);
    test_fixture_close(&f);
}

static void frames_take_no_memory(void **state) {
    (void)state;
    static const struct {
        const char *formulation, *preset;
        int threads;
        int32_t n_estimates;
    } cases[] = {{"excitation", "speed", 1, MANY},
                 {"excitation", "speed", 3, FRAMES},
                 {"excitation", "robust", 1, FRAMES},
                 {"activation", "speed", 1, FRAMES}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        tally t;
        count(cases[i].formulation, cases[i].preset, cases[i].threads, cases[i].n_estimates, &t);
        print_message("%s, %s, %d threads: %llu allocations in %d frames\n", cases[i].formulation,
                      cases[i].preset, cases[i].threads, (unsigned long long)t.n_allocations,
                      t.n_estimates);
        assert_int_equal(t.n_estimates, cases[i].n_estimates);
        assert_int_equal(t.n_allocations, 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(frames_take_no_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
