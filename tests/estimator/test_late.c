/* SPDX-License-Identifier: Apache-2.0 */
/* Measurements that come after their frame, in packets, out of order, spoiled or not at all: what
 * every node of the demo's motion ends up with. */
#include "estimator/recording.h"
#include "fixture.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define N 7
#define N_K 8
#define N_M 19
#define N_Q 4
#define PACKET 27 /* samples, as a common wireless system sends them */
#define RATE 2000.0
#define FRAMES 200
#define EMG_SAMPLES ((int32_t)(RATE * FRAMES / 100))
#define MODELS MHE_TEST_SOURCE_DIR "/models/arm19/"
#define CONFIG                                                                   \
    "model: {file: $ARM19}\nmuscle: {curves: paper2021}\n"                       \
    "data: {markers: " MODELS "demo_markers.trc, emg: " MODELS "demo_emg.sto,\n" \
    "       reference: " MODELS "demo_reference.sto}\n"                          \
    "costs: [mhe.cost.emg-markers-high]\n"                                       \
    "solver: {plugin: mhe.solver.rti, preset: speed, tolerance: 1e-5}\n"
#define BY_EXCITATION CONFIG "horizon: {window: 7, ratio: 1}\n"
#define BY_ACTIVATION CONFIG "horizon: {window: 7, ratio: 3}\nformulation: activation\n"

/* How EMG comes. */
typedef struct line {
    const char *config; /* NULL: BY_EXCITATION */
    double delay;       /* s after its last sample */
    int32_t swap;       /* packets come in pairs, the later one first */
    int32_t lose;       /* two of so many are lost; 0: none */
    int32_t frames;     /* EMG comes with its frame instead */
} line;

typedef struct outcome {
    int32_t n, n_without; /* estimates; of these without EMG at their node */
    double force[FRAMES][N_M];
    mhe_channel_counts counts;
} outcome;

typedef struct rig {
    test_fixture f;
    mhi_recording *recording;
    int32_t emg, markers; /* channels */
} rig;

static void rig_open(rig *r, const char *config) {
    if (test_fixture_open(&r->f, config) != MHE_OK ||
        mhi_recording_read(r->f.run, mhi_system_description(r->f.system), &r->f.host, &r->recording,
                           &r->f.err) != MHE_OK) {
        fail_msg("%s", r->f.err.text);
    }
    r->emg = mhe_estimator_find_channel(r->f.estimator, "emg");
    r->markers = mhe_estimator_find_channel(r->f.estimator, "markers");
    assert_true(r->emg >= 0 && r->markers >= 0);
}

static void rig_close(rig *r) {
    mhi_recording_free(r->recording);
    test_fixture_close(&r->f);
}

/* EMG at a time between the recorded frames. */
static void emg_at(const mhi_recording *r, double time, double *values) {
    const double at = (time - r->time[0]) * r->rate;
    const int32_t k = (int32_t)floor(at + 1e-9), next = k + 1 < r->n_frames ? k + 1 : k;
    for (int32_t i = 0; i < N_M; i++) {
        const double a = r->emg[(ptrdiff_t)k * N_M + i], b = r->emg[(ptrdiff_t)next * N_M + i];
        values[i] = at - k < 1e-9 ? a : a + (b - a) * (at - k);
    }
}

static double arrival(const line *l, int32_t p) {
    const int32_t last = l->swap ? p | 1 : p; /* that it waits for */
    const int32_t lost = l->lose > 0 && p % l->lose >= l->lose - 2;
    return lost ? INFINITY : (last * PACKET + PACKET - 1) / RATE + l->delay;
}

/* All packets that arrive in (from, to]. */
static void deliver(rig *r, const line *l, double from, double to) {
    double values[N_M];
    for (int32_t slot = 0; slot * PACKET < EMG_SAMPLES && !l->frames; slot++) {
        const int32_t p = l->swap ? slot ^ 1 : slot;
        const double at = arrival(l, p);
        for (int32_t i = 0; i < PACKET && at > from && at <= to + 1e-9; i++) {
            const double time = (p * PACKET + i) / RATE;
            emg_at(r->recording, r->recording->time[0] + time, values);
            assert_int_equal(mhe_estimator_measure(r->f.estimator, r->emg,
                                                   r->recording->time[0] + time, values, &r->f.err),
                             MHE_OK);
        }
    }
}

