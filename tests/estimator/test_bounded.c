/* SPDX-License-Identifier: Apache-2.0 */
/* Frames that no motion fits: none of them takes more than ten times the work of a usual one.
 *
 * Work is counted (model/work.h), not timed, so that the bound holds on any machine. A unit of hard
 * frames takes up to 1.16 times as long as one of usual frames: hence 8.6 in units for ten in
 * processor time. With --times REPEATS that is printed beside it: a frame's least of so many runs,
 * which all do the same work, since what else the machine does counts into a single one. */
#include "base/clock.h"
#include "estimator/estimator_private.h"
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define FROM 60 /* frame at which a kind begins */
#define FRAMES 220
#define MOST 8.6 /* usual frames */

static int repeats; /* of each kind, for times; 0: none are printed */

typedef struct frame_data {
    double *markers, *emg;
    int32_t k, n_k, n_m;
} frame_data;

static uint64_t seed;

static double chance(void) {
    return test_random(&seed, 0, 1);
}

static void all(double *values, int32_t n, double value) {
    for (int32_t i = 0; i < n; i++) {
        values[i] = value;
    }
}

static void nothing(const frame_data *f) {
    all(f->markers, f->n_k, NAN);
    all(f->emg, f->n_m, NAN);
}

static void no_markers(const frame_data *f) {
    all(f->markers, f->n_k, NAN);
}

static void no_markers_full_emg(const frame_data *f) {
    all(f->markers, f->n_k, NAN);
    all(f->emg, f->n_m, 0.95);
}

static void random_data(const frame_data *f) {
    for (int32_t i = 0; i < f->n_k; i++) {
        f->markers[i] = 10 * chance() - 5;
    }
    for (int32_t i = 0; i < f->n_m; i++) {
        f->emg[i] = chance();
    }
}

static void random_emg(const frame_data *f) {
    for (int32_t i = 0; i < f->n_m; i++) {
        f->emg[i] = chance();
    }
}

static void full_emg(const frame_data *f) {
    all(f->emg, f->n_m, 0.99);
}

static void storm(const frame_data *f) {
    for (int32_t i = 0; i < f->n_k; i++) {
        f->markers[i] = chance() < 0.7 ? NAN : f->markers[i];
    }
    for (int32_t i = 0; i < f->n_m; i++) {
        f->emg[i] = chance() < 0.7 ? NAN : f->emg[i];
    }
}

static void zeros(const frame_data *f) {
    all(f->markers, f->n_k, 0);
}

static void jumps(const frame_data *f) {
    for (int32_t i = 0; i < f->n_k; i++) {
        f->markers[i] += 0.1 * (f->k / 3 % 2);
    }
}

/* From here on: kinds of our own. */
static void mirrored(const frame_data *f) {
    for (int32_t i = 0; i < f->n_k; i += 3) {
        f->markers[i] = -f->markers[i];
    }
}

static void metres_off(const frame_data *f) {
    for (int32_t i = 0; i < f->n_k; i++) {
        f->markers[i] += 2;
    }
}

static void a_kilometre(const frame_data *f) {
    for (int32_t i = 0; i < f->n_k; i++) {
        f->markers[i] *= 1000;
    }
}

static void shaken(const frame_data *f) {
    for (int32_t i = 0; i < f->n_k; i++) {
        f->markers[i] += 0.3 * (chance() - 0.5);
    }
}

static void one_marker(const frame_data *f) {
    all(f->markers + 3, f->n_k - 3, NAN);
}

static void one_point(const frame_data *f) {
    for (int32_t i = 3; i < f->n_k; i++) {
        f->markers[i] = f->markers[i % 3];
    }
}

static void frozen_then_far(const frame_data *f) {
    const double turn = f->k / 10 % 2 == 0 ? 0 : 0.5;
    for (int32_t i = 0; i < f->n_k; i += 3) {
        f->markers[i] += turn;
        f->markers[i + 1] -= turn;
    }
}

static void labels_turn(const frame_data *f) {
    double first[3];
    memcpy(first, f->markers, sizeof first);
    memmove(f->markers, f->markers + 3, sizeof(double) * (size_t)(f->n_k - 3));
    memcpy(f->markers + f->n_k - 3, first, sizeof first);
}

static void infinities(const frame_data *f) {
    all(f->markers, f->n_k, f->k % 2 == 0 ? INFINITY : -INFINITY);
}

static void emg_to_and_fro(const frame_data *f) {
    all(f->emg, f->n_m, f->k % 2 == 0 ? 0.98 : 0.01);
}

static void stretched(const frame_data *f) {
    for (int32_t i = 0; i < f->n_k; i++) {
        f->markers[i] *= 1.6;
    }
}

static const struct {
    const char *name;
    void (*harm)(const frame_data *f);
} kinds[] = {{"as recorded", NULL},
             {"nothing at all", nothing},
             {"no markers", no_markers},
             {"no markers, EMG 0.95", no_markers_full_emg},
             {"random markers and EMG", random_data},
             {"random EMG", random_emg},
             {"EMG 0.99", full_emg},
             {"a storm of gaps", storm},
             {"markers 0 0 0", zeros},
             {"markers jump by 0.1 m", jumps},
             {"mirrored", mirrored},
             {"2 m off", metres_off},
             {"a kilometre", a_kilometre},
             {"0.3 m of noise", shaken},
             {"one marker left", one_marker},
             {"all markers at one point", one_point},
             {"to and fro by 0.5 m", frozen_then_far},
             {"labels on the next marker", labels_turn},
             {"infinite", infinities},
             {"EMG full and nought in turn", emg_to_and_fro},
             {"1.6 times as large", stretched}};
