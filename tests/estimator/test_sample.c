/* SPDX-License-Identifier: Apache-2.0 */
/* emg.sample: what EMG the controls of a node are compared with, however it comes. */
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define N 4
#define RATIO 3
#define N_M 19
#define MODELS MHE_TEST_SOURCE_DIR "/models/arm19/"
#define CONFIG(COST, EMG)                                                        \
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"                       \
    "data: {markers: " MODELS "demo_markers.trc, emg: " MODELS "demo_emg.sto,\n" \
    "       reference: " MODELS "demo_reference.sto, emg_saturation: 0}\n"       \
    "costs: [" COST "]\nhorizon: {window: 4, ratio: 3}\n" EMG                    \
    "solver: {plugin: mhe.solver.rti, preset: speed, tolerance: 1e-5}\n"

typedef struct rig {
    test_fixture f;
    mhi_recording *recording;
    int32_t emg;
} rig;

static void rig_open(rig *r, const char *config) {
    if (test_fixture_open(&r->f, config) != MHE_OK ||
        mhi_recording_read(r->f.run, mhi_system_description(r->f.system), &r->f.host, &r->recording,
                           &r->f.err) != MHE_OK) {
        fail_msg("%s", r->f.err.text);
    }
    r->emg = mhe_estimator_find_channel(r->f.estimator, "emg");
}

static void rig_close(rig *r) {
    mhi_recording_free(r->recording);
    test_fixture_close(&r->f);
}

static double emg_of(const rig *r, int32_t frame, int32_t muscle) {
    return r->recording->emg[(ptrdiff_t)frame * N_M + muscle];
}

/* Where EMG is missing in a frame. */
static int32_t is_hole(int32_t frame) {
    return frame == 31 || (frame >= 45 && frame < 48);
}

/* Pushes 90 frames; their EMG with them, or `alone`. Each estimate's target is checked: its node's
 * own EMG, or the mean of those up to the next node. */
static int32_t check_targets(rig *r, int32_t mean, int32_t alone) {
    const double holes[N_M] = {[0] = NAN, [7] = NAN};
    int32_t checked = 0;
    for (int32_t k = 0; k < 90; k++) {
        mhe_frame frame = mhi_recording_frame(r->recording, 8, N_M, k);
        double emg[N_M];
        for (int32_t i = 0; i < N_M; i++) {
            emg[i] = frame.emg[i] + (is_hole(k) ? holes[i] : 0);
        }
        frame.emg = alone ? NULL : emg;
        if (alone) {
            assert_int_equal(
                mhe_estimator_measure(r->f.estimator, r->emg, frame.time, emg, &r->f.err), MHE_OK);
        }
        mhe_estimate e = {.size = sizeof e};
        int32_t ready = 0;
        assert_int_equal(mhe_estimator_push(r->f.estimator, &frame, &e, &ready, &r->f.err), MHE_OK);
        if (!ready) {
            continue;
        }
        const int32_t node = k - N * RATIO; /* the window's oldest */
        const mhe_tracked *tracked = mhe_tracked_at(&e, r->emg);
        for (int32_t i = 0; i < N_M; i++) {
            double sum = 0;
            int32_t n = 0;
            for (int32_t j = node; j < node + (mean ? RATIO : 1); j++) {
                if (!(is_hole(j) && isnan(holes[i]))) {
                    sum += emg_of(r, j, i);
                    n++;
                }
            }
            if (n > 0) {
                assert_true(fabs(tracked->target[i] - sum / n) < 1e-12);
                checked++;
            } else if (!alone) { /* alone, the sample before holds on */
                assert_true(isnan(tracked->target[i]));
            }
        }
    }
    return checked;
}