static void run(const line *l, outcome *o) {
    rig r;
    rig_open(&r, l->config == NULL ? BY_EXCITATION : l->config);
    memset(o, 0, sizeof *o);
    for (int32_t k = 0; k < FRAMES; k++) {
        mhe_frame frame = mhi_recording_frame(r.recording, N_K, N_M, k);
        mhe_estimate e = {.size = sizeof e};
        int32_t ready = 0;
        frame.emg = l->frames ? frame.emg : NULL;
        deliver(&r, l, k == 0 ? -INFINITY : (k - 1) / 100.0, k / 100.0);
        assert_int_equal(mhe_estimator_push(r.f.estimator, &frame, &e, &ready, &r.f.err), MHE_OK);
        if (ready) {
            const mhe_tracked *t = mhe_tracked_at(&e, r.emg);
            o->n_without += t->n_measured == 0;
            assert_true(t->n_measured == 0 || t->n_measured == N_M);
            memcpy(o->force[o->n++], e.force, sizeof o->force[0]);
        }
    }
    o->counts.size = sizeof o->counts;
    assert_int_equal(mhe_estimator_counts(r.f.estimator, r.emg, &o->counts), MHE_OK);
    rig_close(&r);
}

/* RMS difference of the forces, N, from the second half on. */
static double apart(const outcome *a, const outcome *b) {
    double squares = 0;
    assert_int_equal(a->n, b->n);
    for (int32_t k = a->n / 2; k < a->n; k++) {
        for (int32_t i = 0; i < N_M; i++) {
            const double d = a->force[k][i] - b->force[k][i];
            squares += d * d;
        }
    }
    return sqrt(squares / ((a->n - a->n / 2) * N_M));
}

static outcome in_time, late; /* large */

static void no_frame_loses_its_emg(void **state) {
    (void)state;
    static const double delays[] = {0, 0.005, 0.012, 0.040};
    run(&(line){.frames = 1}, &in_time);
    assert_int_equal(in_time.n_without, 0);
    for (size_t i = 0; i < sizeof delays / sizeof delays[0]; i++) {
        run(&(line){.delay = delays[i]}, &late);
        const double force = apart(&in_time, &late);
        print_message(
            "packets %2.0f ms late: %d of %d estimates without EMG, %lld samples dropped, "
            "%lld nodes filled afterwards, forces %.2f N from those in time\n",
            1e3 * delays[i], late.n_without, late.n, (long long)late.counts.n_dropped,
            (long long)late.counts.n_late_nodes, force);
        assert_int_equal(late.n_without, 0);
        assert_int_equal(late.counts.n_empty, 0);
        assert_int_equal(late.counts.n_dropped, 0);
        assert_true(late.counts.n_late_nodes > (delays[i] > 0.01 ? FRAMES - 20 : 20));
        assert_true(force > 0); /* or the packets were not late at all */
        assert_true(force < 3);
    }
}

/* EMG may also be there before its frame: the camera's way is the longer one. */
static void early_emg_waits(void **state) {
    (void)state;
    static outcome early;
    run(&(line){.delay = -0.050}, &early);
    print_message("packets 50 ms early: forces %.1e N from those in time\n",
                  apart(&in_time, &early));
    assert_int_equal(early.n_without, 0);
    assert_int_equal(early.counts.n_late_nodes, 0);
    assert_true(apart(&in_time, &early) < 1e-9); /* as if it had come with the frames */
}

/* Every third frame is a node, which tracks the EMG of two frames ago: so do late samples. */
static void delay_and_ratio_hold_for_samples(void **state) {
    (void)state;
    static outcome on_time, after;
    run(&(line){.config = BY_ACTIVATION, .frames = 1}, &on_time);
    run(&(line){.config = BY_ACTIVATION, .delay = 0.040}, &after);
    const double force = apart(&on_time, &after);
    print_message("by activation, every third frame: forces %.2f N from those in time\n", force);
    assert_true(after.n_without <= 1); /* the first node would need EMG from before the first */
    assert_int_equal(after.counts.n_dropped, 0);
    assert_true(force > 0 && force < 1);
}

/* Every node has the EMG that a frame would have brought, whatever the packets' order. */
static void order_does_not_matter(void **state) {
    (void)state;
    static outcome swapped;
    run(&(line){.delay = 0.012, .swap = 1}, &swapped);
    assert_int_equal(swapped.n_without, 0);
    assert_int_equal(swapped.counts.n_dropped, 0);
    print_message("in pairs, the later first: forces %.2f N from those in time\n",
                  apart(&in_time, &swapped));
    assert_true(apart(&in_time, &swapped) < 3);
}

