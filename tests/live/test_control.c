/* SPDX-License-Identifier: Apache-2.0 */
/* What is asked for while a run runs acts at once and from one frame on: a maximal contraction, and
 * other names for labels. A recording repeats it to the bit. */
#include "live_rig.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ARM MHE_TEST_SOURCE_DIR "/models/arm19"
#define CONFIG                                                                             \
    LIVE_RIG_ARM                                                                           \
    LIVE_RIG_EMG                                                                           \
    "    - {name: Triceps, muscles: [TricepsLong, TricepsLat, TricepsMed], mvc: 0.0011}\n" \
    "    - {name: Biceps, muscles: [BicepsLong], mvc: %.17g}\n"                            \
    "horizon: {window: 7, ratio: 1}\n"                                                     \
    "costs:\n"                                                                             \
    "  - plugin: mhe.cost.emg-markers-high\n"                                              \
    "    tracked: [TricepsLong, TricepsLat, TricepsMed, BicepsLong]\n"                     \
    "data: {labels: {%s}}\n"                                                               \
    "sinks: [{plugin: mhe.sink.files, digits: 17, signals: [q, force, emg, "               \
    "markers_measured]}]\n"                                                                \
    "sources: [{plugin: mhe.source.recording, %s}]\n"

#define DEVICES "markers: " ARM "/demo_recording.c3d, emg: " ARM "/demo_recording.c3d, loop: true"
#define MVC 0.00129

static live_rig rig;
static int32_t reached;

static void run(const char *name, double mvc, const char *labels, const char *source,
                const char *record, void *(*director)(void *)) {
    char text[4096];
    (void)snprintf(text, sizeof text, CONFIG, mvc, labels, source);
    rig = (live_rig){.name = name, .config = text, .record = record, .director = director};
    reached = director == NULL;
    live_rig_must_run(&rig);
    if (!reached) {
        fail_msg("the director came to no end:\n%s\n%s", rig.words.text, rig.summary);
    }
    mhe_free(rig.summary);
}

static void repeat(const char *name, double mvc, const char *labels, const char *record) {
    char source[256];
    (void)snprintf(source, sizeof source, "file: %s, speed: 0", record);
    run(name, mvc, labels, source, NULL, NULL);
}

static int say(const char *line) {
    return mhe_live_command(rig.live, line, NULL) == MHE_OK;
}

static void must_be_same(const char *a, const char *b) {
    static const char *const files[] = {"live_q.sto", "live_force.sto", "live_emg.sto",
                                        "live_markers_measured.sto"};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        assert_true(live_rig_same(a, b, files[i]));
    }
}

/* Of two tables: the row from which on entry `i` is the same, where it differs in all rows before;
 * -1: it is not so. Rows without a number there (a recording that begins again leaves a gap) say
 * nothing. */
static int32_t same_from(const double *a, const double *b, int32_t n_rows, int32_t n, int32_t i,
                         double tolerance) {
    int32_t from = 0, n_same = 0;
    for (int32_t k = 0; k < n_rows; k++) {
        const double x = a[k * n + i], y = b[k * n + i];
        const int none = isnan(x) && isnan(y), same = fabs(x - y) <= tolerance * fabs(x);
        n_same += same;
        if (!none && !same) {
            from = k + 1;
            if (n_same > 0) {
                return -1;
            }
        }
    }
    return n_same > 0 ? from : -1;
}

/* ---- a maximal contraction ---- */

static int contract(void) {
    return live_rig_wait_frames(&rig, 60) && say("mvc-start Biceps") &&
           live_rig_wait_frames(&rig, 60) && say("mvc-stop") &&
           live_words_wait(&rig.words, "electrode 'Biceps': its EMG is relative to", 1) &&
           live_rig_wait_frames(&rig, 60);
}

static void *contract_and_stop(void *data) {
    (void)data;
    reached = contract();
    mhe_live_stop(rig.live);
    return NULL;
}

/* What mvc.yaml says of the biceps. */
static double found_maximum(const char *name) {
    char path[160], text[512];
    (void)snprintf(path, sizeof path, "%s/%s/mvc.yaml", live_rig_folder(), name);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    const size_t n = fread(text, 1, sizeof text - 1, file);
    (void)fclose(file);
    text[n] = '\0';
    const char *at = strstr(text, "\"Biceps\", mvc: ");
    assert_non_null(at);
    return strtod(at + strlen("\"Biceps\", mvc: "), NULL);
}