#define N_KINDS (sizeof kinds / sizeof kinds[0])

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

typedef struct tally {
    double usual, worst, usual_ms, worst_ms;
    int32_t at;
} tally;

static double processor_ms(void) {
    return 1e3 * (double)clock() / CLOCKS_PER_SEC;
}

/* The estimator's own count of a push and of the preparation before it; `least` [FRAMES]: ms of
 * each push, where that is less than what stands there. */
static tally count(const char *yaml, size_t kind, double *least) {
    test_fixture f;
    mhi_recording *r = NULL;
    if (test_fixture_open(&f, yaml) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    const mhe_description *model = mhi_system_description(f.system);
    if (mhi_recording_read(f.run, model, &f.host, &r, &f.err) != MHE_OK) {
        fail_msg("%s", f.err.text);
    }
    const int32_t n_k = 3 * model->n_markers, n_m = model->n_muscles;
    double markers[96], emg[96], usual[FROM], ms[FROM];
    assert_true(n_k <= 96 && n_m <= 96);
    const mhi_work *work = mhi_ocp_work(f.estimator->ocp);
    tally t = {0};
    int32_t n_usual = 0;
    seed = 7;
    for (int32_t k = 0; k < FRAMES; k++) {
        memcpy(markers, r->markers + (ptrdiff_t)k * n_k, sizeof(double) * (size_t)n_k);
        memcpy(emg, r->emg + (ptrdiff_t)k * n_m, sizeof(double) * (size_t)n_m);
        if (k >= FROM && kinds[kind].harm != NULL) {
            kinds[kind].harm(&(frame_data){markers, emg, k, n_k, n_m});
        }
        const mhe_frame frame = {
            .size = sizeof frame, .time = r->time[k], .markers = markers, .emg = emg};
        mhe_estimate e = {.size = sizeof e};
        int32_t ready = 0;
        const double ahead = f.estimator->pace.prepared;
        const int64_t before = mhi_work_total(work);
        const double start = processor_ms();
        (void)mhe_estimator_push(f.estimator, &frame, &e, &ready, &f.err);
        const double took = processor_ms() - start;
        const double units = (double)(mhi_work_total(work) - before);
        const double pushed = processor_ms();
        (void)mhe_estimator_prepare(f.estimator, &f.err);
        const double prepared = processor_ms() - pushed;
        if (ready && k >= 20 && k < FROM) {
            usual[n_usual] = units + ahead;
            ms[n_usual++] = took + prepared;
        }
        if (k >= FROM && units > t.worst) {
            t.worst = units;
            t.at = k;
        }
        least[k] = fmin(least[k], took);
    }
    assert_true(n_usual > 30);
    qsort(usual, (size_t)n_usual, sizeof *usual, by_value);
    qsort(ms, (size_t)n_usual, sizeof *ms, by_value);
    t.usual = usual[n_usual / 2];
    t.usual_ms = ms[n_usual / 2];
    mhi_recording_free(r);
    test_fixture_close(&f);
    return t;
}

static void no_frame_takes_much_more(void **state) {
    (void)state;
    static const char *const solvers[] = {"{preset: speed, tolerance: 1e-5}", "{preset: balanced}",
                                          "{preset: robust}"};
    char yaml[2048];
    int beyond = 0;
    for (size_t s = 0; s < sizeof solvers / sizeof solvers[0]; s++) {
        (void)snprintf(yaml, sizeof yaml,
                       "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"
                       "data: {markers: %s/models/arm19/demo_markers.trc, emg: "
                       "%s/models/arm19/demo_emg.sto}\n"
                       "initial: {q: [-0.1, -0.3, -0.1, 0.1], qdot: [0, 0, 0, 0]}\n"
                       "costs: [mhe.cost.emg-markers-high]\nsolver: %s\n",
                       MHE_TEST_SOURCE_DIR, MHE_TEST_SOURCE_DIR, solvers[s]);
        for (size_t kind = 0; kind < N_KINDS; kind++) {
            double least[FRAMES];
            all(least, FRAMES, INFINITY);
            tally t = count(yaml, kind, least);
            for (int i = 1; i < repeats; i++) {
                t.usual_ms = fmin(t.usual_ms, count(yaml, kind, least).usual_ms);
            }
            for (int32_t k = FROM; k < FRAMES; k++) {
                t.worst_ms = fmax(t.worst_ms, least[k]);
            }
            if (repeats > 0) {
                print_message("| %s | %s | %.0f | %.1f (frame %d) | %.2f ms | %.1f |\n", solvers[s],
                              kinds[kind].name, t.usual, t.worst / t.usual, (int)t.at, t.usual_ms,
                              t.worst_ms / t.usual_ms);
            }
            if (t.worst > MOST * t.usual) {
                print_message("%s, %s: frame %d takes %.1f times a usual one\n", solvers[s],
                              kinds[kind].name, (int)t.at, t.worst / t.usual);
                beyond++;
            }
        }
    }
    assert_int_equal(beyond, 0);
}

int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(no_frame_takes_much_more)};
    repeats = argc > 2 && strcmp(argv[1], "--times") == 0 ? atoi(argv[2]) : 0;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