/* The new cost compares with means, the paper's with the node's own; the key overrules both. */
static void the_cost_chooses_and_the_key_overrules(void **state) {
    (void)state;
    static const struct {
        const char *config;
        int32_t mean, alone;
    } cases[] = {
        {CONFIG("mhe.cost.emg-markers", ""), 1, 0},
        {CONFIG("mhe.cost.emg-markers", ""), 1, 1},
        {CONFIG("mhe.cost.emg-markers-high", ""), 0, 0},
        {CONFIG("mhe.cost.emg-markers-high", "emg: {sample: mean}\n"), 1, 0},
        {CONFIG("mhe.cost.emg-markers", "emg: {sample: node}\n"), 0, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        rig r;
        rig_open(&r, cases[i].config);
        assert_true(check_targets(&r, cases[i].mean, cases[i].alone) > 20 * (N_M - 1));
        assert_string_equal(r.f.run->emg.sample == MHI_EMG_SAMPLE_MEAN ? "mean" : "node",
                            cases[i].mean ? "mean" : "node");
        rig_close(&r);
    }
}

/* A sample that comes a frame late changes the mean of an interval that was solved before. */
static void a_late_sample_corrects_the_mean(void **state) {
    (void)state;
    rig r;
    rig_open(&r, CONFIG("mhe.cost.emg-markers", ""));
    double target = NAN;
    for (int32_t k = 0; k < 40; k++) {
        mhe_frame frame = mhi_recording_frame(r.recording, 8, N_M, k);
        frame.emg = NULL;
        /* the EMG of frame 19 comes after frame 21, at which the interval 18 .. 20 was solved */
        for (int32_t j = k == 22 ? 19 : k; j <= k; j += k == 22 ? 3 : 1) {
            if (j != 19 || k == 22) {
                assert_int_equal(mhe_estimator_measure(r.f.estimator, r.emg, r.recording->time[j],
                                                       r.recording->emg + (ptrdiff_t)j * N_M,
                                                       &r.f.err),
                                 MHE_OK);
            }
        }
        mhe_estimate e = {.size = sizeof e};
        int32_t ready = 0;
        assert_int_equal(mhe_estimator_push(r.f.estimator, &frame, &e, &ready, &r.f.err), MHE_OK);
        if (ready && k - N * RATIO == 18) {
            target = mhe_tracked_at(&e, r.emg)->target[0];
        }
    }
    const double mean = (emg_of(&r, 18, 0) + emg_of(&r, 19, 0) + emg_of(&r, 20, 0)) / 3;
    assert_true(fabs(target - mean) < 1e-12);
    rig_close(&r);
}

/* EMG at ten times the frames' rate: a frame stands for all samples until the next one. */
static void dense_emg_is_averaged(void **state) {
    (void)state;
    test_fixture f;
    char path[320];
    mhi_recording *recording = NULL;
    for (int32_t mean = 0; mean < 2; mean++) {
        if (test_fixture_open(&f, mean ? "model: {file: $ARM19}\ndata: {markers: " MODELS
                                         "demo_markers.trc, emg: dense.sto}\n"
                                         "costs: [mhe.cost.emg-markers]\n"
                                       : "model: {file: $ARM19}\ndata: {markers: " MODELS
                                         "demo_markers.trc, emg: dense.sto}\n"
                                         "costs: [mhe.cost.emg-markers-high]\n") != MHE_OK) {
            fail_msg("%s", f.err.text);
        }
        (void)snprintf(path, sizeof path, "%s/dense.sto", f.folder);
        FILE *file = fopen(path, "w");
        assert_non_null(file);
        (void)fprintf(file, "endheader\ntime\tBRA\n");
        for (int32_t k = 0; k < 8000; k++) {
            (void)fprintf(file, "%.4f\t%.9f\n", k / 1000.0, k % 10 / 20.0);
        }
        assert_int_equal(fclose(file), 0);
        assert_int_equal(mhi_recording_read(f.run, mhi_system_description(f.system), &f.host,
                                            &recording, &f.err),
                         MHE_OK);
        int32_t n = 0;
        for (int32_t i = 0; i < recording->n_frames * N_M && n < 100 * N_M; i++) {
            const double emg = recording->emg[i];
            n++;
            if (!isnan(emg)) {
                assert_true(fabs(emg - (mean ? 4.5 / 20 : 0)) < 1e-6);
            }
        }
        mhi_recording_free(recording);
        (void)unlink(path);
        test_fixture_close(&f);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_cost_chooses_and_the_key_overrules),
        cmocka_unit_test(a_late_sample_corrects_the_mean),
        cmocka_unit_test(dense_emg_is_averaged),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
