/* SPDX-License-Identifier: Apache-2.0 */
/* Do the bands hold the truth? Of forces, nominal 95 %, with the errors that the config says.
 *
 *   test_estimator_coverage                  a slice, as a test
 *   test_estimator_coverage DRAWS REFERENCE.sto...   the table of docs/uncertainty.md
 *   test_estimator_coverage NUMBER:DRAWS REFERENCE.sto...   one of its conditions, 0 the first
 * DRAWS is the last, or FIRST-LAST. */
#include "estimator/recording.h"
#include "fixture.h"
#include "noise/noise.h"
#include "noise/random.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define N_M 19
#define N_Q 4
#define N_K 8
#define RATIO 3
#define SKIP 5
#define MODELS MHE_TEST_SOURCE_DIR "/models/arm19/"

/* What is wrong; each is told to the estimator as it is. */
typedef struct condition {
    const char *name;
    double emg, gain, strength, fiber, tendon, offset;
    int32_t learnt; /* offsets are, as the recording runs */
} condition;

static const condition conditions[] = {
    {"EMG noise 1", 1, 0, 0, 0, 0, 0, 0},        {"EMG noise 1.5", 1.5, 0, 0, 0, 0, 0, 0},
    {"EMG noise 2", 2, 0, 0, 0, 0, 0, 0},        {"gain 30 %", 0, 0.3, 0, 0, 0, 0, 0},
    {"parameters", 0, 0, 0.3, 0.05, 0.03, 0, 0}, {"all", 1, 0.2, 0.3, 0.05, 0.03, 0.005, 0},
    {"offsets", 1, 0, 0, 0, 0, 0.01, 0},         {"offsets learnt", 1, 0, 0, 0, 0, 0.01, 1},
};
#define N_CONDITIONS ((int32_t)(sizeof conditions / sizeof conditions[0]))

typedef struct count {
    double held, of;             /* forces */
    double by_muscle[N_M], each; /* of each muscle, and squares of ... */
    double below[N_M];           /* bands that lie below the truth, of each muscle */
    double force[N_M], error[N_M], band[N_M];
    double angles, of_angles, angle_squares, angle_bands;
    double first_band,
        last_band;            /* RMS of the angles' bands in a trial's first and last estimate */
    double squares, variance; /* of errors, of bands */
    /* Of each muscle over the trials: sum and squares of the share held in one. What is wrong is
     * the same all through a trial, so that trials are what counts as independent. */
    double shares[N_M], share_squares[N_M], trials;
} count;

static void write_config(const condition *c, char *yaml, size_t size) {
    (void)snprintf(yaml, size,
                   "model: {file: $ARM19}\nmuscle: {curves: paper2021, passive_ramp: 0.02}\n"
                   "horizon: {window: 7, ratio: 3}\ncosts: [mhe.cost.emg-markers]\n"
                   "output: {uncertainty: true}\n"
                   "uncertainty: {emg_noise: %g, emg_gain: %g, max_isometric_force: %g, "
                   "optimal_fiber_length: %g, tendon_slack_length: %g, path_length: 0, "
                   "marker_noise: 1e-5, marker_offset: %g, emg_floor: 0}\n%s",
                   c->emg > 0 ? 0.5 : 0, c->gain, c->strength, c->fiber, c->tendon, c->offset,
                   c->learnt ? "data: {rates: true, marker_offset: 0.01}\n" : "");
}

/* A model whose muscles are wrong. */
static mhe_description spoil(const mhe_description *d, const condition *c, int32_t seed,
                             mhe_muscle *muscles) {
    mhe_description wrong = *d;
    memcpy(muscles, d->muscles, sizeof *muscles * (size_t)N_M);
    wrong.muscles = muscles;
    for (uint32_t m = 0; m < N_M; m++) {
        const mhi_stream stream = {(uint64_t)seed, 77, m};
        double *const numbers[] = {&muscles[m].max_isometric_force,
                                   &muscles[m].optimal_fiber_length,
                                   &muscles[m].tendon_slack_length};
        const double sd[] = {c->strength, c->fiber, c->tendon};
        for (uint32_t i = 0; i < 3; i++) {
            *numbers[i] *= fmax(0.3, 1 + sd[i] * mhi_random_normal(&stream, i));
        }
    }
    return wrong;
}

