/* SPDX-License-Identifier: Apache-2.0 */
/* Errors against a reference that is known for a part of the frames only. */
#include "estimator/errors.h"
#include "fixture.h"
#include "support.h"

#include <math.h>

#define N_Q 4
#define N_K 8
#define N_M 19
#define N_FRAMES 3 /* the reference knows the first two */

static double q[N_FRAMES * N_Q], zero_q[N_FRAMES * N_Q], half_m[N_FRAMES * N_M];
static double unknown_m[N_FRAMES * N_M], markers[3 * N_K], force[N_M];
static double times[N_FRAMES] = {0, 0.01, 0.02};

static void reference_may_end_before_the_frames(void **state) {
    (void)state;
    test_fixture f;
    if (test_fixture_open(&f, "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"
                              "costs: [mhe.cost.min-excitation]\n") != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    for (int32_t i = 0; i < N_FRAMES * N_Q; i++) {
        q[i] = i < 2 * N_Q ? 0.1 : NAN;
    }
    for (int32_t i = 0; i < N_FRAMES * N_M; i++) {
        half_m[i] = 0.5;
        unknown_m[i] = NAN;
    }
    const mhi_recording recording = {.n_frames = N_FRAMES,
                                     .time = times,
                                     .reference = {.present = 1,
                                                   .q = q,
                                                   .qdot = zero_q,
                                                   .activation = half_m,
                                                   .excitation = half_m,
                                                   .force = unknown_m}};
    mhi_errors *errors = NULL;
    const mhi_system *system = mhi_estimator_system(f.estimator);
    assert_int_equal(mhi_errors_create(system, &recording, &errors, &f.err), MHE_OK);
    assert_int_equal(mhi_system_markers(mhi_ocp_context(f.ocp), q, markers, NULL, NULL), MHE_OK);
    markers[0] += 0.003;
    const double off[N_Q] = {0.1 + 0.02, 0.1, 0.1, 0.1};
    for (int32_t k = 0; k < N_FRAMES; k++) {
        const mhe_estimate estimate = {.size = sizeof estimate,
                                       .time = times[k],
                                       .q = off,
                                       .qdot = zero_q,
                                       .activation = half_m,
                                       .excitation = half_m,
                                       .force = force,
                                       .markers = markers};
        assert_int_equal(mhi_errors_add(errors, &estimate, &f.err), MHE_OK);
    }
    mhi_rmse rmse;
    mhi_errors_rmse(errors, 0, 0, &rmse);
    assert_true(fabs(rmse.q - 0.02 / N_Q) < 1e-12);
    assert_true(fabs(rmse.marker - 0.003 / N_K) < 1e-9);
    assert_true(rmse.qdot == 0 && rmse.activation == 0 && rmse.excitation == 0);
    assert_true(rmse.force > 1); /* computed from the states of the frames that are known */
    mhi_errors_free(errors);
    test_fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(reference_may_end_before_the_frames)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
