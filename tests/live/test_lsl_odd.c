/* SPDX-License-Identifier: Apache-2.0 */
/* One live run against liblsl itself whose senders do what senders should not: markers as 16-bit
 * integers among channels of nobody, EMG of two electrodes of eight, then NaN in all markers, then
 * words under the markers' name. Estimates go on; each thing is told in a line. */
#include "live_rig.h"
#include "lsl_rig.h"

#include <math.h>
#include <mhe/table.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#define RECORDING MHE_TEST_SOURCE_DIR "/models/arm19/demo_recording.c3d"
#define EXTRA 40 /* channels of nobody */

enum { NOTHING, INTEGERS, NUMBERS, NO_NUMBERS, WORDS, END };

static lsl_rig rig;
static mhe_table_info markers = {.size = sizeof markers}, emg = {.size = sizeof emg};

static live_rig run;

/* ---- the sender: a thread that sends as it is told, 100 times a second ---- */

#define AHEAD 50 /* frames that the run may be behind; then it is waited for */

static atomic_int wanted, sent; /* what; how many frames by the sender that is there now */

/* Whether the run is too far behind. What left before it listened was never taken. */
static int is_ahead(double before, double *unheard) {
    const double taken = live_rig_state(&run, "frames") - before, left = atomic_load(&sent) - taken;
    *unheard = taken <= 0 || left < *unheard ? left : *unheard;
    return left - *unheard > AHEAD;
}

static lsl_outlet open_markers(int how) {
    lsl_channel channels[512] = {{0}};
    char names[EXTRA][24];
    const int32_t n = markers.n_columns + (how == INTEGERS ? EXTRA : 0);
    static const lsl_channel word[] = {{"event", "", ""}};
    if (how == WORDS) {
        return lsl_rig_send(&rig, "odd-markers", "MoCap", lsl_string, 0, word, 1);
    }
    for (int32_t i = 0; i < n; i++) {
        const int32_t own = i < markers.n_columns;
        if (!own) {
            (void)snprintf(names[i - markers.n_columns], sizeof *names, "Nobody%d",
                           (int)(i - markers.n_columns));
        }
        channels[i] =
            (lsl_channel){own ? markers.labels[i / 3] : names[i - markers.n_columns], "mm", ""};
    }
    return lsl_rig_send(&rig, "odd-markers", "MoCap", how == INTEGERS ? lsl_int16 : lsl_double64,
                        100, channels, n);
}

static void send_markers(lsl_outlet outlet, int how, int64_t k, double stamp) {
    static const char *const said[] = {"go"};
    const double *row = markers.values + (k % markers.n_rows) * markers.n_columns;
    double numbers[512];
    int16_t integers[512] = {0};
    for (int32_t i = 0; i < markers.n_columns; i++) {
        numbers[i] = how == NO_NUMBERS ? NAN : 1000 * row[i];
        integers[i] = (int16_t)lround(1000 * row[i]);
    }
    if (how == WORDS) {
        (void)rig.push_text(outlet, (const char **)(uintptr_t)said, stamp, 1);
    } else if (how == INTEGERS) {
        (void)rig.push_int16(outlet, integers, stamp, 1);
    } else {
        (void)rig.lsl.push_sample_dtp(outlet, numbers, stamp, 1);
    }
}

static void *send(void *data) {
    (void)data;
    static const lsl_channel two[] = {{"Biceps", "V", "EMG"}, {"Triceps", "V", "EMG"}};
    lsl_outlet volts = lsl_rig_send(&rig, "odd-emg", "EMG", lsl_double64, 2000, two, 2),
               outlet = NULL;
    const double start = lsl_rig_now(), clock = rig.lsl.local_clock() - start;
    int how = NOTHING;
    double before = 0, unheard = 0; /* frames when the sender that is there now began, and its */
    for (int64_t k = 0; atomic_load(&wanted) != END; k++) {
        const int next = atomic_load(&wanted);
        /* numbers and no numbers are one sender's */
        if (next != how && !(how == NUMBERS && next == NO_NUMBERS) &&
            !(how == NO_NUMBERS && next == NUMBERS)) {
            if (outlet != NULL) {
                rig.lsl.destroy_outlet(outlet);
            }
            atomic_store(&sent, 0);
            before = live_rig_state(&run, "frames");
            outlet = next == NOTHING ? NULL : open_markers(next);
        }
        how = next;
        const double at = 0.01 * (double)k;
        if (lsl_rig_now() < start + at) {
            lsl_rig_rest(start + at - lsl_rig_now());
        }
        for (int64_t i = 20 * k; i < 20 * (k + 1); i++) {
            const double *row = emg.values + (i % emg.n_rows) * emg.n_columns;
            (void)rig.lsl.push_sample_dtp(volts, row, start + clock + 0.0005 * (double)i,
                                          i == 20 * k + 19);
        }
        if (outlet != NULL) {
            send_markers(outlet, how, k, start + clock + at);
            atomic_fetch_add(&sent, 1);
            while (is_ahead(before, &unheard) && atomic_load(&wanted) == how) {
                lsl_rig_rest(0.02);
            }
        }
    }
    if (outlet != NULL) {
        rig.lsl.destroy_outlet(outlet);
    }
    rig.lsl.destroy_outlet(volts);
    return NULL;
}