static void compare(const mhe_estimate *e, const mhi_recording *r, const double *truth,
                    int32_t frame, count *to) {
    for (int32_t m = 0; m < N_M; m++) {
        const double error = e->force[m] - truth[m];
        const int32_t held = fabs(error) <= 1.96 * e->force_sd[m];
        to->held += held;
        to->below[m] += error < -1.96 * e->force_sd[m];
        to->by_muscle[m] += held;
        to->force[m] += truth[m] * truth[m];
        to->error[m] += error * error;
        to->band[m] += e->force_sd[m] * e->force_sd[m];
        to->squares += error * error;
        to->variance += e->force_sd[m] * e->force_sd[m];
    }
    to->of += N_M;
    to->each += 1;
    double band = 0;
    for (int32_t j = 0; j < N_Q; j++) {
        const double error = e->q[j] - r->reference.q[frame * N_Q + j];
        to->angles += fabs(error) <= 1.96 * e->q_sd[j];
        to->angle_squares += error * error;
        band += e->q_sd[j] * e->q_sd[j];
    }
    to->angle_bands += band;
    to->of_angles += N_Q;
    to->last_band = sqrt(band / N_Q);
    to->first_band = to->of_angles == N_Q ? to->last_band : to->first_band;
}

/* Ends a trial, of which `before` is what was counted before it. */
static void close_trial(const count *before, count *c) {
    for (int32_t m = 0; m < N_M; m++) {
        const double held = c->by_muscle[m] - before->by_muscle[m];
        const double share = held / (c->each - before->each);
        c->shares[m] += share;
        c->share_squares[m] += share * share;
    }
    c->trials++;
}

/* Standard error of a muscle's share held, by how the trials differ. */
static double standard_error(const count *c, int32_t m) {
    const double mean = c->shares[m] / c->trials;
    const double variance = fmax(0, c->share_squares[m] / c->trials - mean * mean);
    return sqrt(variance / fmax(1, c->trials - 1));
}

