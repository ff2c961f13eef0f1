/* SPDX-License-Identifier: Apache-2.0 */
/* The demo's motion with noise (markers 5 mm, EMG level 1.5, the paper's): one real-time iteration
 * a window comes as near to the truth as windows solved to the tolerance.
 *
 * Asked: within 2 %, of tracking and of least excitation with the paper's high marker weights.
 * Measured: within 0.1 %; with the low weights it follows more slowly (docs/performance.md). The
 * ramp in the place of the paper's jump of the passive force gives every window an optimum. */
#include "base/pi.h"
#include "estimator/errors.h"
#include "fixture.h"
#include "noise/noise.h"
#include "support.h"

#include <math.h>

static void track(const char *cost, const char *preset, mhi_rmse *rmse) {
    const char *demo = MHE_TEST_SOURCE_DIR "/models/arm19/demo_reference.sto";
    char yaml[2048];
    (void)snprintf(yaml, sizeof yaml,
                   "model: {file: $ARM19}\nmuscle: {curves: paper2021, passive_ramp: 0.02}\n"
                   "formulation: excitation\ndata: {emg: %s, reference: %s}\n"
                   "horizon: {window: 7, ratio: 3}\ncosts: [%s]\n"
                   "integrator: {tolerance: 0, stages: 2, max_step: 0.03, activation_step: 3.4}\n"
                   "solver: {plugin: mhe.solver.rti, preset: %s}\n",
                   demo, demo, cost, preset);
    test_fixture f;
    mhi_recording *reference = NULL, *r = NULL;
    mhi_errors *errors = NULL;
    if (test_fixture_open(&f, yaml) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    const mhe_description *d = mhi_system_description(f.system);
    const mhi_noise noise = {.seed = 1, .markers.sd = 0.005, .emg.level = 1.5};
    assert_int_equal(mhi_recording_read(f.run, d, &f.host, &reference, &f.err), MHE_OK);
    if (mhi_noise_recording(&noise, reference, d, f.run->model.plugin, f.run->model.config, &f.host,
                            &r, &f.err) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    assert_int_equal(mhi_errors_create(f.system, r, &errors, &f.err), MHE_OK);
    mhi_estimator_set_start(f.estimator, r->reference.q, r->reference.qdot);
    for (int32_t k = 0; k < r->n_frames; k++) {
        const mhe_frame frame = mhi_recording_frame(r, d->n_markers, d->n_muscles, k);
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        assert_int_equal(mhe_estimator_push(f.estimator, &frame, &estimate, &ready, &f.err),
                         MHE_OK);
        assert_true(!ready || estimate.status != MHE_FRAME_PREDICTED);
        assert_true(!ready || mhi_errors_add(errors, &estimate, &f.err) == MHE_OK);
    }
    mhi_errors_rmse(errors, 5, 0, rmse);
    print_message("%s, %s: q %.4f deg, forces %.3f N, markers %.3f mm\n", cost, preset,
                  rmse->q * 180 / MHI_PI, rmse->force, 1e3 * rmse->marker);
    mhi_errors_free(errors);
    mhi_recording_free(r);
    mhi_recording_free(reference);
    test_fixture_close(&f);
}

static void speed_is_as_near(void **state) {
    (void)state;
    static const char *const costs[] = {"mhe.cost.emg-markers-high",
                                        "{plugin: mhe.cost.min-excitation, markers: 1e7}"};
    static const char *const presets[] = {"balanced", "speed"};
    for (size_t i = 0; i < sizeof costs / sizeof costs[0]; i++) {
        mhi_rmse converged, one;
        track(costs[i], "robust", &converged);
        for (size_t j = 0; j < 2; j++) {
            track(costs[i], presets[j], &one);
            const double ratio[] = {one.q / converged.q, one.force / converged.force,
                                    one.marker / converged.marker};
            for (int k = 0; k < 3; k++) {
                assert_true(fabs(ratio[k] - 1) <= 0.02);
            }
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(speed_is_as_near)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
