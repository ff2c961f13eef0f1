/* SPDX-License-Identifier: Apache-2.0 */
/* Does a cost on the rate of a signal make the estimate smoother, is the window's shift right with
 * what it carries, and do both solvers find the same? */
#include "estimator/estimator_private.h"
#include "estimator/recording.h"
#include "fixture.h"
#include "use.h"

#include <math.h>
#include <string.h>

#define N_Q 4
#define N_M 19
#define N_K 8
#define FRAMES 80
#define MODELS MHE_TEST_SOURCE_DIR "/models/arm19/"

/* The demo's motion; the solver, and costs beside the EMG and markers. */
static void open_rig(test_fixture *f, mhi_recording **r, const char *solver, const char *more) {
    char yaml[2048];
    (void)snprintf(yaml, sizeof yaml,
                   "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"
                   "data: {markers: " MODELS "demo_markers.trc, emg: " MODELS "demo_emg.sto}\n"
                   "horizon: {window: 7, ratio: 1}\n"
                   "costs: [mhe.cost.emg-markers-high%s]\nsolver: %s\n",
                   more, solver);
    if (test_fixture_open(f, yaml) != MHE_OK ||
        mhi_recording_read(f->run, mhi_system_description(f->system), &f->host, r, &f->err) !=
            MHE_OK) {
        fail_msg("%s", f->err.text);
    }
}

typedef struct outcome {
    int32_t n, converged, predicted;
    double moment[FRAMES][N_Q], force[FRAMES][N_M];
    double carried; /* largest difference of what the next window carries and this node's moment */
} outcome;

static void run(const char *solver, const char *more, double noise, outcome *o) {
    test_fixture f;
    mhi_recording *r = NULL;
    uint64_t seed = 5;
    memset(o, 0, sizeof *o);
    open_rig(&f, &r, solver, more);
    const int32_t n_x = mhi_system_face(f.system)->n_x;
    for (int32_t k = 0; k < FRAMES; k++) {
        const mhe_frame frame = mhi_recording_frame(r, N_K, N_M, k);
        mhe_estimate e = {.size = sizeof e};
        int32_t ready = 0;
        for (int32_t i = 0; i < N_M; i++) { /* flat noise, as raw EMG leaves in an envelope */
            double *emg = &r->emg[k * N_M + i];
            *emg = fmin(fmax(*emg + test_random(&seed, -noise, noise), 0), 1);
        }
        assert_int_equal(mhe_estimator_push(f.estimator, &frame, &e, &ready, &f.err), MHE_OK);
        if (!ready) {
            continue;
        }
        o->predicted += e.status == MHE_FRAME_PREDICTED;
        o->converged += e.status == MHE_FRAME_OK;
        for (int32_t i = 0; i < mhi_ocp_face(f.ocp)->n_x - n_x; i++) {
            const double carried =
                mhi_ocp_signals(f.ocp)->signal[MHI_N_SIGNALS + MHI_SIGNAL_JOINT_MOMENT].scale *
                f.estimator->window.solution.x[n_x + i];
            o->carried = fmax(o->carried, fabs(carried - e.moment[i]));
        }
        memcpy(o->moment[o->n], e.moment, sizeof o->moment[0]);
        memcpy(o->force[o->n++], e.force, sizeof o->force[0]);
    }
    mhi_recording_free(r);
    test_fixture_close(&f);
}

/* RMS rate of the joint moments, N m / s. */
static double roughness(const outcome *o) {
    double squares = 0;
    for (int32_t k = 1; k < o->n; k++) {
        for (int32_t i = 0; i < N_Q; i++) {
            const double rate = (o->moment[k][i] - o->moment[k - 1][i]) / 0.01;
            squares += rate * rate;
        }
    }
    return sqrt(squares / ((o->n - 1) * N_Q));
}

static double apart(const double *a, const double *b, int32_t n) {
    double squares = 0;
    for (int32_t i = 0; i < n; i++) {
        squares += (a[i] - b[i]) * (a[i] - b[i]);
    }
    return sqrt(squares / n);
}

static const char *const rti = "{plugin: mhe.solver.rti, preset: robust, tolerance: 1e-7}";
static const char *const ipopt = "{plugin: mhe.solver.ipopt}";
static const char *const rate = ", {plugin: mhe.cost.rate, signal: joint_moment, weight: 0.3}";
static outcome quiet, plain, smooth, by_ipopt; /* large */

static void torques_get_smoother(void **state) {
    (void)state;
    run(rti, "", 0, &quiet);
    run(rti, "", 0.05, &plain);
    run(rti, rate, 0.05, &smooth);
    const double before = apart(plain.moment[0], quiet.moment[0], plain.n * N_Q);
    const double after = apart(smooth.moment[0], quiet.moment[0], plain.n * N_Q);
    print_message(
        "joint moments change by %.1f N m/s without noise, %.1f with, %.1f with the cost; "
        "off by %.3f and %.3f N m; %d and %d of %d converged\n",
        roughness(&quiet), roughness(&plain), roughness(&smooth), before, after, plain.converged,
        smooth.converged, smooth.n);
    assert_int_equal(smooth.n, plain.n);
    assert_int_equal(smooth.predicted, 0);
    assert_true(roughness(&plain) > 1.2 * roughness(&quiet));
    assert_true(roughness(&smooth) < 0.8 * roughness(&plain));
    assert_true(smooth.converged > smooth.n / 2);
}

/* What the window carries on is the moment of the node that it drops. */
static void the_shift_keeps_the_node_before(void **state) {
    (void)state;
    print_message("carried and estimated moments differ by at most %.1e N m\n", smooth.carried);
    assert_true(smooth.carried > 0); /* two ways to the same number */
    assert_true(smooth.carried < 1e-3);
}

static void both_solvers_find_it(void **state) {
    (void)state;
    if (test_plugin("mhe.solver.ipopt", MHE_SOLVER_IFACE) == NULL) {
        skip();
    }
    run(ipopt, rate, 0.05, &by_ipopt);
    assert_int_equal(by_ipopt.n, smooth.n);
    const double force = apart(by_ipopt.force[10], smooth.force[10], (smooth.n - 10) * N_M);
    print_message("forces by Ipopt and by mhe.solver.rti: %.4f N apart\n", force);
    assert_true(force < 0.1);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(torques_get_smoother),
                                       cmocka_unit_test(the_shift_keeps_the_node_before),
                                       cmocka_unit_test(both_solvers_find_it)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