/* 27 ms are gone then: a node or two, no more, and it is said of these alone. */
static void lost_packets_are_a_gap(void **state) {
    (void)state;
    static outcome lossy;
    run(&(line){.delay = 0.012, .lose = 10}, &lossy);
    const int32_t lost = EMG_SAMPLES / PACKET / 10;
    print_message("%d pairs of packets lost: %d of %d estimates without EMG\n", lost,
                  lossy.n_without, lossy.n);
    assert_true(lossy.n_without >= lost);
    assert_true(lossy.n_without <= 2 * lost);
}

static void what_is_too_late_is_counted(void **state) {
    (void)state;
    run(&(line){.delay = 0.120}, &late);
    assert_int_equal(late.n_without, late.n);
    assert_true(late.counts.n_dropped > EMG_SAMPLES / 2);
    assert_true(late.counts.n_empty == late.counts.n_nodes);
}

/* Markers come 15 ms late, one of them in one sample half a metre off: that one is left out, and
 * the estimate says so. */
static void a_late_marker_is_screened(void **state) {
    (void)state;
    rig r;
    int32_t far = 0, ready = 0, n = 0;
    double most = 0;
    rig_open(&r, BY_EXCITATION);
    for (int32_t k = 0; k < FRAMES; k++) {
        const mhe_frame frame = {.size = sizeof frame,
                                 .time = r.recording->time[k],
                                 .emg = r.recording->emg + (ptrdiff_t)k * N_M};
        mhe_estimate e = {.size = sizeof e};
        for (int32_t late_k = k - 2; k >= 2 && late_k < k - 1; late_k++) {
            double *markers = r.recording->markers + (ptrdiff_t)late_k * 3 * N_K;
            markers[4] += late_k == 120 ? 0.5 : 0;
            assert_int_equal(mhe_estimator_measure(r.f.estimator, r.markers,
                                                   r.recording->time[late_k], markers, &r.f.err),
                             MHE_OK);
        }
        assert_int_equal(mhe_estimator_push(r.f.estimator, &frame, &e, &ready, &r.f.err), MHE_OK);
        if (!ready) {
            continue;
        }
        const int32_t at = (int32_t)lround((e.time - r.recording->time[0]) * 100);
        const mhe_tracked *t = mhe_tracked_at(&e, r.markers);
        n++;
        for (int32_t i = 0; i < 3 * N_K; i++) {
            const int32_t wrong = at == 120 && i / 3 == 1;
            far += t->why[i] == MHE_TRACK_FAR;
            assert_int_equal(t->why[i], wrong ? MHE_TRACK_FAR : MHE_TRACK_USED);
            assert_true(t->weight[i] == (wrong ? 0 : 1));
            assert_true(wrong ? isnan(t->target[i]) : t->target[i] == t->measured[i]);
        }
        for (int32_t i = 0; i < N_Q; i++) {
            const double error = e.q[i] - r.recording->reference.q[at * N_Q + i];
            most = fmax(most, n > 20 ? fabs(error) : 0);
        }
    }
    print_message("markers 15 ms late: %d estimates, joint angles at most %.4f rad off\n", n, most);
    assert_int_equal(far, 3);
    assert_true(n > FRAMES - 2 * N);
    assert_true(most < 0.02);
    rig_close(&r);
}

/* What a frame brought is not changed by what comes later. */
static void a_frame_has_the_last_word(void **state) {
    (void)state;
    rig r;
    double other[N_M];
    rig_open(&r, BY_EXCITATION);
    for (int32_t i = 0; i < N_M; i++) {
        other[i] = 0.9;
    }
    for (int32_t k = 0; k < 3 * N; k++) {
        const mhe_frame frame = mhi_recording_frame(r.recording, N_K, N_M, k);
        mhe_estimate e = {.size = sizeof e};
        int32_t ready = 0;
        assert_int_equal(mhe_estimator_push(r.f.estimator, &frame, &e, &ready, &r.f.err), MHE_OK);
        assert_int_equal(mhe_estimator_measure(r.f.estimator, r.emg, frame.time, other, &r.f.err),
                         MHE_OK);
        for (int32_t i = 0; ready && i < N_M; i++) {
            assert_true(mhe_tracked_at(&e, r.emg)->measured[i] != 0.9);
        }
    }
    rig_close(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(no_frame_loses_its_emg),
                                       cmocka_unit_test(early_emg_waits),
                                       cmocka_unit_test(delay_and_ratio_hold_for_samples),
                                       cmocka_unit_test(order_does_not_matter),
                                       cmocka_unit_test(lost_packets_are_a_gap),
                                       cmocka_unit_test(what_is_too_late_is_counted),
                                       cmocka_unit_test(a_late_marker_is_screened),
                                       cmocka_unit_test(a_frame_has_the_last_word)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
