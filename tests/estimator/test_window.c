/* SPDX-License-Identifier: Apache-2.0 */
/* The moving window on an arm held still: when estimates come, what they belong to, and what bad
 * frames do. */
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <string.h>

#define N_Q 4
#define N_K 8
#define N_M 19

static const char config[] = "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"
                             "horizon: {window: 5, ratio: 2}\n"
                             "costs: [mhe.cost.min-excitation]\n";
static const double posture[N_Q] = {-0.1, -0.3, -0.1, 0.4};

typedef struct held {
    test_fixture f;
    double markers[3 * N_K];
} held;

static void open_held(held *h) {
    if (test_fixture_open(&h->f, config) != MHE_OK) {
        fail_msg("%s", h->f.err.text);
    }
    assert_int_equal(mhi_system_markers(mhi_ocp_context(h->f.ocp), posture, h->markers, NULL, NULL),
                     MHE_OK);
}

static int all_finite(const double *values, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        if (!isfinite(values[i])) {
            return 0;
        }
    }
    return 1;
}

static void check_finite(const mhe_estimate *e) {
    assert_true(all_finite(e->q, N_Q) && all_finite(e->qdot, N_Q));
    assert_true(all_finite(e->activation, N_M) && all_finite(e->excitation, N_M));
    assert_true(all_finite(e->force, N_M) && all_finite(e->moment, N_Q));
    assert_true(all_finite(e->markers, 3 * N_K));
}

static mhe_status push(held *h, double time, const double *markers, mhe_estimate *e,
                       int32_t *ready) {
    const mhe_frame frame = {.size = sizeof frame, .time = time, .markers = markers};
    return mhe_estimator_push(h->f.estimator, &frame, e, ready, &h->f.err);
}

static void estimates_belong_to_the_oldest_frame(void **state) {
    (void)state;
    held h;
    open_held(&h);
    mhe_estimate e;
    for (int32_t k = 0; k < 20; k++) {
        int32_t ready = 0;
        assert_int_equal(push(&h, 5 + 0.01 * k, h.markers, &e, &ready), MHE_OK);
        assert_int_equal(ready, k >= 10 && k % 2 == 0);
        if (ready) {
            assert_true(fabs(e.time - (5 + 0.01 * (k - 10))) < 1e-9);
            assert_int_equal(e.status, MHE_FRAME_OK);
            check_finite(&e);
            for (int32_t i = 0; i < N_Q; i++) {
                assert_true(fabs(e.q[i] - posture[i]) < 0.02);
            }
            assert_true(e.marker_rms < 5e-3);
            assert_true(isnan(e.emg_rms));
        }
    }
    test_fixture_close(&h.f);
}

static void gaps_are_bridged(void **state) {
    (void)state;
    held h;
    open_held(&h);
    mhe_estimate e;
    double partial[3 * N_K];
    for (int32_t k = 0; k < 60; k++) {
        for (int32_t i = 0; i < 3 * N_K; i++) {
            const int lost = k < 30 ? i / 3 == k % N_K : i / 3 < 6;
            partial[i] = lost ? NAN : h.markers[i];
        }
        int32_t ready = 0;
        const int none = k >= 40 && k < 50;
        assert_int_equal(push(&h, 0.01 * k, none ? NULL : partial, &e, &ready), MHE_OK);
        if (ready) {
            check_finite(&e);
            for (int32_t i = 0; i < N_Q; i++) {
                assert_true(fabs(e.q[i] - posture[i]) < 0.2);
            }
        }
    }
    test_fixture_close(&h.f);
}

static void time_must_increase(void **state) {
    (void)state;
    held h;
    open_held(&h);
    mhe_estimate e;
    int32_t ready = 0;
    assert_int_equal(push(&h, 1, h.markers, &e, &ready), MHE_OK);
    assert_int_equal(push(&h, 1, h.markers, &e, &ready), MHE_E_ARGUMENT);
    assert_int_equal(push(&h, NAN, h.markers, &e, &ready), MHE_E_ARGUMENT);
    assert_int_equal(push(&h, 1.01, h.markers, &e, &ready), MHE_OK);
    test_fixture_close(&h.f);
}

static void markers_in_millimetres_are_refused(void **state) {
    (void)state;
    held h;
    open_held(&h);
    mhe_estimate e;
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < 3 * N_K; i++) {
        h.markers[i] *= 1000;
    }
    for (int32_t k = 0; k < 11 && status == MHE_OK; k++) {
        int32_t ready = 0;
        status = push(&h, 0.01 * k, h.markers, &e, &ready);
    }
    assert_int_equal(status, MHE_E_INPUT);
    assert_non_null(strstr(h.f.err.text, "within a metre"));
    test_fixture_close(&h.f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(estimates_belong_to_the_oldest_frame), cmocka_unit_test(gaps_are_bridged),
        cmocka_unit_test(time_must_increase), cmocka_unit_test(markers_in_millimetres_are_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