/* The EMG is relative to the maximum from one frame on, and to the config's before it. */
static void a_maximum_acts_at_once(void **state) {
    (void)state;
    char record[160];
    int32_t n_rows, n_again, n_columns;
    (void)snprintf(record, sizeof record, "%s/mvc.xdf", live_rig_folder());
    run("mvc", MVC, "", DEVICES, record, contract_and_stop);
    repeat("mvc-again", MVC, "", record);
    assert_int_equal(live_words_count(&rig.words, "electrode 'Biceps': its EMG is relative to"), 1);
    must_be_same("mvc", "mvc-again");

    const double found = found_maximum("mvc");
    assert_true(found > 0 && fabs(found / MVC - 1) > 0.01);
    repeat("mvc-before", found, "", record);
    double *emg = live_rig_table("mvc", "live_emg.sto", &n_rows, &n_columns);
    double *before = live_rig_table("mvc-before", "live_emg.sto", &n_again, &n_columns);
    assert_true(emg != NULL && before != NULL && n_rows == n_again);
    int32_t biceps = -1; /* the columns are muscles; those without an electrode are NaN */
    for (int32_t i = 0, n = 0; i < n_columns; i++) {
        if (!isnan(emg[i])) {
            biceps = fabs(emg[i] / before[i] * MVC / found - 1) < 1e-4 ? i : biceps;
            n++;
        }
        assert_true(n <= 4);
    }
    assert_true(biceps >= 0);
    const int32_t from = same_from(emg, before, n_rows, n_columns, biceps, 1e-4);
    assert_in_range(from, 80, n_rows - 30);
    free(emg);
    free(before);
}

static void *contract_and_record(void *data) {
    (void)data;
    reached = contract() && say("record-start") && live_words_wait(&rig.words, "recording: ", 1) &&
              live_rig_wait_frames(&rig, 30) && say("record-stop") &&
              live_words_wait(&rig.words, "recorded: ", 1);
    mhe_live_stop(rig.live);
    return NULL;
}

static void a_recording_begun_later_has_it(void **state) {
    (void)state;
    run("later", MVC, "", DEVICES, NULL, contract_and_record);
    char path[256] = "";
    const char *at = strstr(rig.words.text, "recorded: ");
    assert_non_null(at);
    assert_int_equal(sscanf(at, "recorded: %255s", path), 1);
    repeat("later-again", MVC, "", path);
    assert_int_equal(live_words_count(&rig.words, "electrode 'Biceps': its EMG is relative to"), 1);
}

/* ---- other names ---- */

#define EXCHANGED "STYLr: STYLu, STYLu: STYLr"

static void *name_and_stop(void *data) {
    (void)data;
    reached = live_rig_wait_frames(&rig, 60) && say("label STYLr=STYLr") &&
              live_rig_wait_frames(&rig, 60);
    mhe_live_stop(rig.live);
    return NULL;
}

/* A config exchanges two markers; a name that is given while it runs is what counts from then on,
 * and the marker that had it gets the other's. */
static void a_given_name_has_the_last_word(void **state) {
    (void)state;
    char record[160];
    int32_t n_rows, n_again, n_columns;
    (void)snprintf(record, sizeof record, "%s/names.xdf", live_rig_folder());
    run("names", MVC, EXCHANGED, DEVICES, record, name_and_stop);
    repeat("names-again", MVC, EXCHANGED, record);
    must_be_same("names", "names-again");
    repeat("names-plain", MVC, "", record);
    double *at = live_rig_table("names", "live_markers_measured.sto", &n_rows, &n_columns);
    double *plain =
        live_rig_table("names-plain", "live_markers_measured.sto", &n_again, &n_columns);
    assert_true(at != NULL && plain != NULL && n_rows == n_again);
    int32_t n_exchanged = 0;
    for (int32_t i = 0; i < n_columns; i++) {
        const int32_t from = same_from(at, plain, n_rows, n_columns, i, 0);
        assert_true(from >= 0 && from < n_rows - 30);
        n_exchanged += from > 30;
    }
    assert_int_equal(n_exchanged, 6); /* x, y, z of two */
    free(at);
    free(plain);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_maximum_acts_at_once),
                                       cmocka_unit_test(a_recording_begun_later_has_it),
                                       cmocka_unit_test(a_given_name_has_the_last_word)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