/* ---- the run ---- */

static const char config[] = LIVE_RIG_ARM LIVE_RIG_EMG
    "    - {name: DeltMed, muscles: [Deltoid2], mvc: 0.00043}\n"
    "    - {name: Triceps, muscles: [TricepsLong, TricepsLat, TricepsMed], mvc: 0.0011}\n"
    "    - {name: Biceps, muscles: [BicepsLong, BicepsShort], mvc: 0.00129}\n"
    "    - {name: Brach, muscles: [BRA], mvc: 0.0006}\n"
    "horizon: {window: 7, ratio: 1}\n"
    "costs:\n"
    "  - plugin: mhe.cost.emg-markers-high\n"
    "    tracked: [Deltoid2, TricepsLong, TricepsLat, TricepsMed, BicepsLong, BicepsShort, BRA]\n"
    "sinks: [{plugin: mhe.sink.files, digits: 17, signals: [q, markers, markers_measured]}]\n"
    "sources: [{plugin: mhe.source.lsl, markers: [\"name='odd-markers'\"], emg: "
    "[\"name='odd-emg'\"]}]\n";

static const char *missed;

/* Until `more` frames were taken, and those that may be under way. */
static void step(int how, const char *said, int32_t times, int32_t more, const char *what) {
    if (missed == NULL) {
        atomic_store(&wanted, how);
        if ((said != NULL && !live_words_wait(&run.words, said, times)) ||
            !live_rig_wait_frames(&run, more > 0 ? AHEAD + more : 0)) {
            missed = what;
        }
    }
}

static void *direct(void *data) {
    (void)data;
    pthread_t sender;
    atomic_store(&wanted, INTEGERS);
    if (pthread_create(&sender, NULL, send, NULL) != 0) {
        missed = "a thread";
        mhe_live_stop(run.live);
        return NULL;
    }
    step(INTEGERS, "frames come from", 1, 150, "markers as integers");
    step(NOTHING, "'odd-markers' sends nothing any more", 1, 0, "a loss");
    step(WORDS, "holds text", 1, 0, "words");
    step(NOTHING, NULL, 0, 0, "a loss");
    step(NUMBERS, "'odd-markers' is back with other channels", 1, 60, "markers as numbers");
    step(NO_NUMBERS, NULL, 0, 100, "no numbers");
    step(NUMBERS, NULL, 0, 60, "numbers again");
    mhe_live_stop(run.live);
    atomic_store(&wanted, END);
    (void)pthread_join(sender, NULL);
    return NULL;
}

/* All estimates are numbers; with the integers they are where the markers are, to millimetres; for
 * a while there were no markers. */
static void check_tables(void) {
    int32_t n_rows, n_q, n_measured, n_markers, n_without = 0;
    double *q = live_rig_table("odd", "live_q.sto", &n_rows, &n_q);
    double *estimated = live_rig_table("odd", "live_markers.sto", &n_measured, &n_markers);
    double *measured = live_rig_table("odd", "live_markers_measured.sto", &n_measured, &n_markers);
    assert_true(q != NULL && estimated != NULL && measured != NULL && n_rows > 200);
    double off = 0;
    for (int32_t k = 0; k < n_rows; k++) {
        const double *at = measured + k * n_markers;
        for (int32_t i = 0; i < n_q; i++) {
            assert_true(isfinite(q[k * n_q + i]));
        }
        n_without += isnan(at[0]) != 0;
        for (int32_t i = 0; i < n_markers && k > 20 && k < 140; i++) {
            off += fabs(estimated[k * n_markers + i] - at[i]) / (119.0 * n_markers);
        }
    }
    assert_true(off < 0.005);
    assert_true(n_without >= 40);
    free(q);
    free(estimated);
    free(measured);
}

static void odd_senders(void **unused) {
    (void)unused;
    run = (live_rig){.name = "odd", .config = config, .director = direct};
    const mhe_status status = live_rig_run(&run);
    if (status != MHE_OK || missed != NULL) {
        fail_msg("%s %s:\n%s\n%s", run.err.text, missed == NULL ? "" : missed, run.words.text,
                 run.summary == NULL ? "" : run.summary);
    }
    assert_int_equal(live_words_count(&run.words, "holds text"), 1);
    /* the electrodes that do not come are told by name */
    assert_true(live_words_count(&run.words, "DeltMed") >= 1);
    assert_true(live_words_count(&run.words, "Brach") >= 1);
    check_tables();
    mhe_free(run.summary);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(odd_senders)};
    mhe_table *m = NULL, *e = NULL;
    if (!lsl_rig_open(live_rig_folder(), &rig)) {
        (void)puts("skipped: there is no liblsl (vendor/take fetches it)");
        return TEST_SKIPPED;
    }
    if (mhe_table_read_markers(RECORDING, &m, NULL) != MHE_OK ||
        mhe_table_read_signals(RECORDING, &e, NULL) != MHE_OK ||
        mhe_table_describe(m, &markers, NULL) != MHE_OK ||
        mhe_table_describe(e, &emg, NULL) != MHE_OK || markers.n_columns + EXTRA > 512) {
        return 1;
    }
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    mhe_table_close(m);
    mhe_table_close(e);
    return failed;
}
