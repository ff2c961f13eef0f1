/* SPDX-License-Identifier: Apache-2.0 */
/* A window that begins and has not the time or the work for it goes on in the frames behind it: no
 * recording is lost for the want of one long frame. Time is counted in looks at the clock, as a
 * replay has them, so that nothing depends on the machine. */
#include "estimator/estimator_private.h"
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NEAR 0.01 /* rad, of the reference, at the end */
#define ELASTIC_FRAMES 60
#define SOON 12 /* estimates within which a window that was cut settles */

typedef struct run_of {
    int32_t looks; /* that find time left, of each frame; 0: no clock */
    double first;  /* part of the first window's work that there is */
    int32_t wrong; /* so many frames have markers anywhere, drawn from this: */
    uint64_t seed;
    const char *elastic; /* curves of elastic tendons, other than the recording's; NULL: rigid */
    int32_t settled;     /* estimates until it was, the first time */
    int32_t cut;         /* those of them without a single step */
    int32_t status;      /* of the first */
    double off;          /* largest error of an angle in the last twenty estimates, rad */
} run_of;

static void push(test_fixture *f, const mhi_recording *r, int32_t k, run_of *o, uint64_t *seed,
                 mhe_estimate *e, int32_t *ready) {
    const int32_t n_k = 3 * mhi_system_description(f->system)->n_markers;
    double markers[96];
    assert_true(n_k <= 96);
    for (int32_t i = 0; i < n_k; i++) {
        markers[i] = k < o->wrong ? test_random(seed, -0.9, 0.9) : r->markers[k * n_k + i];
    }
    const int32_t n_m = mhi_system_description(f->system)->n_muscles;
    const mhe_frame frame = {
        .size = sizeof frame, .time = r->time[k], .markers = markers, .emg = r->emg + k * n_m};
    const mhe_grant grant = {.by_clock = 1, .refused = -1, .looks = {o->looks, 1000000}};
    *ready = 0;
    mhi_estimator_grant(f->estimator, o->looks > 0 ? &grant : NULL);
    assert_int_equal(mhe_estimator_push(f->estimator, &frame, e, ready, &f->err), MHE_OK);
}

static void run(const char *solver, run_of *o) {
    test_fixture f;
    mhi_recording *r = NULL;
    char yaml[2048], muscle[100] = "{curves: paper2021}";
    uint64_t seed = o->seed;
    const char *demo = MHE_TEST_SOURCE_DIR "/models/arm19";
    if (o->elastic != NULL) {
        (void)snprintf(muscle, sizeof muscle, "{curves: %s, tendon: elastic}", o->elastic);
    }
    (void)snprintf(yaml, sizeof yaml,
                   "model: {file: $ARM19}\nmuscle: %s\n"
                   "data: {markers: %s/demo_markers.trc, emg: %s/demo_emg.sto,\n"
                   "       reference: %s/demo_reference.sto}\n"
                   "horizon: {window: 7, ratio: 1}\ncosts: [mhe.cost.emg-markers-high]\n%s"
                   "solver: %s\noutput: {node: last}\n",
                   muscle, demo, demo, demo,
                   o->elastic != NULL ? "integrator: {max_step: 0.01}\n" : "", solver);
    if (test_fixture_open(&f, yaml) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    const mhe_description *model = mhi_system_description(f.system);
    if (mhi_recording_read(f.run, model, &f.host, &r, &f.err) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    f.estimator->pace.first *= o->first;
    f.estimator->pace.later *= o->first;
    f.estimator->pace.all_first *= o->first;
    int32_t n = 0;
    o->settled = -1;
    o->cut = 0;
    o->off = 0;
    const int32_t n_frames = o->elastic != NULL ? ELASTIC_FRAMES : r->n_frames;
    for (int32_t k = 0; k < n_frames; k++) {
        mhe_estimate e = {.size = sizeof e};
        int32_t ready;
        push(&f, r, k, o, &seed, &e, &ready);
        (void)mhe_estimator_prepare(f.estimator, &f.err);
        n += ready;
        o->status = ready && n == 1 ? e.status : o->status;
        if (ready && e.phase == MHE_PHASE_RUNNING && o->settled < 0) {
            o->settled = n;
        }
        o->cut += ready && o->settled < 0 && e.iterations == 0;
        for (int32_t i = 0; i < f.estimator->n_q && ready && k >= n_frames - 20; i++) {
            const double off = fabs(e.q[i] - r->reference.q[k * f.estimator->n_q + i]);
            o->off = off <= o->off ? o->off : off; /* NaN stays */
        }
    }
    mhi_recording_free(r);
    test_fixture_close(&f);
}

static const char *const presets[] = {"{preset: speed}", "{preset: balanced}"};

/* So few looks that no frame brings the whole beginning, some not even one step of it. */
static void by_the_clock(void **state) {
    (void)state;
    int32_t stuck = 0;
    for (int s = 0; s < 2; s++) {
        for (int32_t looks = 14; looks <= 46; looks += 8) {
            run_of o = {.looks = looks, .first = 1};
            run(presets[s], &o);
            print_message("%s, %d looks a frame: settled with estimate %d, %d without a step, "
                          "angles %.2g rad off at the end\n",
                          presets[s], (int)looks, (int)o.settled, (int)o.cut, o.off);
            assert_true(o.settled > 0 && o.settled <= SOON);
            assert_true(o.off <= NEAR);
            stuck += o.cut > 0 && o.settled > 1;
        }
    }
    assert_true(stuck > 0); /* or the looks were no scarcity */
}

/* Elastic tendons of other curves on data of rigid ones: what their first windows take, and a
 * quarter of it, which is more than the first frame has. */
static void by_work(void **state) {
    (void)state;
    static const char *const curves[] = {"degroote2016", "millard2012", "thelen2003"};
    for (int i = 0; i < 4; i++) {
        run_of o = {.first = i < 3 ? 1 : 0.25, .elastic = curves[i % 3]};
        run(presets[1], &o);
        print_message("%s, elastic, %g of the work: settled with estimate %d, status %d, angles "
                      "%.2g rad off\n",
                      o.elastic, o.first, (int)o.settled, (int)o.status, o.off);
        assert_true(o.settled > 0 && o.settled <= SOON);
        assert_true(o.off <= NEAR);
        assert_true(i < 3 || o.status != MHE_FRAME_OK); /* or it was no scarcity */
    }
}

/* Markers anywhere use up all that a beginning may take; what is right afterwards is found, from
 * whatever they led to. These draws are the ones of the first thirty after which a beginning once
 * rested for good; MHE_DRAWS: so many others. */
static void after_what_was_wrong(void **state) {
    (void)state;
    static const uint64_t draws[] = {1, 5, 10, 15, 19, 20, 23, 25};
    const char *more = getenv("MHE_DRAWS");
    const int n = more != NULL ? atoi(more) : (int)(sizeof draws / sizeof draws[0]);
    for (int s = 0; s < 2; s++) {
        for (int i = 0; i < n; i++) {
            run_of o = {.first = 1, .wrong = 60, .seed = more != NULL ? (uint64_t)i + 1 : draws[i]};
            run(presets[s], &o);
            print_message("%s, draw %d, wrong for 60 frames: angles %.2g rad off at the end\n",
                          presets[s], (int)o.seed, o.off);
            assert_true(o.off <= NEAR);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(by_the_clock), cmocka_unit_test(by_work),
                                       cmocka_unit_test(after_what_was_wrong)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