/* One trial: the recording of the true arm, with a model that is wrong. */
static void run(const condition *c, const char *reference, int32_t seed, count *to) {
    test_fixture f;
    char yaml[2048];
    mhe_muscle muscles[N_M];
    mhi_recording *truth = NULL, *seen = NULL;
    mhe_estimator *estimator = NULL;
    mhi_system_context *context = NULL;
    const count before = *to;
    write_config(c, yaml, sizeof yaml);
    if (test_fixture_open(&f, yaml) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    const mhe_description *d = mhi_system_description(f.system);
    mhi_noise noise = {.seed = seed};
    noise.markers.sd = c->offset;
    noise.emg.level = c->emg;
    noise.emg.gain_sd = c->gain;
    assert_int_equal(mhi_recording_read_reference(reference, d, &f.host, &truth, &f.err), MHE_OK);
    assert_int_equal(mhi_noise_recording(&noise, truth, d, f.run->model.plugin, f.run->model.config,
                                         &f.host, &seen, &f.err),
                     MHE_OK);
    const mhe_description wrong = spoil(d, c, seed, muscles);
    assert_int_equal(mhi_estimator_create_on(f.run, &wrong, &f.host, &estimator, &f.err), MHE_OK);
    assert_int_equal(mhi_system_context_create(f.system, &context, &f.err), MHE_OK);
    mhi_estimator_set_start(estimator, truth->reference.q, truth->reference.qdot);
    for (int32_t k = 0, n = 0; k < seen->n_frames; k++) {
        const mhe_frame frame = mhi_recording_frame(seen, N_K, N_M, k);
        mhe_estimate e = {.size = sizeof e};
        int32_t ready = 0;
        assert_int_equal(mhe_estimator_push(estimator, &frame, &e, &ready, &f.err), MHE_OK);
        if (ready && n++ >= SKIP) {
            const int32_t at = k - 7 * RATIO;
            mhi_muscle_state state;
            const mhe_system_point point = {.size = sizeof point,
                                            .q = truth->reference.q + at * N_Q,
                                            .v = truth->reference.qdot + at * N_Q,
                                            .a = truth->reference.activation + at * N_M};
            assert_int_equal(mhi_system_muscles(context, &point, 0, &state, &f.err), MHE_OK);
            compare(&e, truth, state.force, at, to);
        }
    }
    close_trial(&before, to);
    mhi_system_context_free(context);
    mhe_estimator_close(estimator);
    mhi_recording_free(seen);
    mhi_recording_free(truth);
    test_fixture_close(&f);
}

/* Of a condition: forces held, the least and the largest muscle, angles held, errors; and of each
 * muscle the share held with its standard error, how many misses are bands below the truth, RMS of
 * force, error and band. */
static void print_row(const condition *of, const count *c) {
    double least = 1, most = 0;
    for (int32_t m = 0; m < N_M; m++) {
        least = fmin(least, c->by_muscle[m] / c->each);
        most = fmax(most, c->by_muscle[m] / c->each);
    }
    (void)printf("%-14s %8.1f %8.1f %8.1f %8.1f %8.3f %10.2f %10.2f %7.0f %8.3f\n", of->name,
                 100 * c->held / c->of, 100 * least, 100 * most, 100 * c->angles / c->of_angles,
                 57.29578 * sqrt(c->angle_squares / c->of_angles), sqrt(c->squares / c->of),
                 sqrt(c->variance / c->of), c->trials,
                 57.29578 * sqrt(c->angle_bands / c->of_angles));
    for (int32_t m = 0; m < N_M; m++) {
        (void)printf("    %2d %6.1f +- %4.1f %6.1f %8.1f %8.2f %8.2f\n", m,
                     100 * c->by_muscle[m] / c->each, 100 * standard_error(c, m),
                     100 * c->below[m] / c->each, sqrt(c->force[m] / c->each),
                     sqrt(c->error[m] / c->each), sqrt(c->band[m] / c->each));
    }
    (void)fflush(stdout);
}

static void table(int32_t only, const char *draws, char **references, int32_t n) {
    const char *last = strchr(draws, '-');
    const int32_t from = last == NULL ? 1 : atoi(draws), to = atoi(last == NULL ? draws : last + 1);
    (void)printf("%-14s %8s %8s %8s %8s %8s %10s %10s %7s %8s\n", "", "forces", "least", "most",
                 "angles", "deg", "error (N)", "band (N)", "trials", "sd, deg");
    const int32_t first = only < 0 ? 0 : only, end = only < 0 ? N_CONDITIONS : only + 1;
    for (int32_t i = first; i < end; i++) {
        count c = {0};
        for (int32_t draw = from; draw <= to; draw++) {
            for (int32_t r = 0; r < n; r++) {
                run(&conditions[i], references[r], 1000 * r + draw, &c);
            }
        }
        print_row(&conditions[i], &c);
    }
}

/* Three seconds of motion and few draws: wide limits. The harmonics of EMG's noise have more power
 * in a trial of one cycle than in the table's of four. */
static void a_slice_of_the_table_holds(void **state) {
    (void)state;
    for (int32_t i = 0; i < N_CONDITIONS; i++) {
        count c = {0};
        for (int32_t draw = 1; draw <= 3; draw++) {
            run(&conditions[i], MODELS "demo_reference.sto", draw, &c);
        }
        const double error = sqrt(c.squares / c.of), band = sqrt(c.variance / c.of);
        print_message("%s: %.1f %%, errors %.2f N, bands %.2f N\n", conditions[i].name,
                      100 * c.held / c.of, error, band);
        assert_true(c.held > 0.85 * c.of);
        assert_true(band < 5 * error); /* wide bands hold anything */
        if (conditions[i]
                .learnt) { /* bands narrow as the arm moves, and are still those of the errors */
            print_message(
                "    angles %.1f %%, errors %.2f deg, bands %.2f, from %.2f to %.2f deg\n",
                100 * c.angles / c.of_angles, 57.29578 * sqrt(c.angle_squares / c.of_angles),
                57.29578 * sqrt(c.angle_bands / c.of_angles), 57.29578 * c.first_band,
                57.29578 * c.last_band);
            assert_true(c.angles > 0.85 * c.of_angles);
            assert_true(c.angle_bands < 9 * c.angle_squares);
            assert_true(c.last_band < 0.8 * c.first_band);
        }
    }
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_slice_of_the_table_holds)};
    if (argc > 2) {
        const char *draws = strchr(argv[1], ':');
        const int32_t only = draws == NULL ? -1 : atoi(argv[1]) % N_CONDITIONS;
        table(only, draws == NULL ? argv[1] : draws + 1, argv + 2, argc - 2);
        return 0;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
