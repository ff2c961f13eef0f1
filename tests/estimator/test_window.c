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
    mhe_estimate e = {.size = sizeof e};
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
    mhe_estimate e = {.size = sizeof e};
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
    mhe_estimate e = {.size = sizeof e};
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
    mhe_estimate e = {.size = sizeof e};
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

/* A refused window used to keep its oldest frame, and the next one was written past the end. */
static void after_a_refusal_frames_go_on(void **state) {
    (void)state;
    held h;
    open_held(&h);
    mhe_estimate e = {.size = sizeof e};
    double far[3 * N_K];
    int32_t n_refused = 0, n_ready = 0;
    for (int32_t i = 0; i < 3 * N_K; i++) {
        far[i] = 1000 * h.markers[i];
    }
    for (int32_t k = 0; k < 60; k++) {
        int32_t ready = 0;
        n_refused += push(&h, 0.01 * k, k < 30 ? far : h.markers, &e, &ready) == MHE_E_INPUT;
        n_ready += ready;
    }
    assert_int_equal(n_refused, 10); /* every second frame from the 11th to the 29th */
    assert_int_equal(n_ready, 15);
    for (int32_t i = 0; i < N_Q; i++) {
        assert_true(fabs(e.q[i] - posture[i]) < 0.05);
    }
    test_fixture_close(&h.f);
}

/* A known posture says nothing of its velocity. */
static void start_without_velocity_is_free_to_move(void **state) {
    (void)state;
    test_fixture f;
    const double speed = 1.0;
    double q[N_Q] = {-0.1, -0.3, -0.1, 0.4}, markers[3 * N_K];
    if (test_fixture_open(&f, "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"
                              "horizon: {window: 5, ratio: 1}\n"
                              "initial: {q: [-0.1, -0.3, -0.1, 0.4]}\n"
                              "costs: [mhe.cost.min-excitation]\n") != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    mhe_estimate e = {.size = sizeof e};
    int32_t ready = 0;
    for (int32_t k = 0; k <= 5; k++) {
        const mhe_frame frame = {.size = sizeof frame, .time = 0.01 * k, .markers = markers};
        q[3] = posture[3] + speed * frame.time;
        assert_int_equal(mhi_system_markers(mhi_ocp_context(f.ocp), q, markers, NULL, NULL),
                         MHE_OK);
        assert_int_equal(mhe_estimator_push(f.estimator, &frame, &e, &ready, &f.err), MHE_OK);
    }
    assert_true(ready);
    assert_true(fabs(e.qdot[3] - speed) < 0.2);
    test_fixture_close(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(estimates_belong_to_the_oldest_frame),
                                       cmocka_unit_test(gaps_are_bridged),
                                       cmocka_unit_test(time_must_increase),
                                       cmocka_unit_test(markers_in_millimetres_are_refused),
                                       cmocka_unit_test(after_a_refusal_frames_go_on),
                                       cmocka_unit_test(start_without_velocity_is_free_to_move)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
