/* SPDX-License-Identifier: Apache-2.0 */
/* Recorded on a bad network, with deadlines that cut solves short, and repeated as fast as it goes:
 * the same bits, and the recording of the repetition holds the same work. */
#include "live_rig.h"

#include <stdio.h>
#include <string.h>

#define ARM MHE_TEST_SOURCE_DIR "/models/arm19"
#define CONFIG                                                                           \
    "plugin_path: " TEST_PLUGINS "\n"                                                    \
    "model: {file: " ARM "/arm19.osim}\n"                                                \
    "muscle: {curves: paper2021}\n"                                                      \
    "initial: {q: [-0.1, -0.3, -0.1, 0.1], qdot: [0, 0, 0, 0]}\n"                        \
    "horizon: {window: 7, ratio: 1}\n"                                                   \
    "costs: [mhe.cost.emg-markers-high]\n"                                               \
    "solver: {plugin: mhe.solver.rti, preset: speed}\n"                                  \
    "realtime: {deadline_ms: %g, threads: %d, most_behind: 0}\n"                         \
    "sinks: [{plugin: mhe.sink.files, digits: 17, signals: [q, activation, force, emg, " \
    "markers_measured]}]\n"                                                              \
    "sources: [%s]\n"

static live_rig rig;

/* Runs to the end of the source; results in a folder NAME, recorded to NAME.xdf. Gives the summary.
 */
static char *run(const char *name, const char *source, double deadline, int32_t threads) {
    char text[4096], record[160];
    (void)snprintf(text, sizeof text, CONFIG, deadline, (int)threads, source);
    (void)snprintf(record, sizeof record, "%s/%s.xdf", live_rig_folder(), name);
    rig = (live_rig){.name = name, .config = text, .record = record, .trust = 1};
    live_rig_must_run(&rig);
    return rig.summary;
}

static void same_files(const char *a, const char *b) {
    static const char *const files[] = {"live_q.sto", "live_activation.sto", "live_force.sto",
                                        "live_emg.sto", "live_markers_measured.sto"};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        assert_true(live_rig_same(a, b, files[i]));
    }
}

/* What a run on a bad network and its repetition have in common; returns how many estimates were
 * cut short, predicted or begun again. */
static double rough_and_repeated(int32_t seed, double deadline, int32_t threads) {
    char name[32], again[32], source[512];
    (void)snprintf(name, sizeof name, "rough-%d", (int)seed);
    (void)snprintf(again, sizeof again, "again-%d", (int)seed);
    (void)snprintf(source, sizeof source,
                   "{plugin: test.source.rough, markers: %s/demo_markers.trc, emg: "
                   "%s/demo_emg.sto, seed: %d, speed: 3, delay: 0.003}",
                   ARM, ARM, (int)seed);
    char *summary = run(name, source, deadline, threads);
    const double cut = live_rig_number(summary, "deadline") +
                       live_rig_number(summary, "predicted") +
                       live_rig_number(summary, "begun_again");
    const double estimates = live_rig_number(summary, "estimates");
    assert_true(live_rig_number(summary, "frames") >=
                200); /* of 301, less what is lost or overtaken */
    assert_true(estimates >= 100);
    assert_true(live_rig_number(summary, "samples") > 0);
    assert_int_equal(live_words_count(&rig.words, "the EMG has its channels turned"), 1);
    mhe_free(summary);
    (void)snprintf(source, sizeof source,
                   "{plugin: mhe.source.recording, file: %s/%s.xdf, speed: 0}", live_rig_folder(),
                   name);
    summary = run(again, source, deadline, threads);
    assert_true(live_rig_number(summary, "estimates") == estimates);
    assert_true(live_rig_number(summary, "deadline") + live_rig_number(summary, "predicted") +
                    live_rig_number(summary, "begun_again") ==
                cut);
    mhe_free(summary);
    same_files(name, again);
    return cut;
}

static void without_a_deadline(void **state) {
    (void)state;
    (void)rough_and_repeated(1, 0, 1);
    assert_int_equal(live_words_count(&rig.words, "a stream is another from here on"), 1);
}

static void with_a_deadline_that_cuts_some(void **state) {
    (void)state;
    (void)rough_and_repeated(2, 0.3, 1);
}

static void with_a_deadline_that_cuts_all_on_two_threads(void **state) {
    (void)state;
    assert_true(rough_and_repeated(3, 0.03, 2) > 50);
}

/* A machine that does not keep up passes frames over, so that estimates stay of now, and says so
 * once; the repetition passes the same ones over. */
static void behind_and_repeated(void **state) {
    (void)state;
    static const char slow[] = "/slow-record";
    char text[4096], record[160];
    for (int32_t again = 0; again < 2; again++) {
        char source[512];
        if (again) {
            (void)snprintf(source, sizeof source,
                           "{plugin: mhe.source.recording, file: %s%s.xdf, speed: 0}",
                           live_rig_folder(), slow);
        } else {
            (void)snprintf(source, sizeof source,
                           "{plugin: mhe.source.recording, markers: %s/demo_markers.trc, emg: "
                           "%s/demo_emg.sto, speed: 20}",
                           ARM, ARM);
        }
        (void)snprintf(text, sizeof text, CONFIG, 0.0, 1, source);
        char *most = strstr(text, "most_behind: 0}");
        assert_non_null(most); /* 0.01 s, and steps so small that no machine keeps up */
        (void)snprintf(
            most, sizeof text - (size_t)(most - text),
            "most_behind: 0.01}\n"
            "integrator: {plugin: mhe.integrator.rk, max_step: 0.0003}\n"
            "sinks: [{plugin: mhe.sink.files, digits: 17, signals: [q, activation, force, "
            "emg, markers_measured]}]\nsources: [%s]\n",
            source);
        (void)snprintf(record, sizeof record, "%s%s.xdf", live_rig_folder(), slow);
        rig = (live_rig){.name = again ? "slow-again" : "slow",
                         .config = text,
                         .record = again ? NULL : record,
                         .trust = 1};
        live_rig_must_run(&rig);
        assert_int_equal((int)live_rig_number(rig.summary, "frames"), 301);
        assert_true(live_rig_number(rig.summary, "passed_over") > 50);
        assert_int_equal(live_words_count(&rig.words, "does not keep up"), 1);
        mhe_free(rig.summary);
    }
    same_files("slow", "slow-again");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_a_deadline),
        cmocka_unit_test(with_a_deadline_that_cuts_some),
        cmocka_unit_test(with_a_deadline_that_cuts_all_on_two_threads),
        cmocka_unit_test(behind_and_repeated),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
