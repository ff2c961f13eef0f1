/* SPDX-License-Identifier: Apache-2.0 */
/* Recorded on a bad network, with deadlines that cut solves short, and repeated as fast as it goes:
 * the same bits, and the recording of the repetition holds the same work. */
#include "support.h"

#include <mhe/library.h>
#include <mhe/live.h>
#include <stdio.h>
#include <stdlib.h>
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
    "realtime: {deadline_ms: %g, threads: %d}\n"                                         \
    "sinks: [{plugin: mhe.sink.files, digits: 17, signals: [q, activation, force, emg, " \
    "markers_measured]}]\n"                                                              \
    "sources: [%s]\n"

static char folder[64], log_text[65536];

static void keep(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level;
    if (strlen(log_text) + strlen(text) + 2 < sizeof log_text) {
        (void)strcat(strcat(log_text, text), "\n");
    }
}

static const void *none(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

/* Runs to the end of the source; results in folder/NAME, recorded to folder/NAME.xdf. Gives the
 * summary. */
static char *run(const char *name, const char *source, double deadline, int32_t threads) {
    char text[4096], out[128], record[160], command[200];
    char *summary = NULL;
    const mhe_host host = {.size = sizeof host, .log = keep, .service = none};
    mhe_config *config = NULL;
    mhe_live *live = NULL;
    mhe_error err = {0};
    (void)snprintf(text, sizeof text, CONFIG, deadline, (int)threads, source);
    (void)snprintf(out, sizeof out, "%s/%s", folder, name);
    (void)snprintf(record, sizeof record, "%s.xdf", out);
    (void)snprintf(command, sizeof command, "mkdir -p %s", out);
    assert_int_equal(system(command), 0);
    mhe_status status = mhe_config_parse("live.yaml", text, strlen(text), "/", NULL, 0,
                                         MHE_CONFIG_TRUST, &host, &config, &err);
    const mhe_live_setup setup = {.size = sizeof setup, .folder = out, .record = record};
    status = status == MHE_OK ? mhe_live_open(config, &setup, &live, &err) : status;
    status = status == MHE_OK ? mhe_live_run(live, 0, &err) : status;
    status = status == MHE_OK ? mhe_live_summary(live, &summary, &err) : status;
    mhe_live_close(live);
    mhe_config_close(config);
    if (status != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return summary;
}

static double number_of(const char *json, const char *key) {
    char quoted[64];
    (void)snprintf(quoted, sizeof quoted, "\"%s\":", key);
    const char *at = strstr(json, quoted);
    assert_non_null(at);
    return strtod(at + strlen(quoted), NULL);
}

static void same_files(const char *a, const char *b) {
    static const char *const files[] = {"live_q.sto", "live_activation.sto", "live_force.sto",
                                        "live_emg.sto", "live_markers_measured.sto"};
    for (size_t i = 0; i < sizeof files / sizeof *files; i++) {
        char command[400];
        (void)snprintf(command, sizeof command, "test -s %s/%s/%s && cmp %s/%s/%s %s/%s/%s", folder,
                       a, files[i], folder, a, files[i], folder, b, files[i]);
        assert_int_equal(system(command), 0);
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
    const double cut = number_of(summary, "deadline") + number_of(summary, "predicted") +
                       number_of(summary, "begun_again");
    const double estimates = number_of(summary, "estimates");
    assert_true(number_of(summary, "frames") >= 200); /* of 301, less what is lost or overtaken */
    assert_true(estimates >= 100);
    assert_true(number_of(summary, "samples") > 0);
    mhe_free(summary);
    (void)snprintf(source, sizeof source,
                   "{plugin: mhe.source.recording, file: %s/%s.xdf, speed: 0}", folder, name);
    summary = run(again, source, deadline, threads);
    assert_true(number_of(summary, "estimates") == estimates);
    assert_true(number_of(summary, "deadline") + number_of(summary, "predicted") +
                    number_of(summary, "begun_again") ==
                cut);
    mhe_free(summary);
    same_files(name, again);
    return cut;
}

static void without_a_deadline(void **state) {
    (void)state;
    (void)rough_and_repeated(1, 0, 1);
    assert_non_null(strstr(log_text, "the EMG has its channels turned"));
    assert_non_null(strstr(log_text, "a stream is another from here on"));
}

static void with_a_deadline_that_cuts_some(void **state) {
    (void)state;
    (void)rough_and_repeated(2, 0.3, 1);
}

static void with_a_deadline_that_cuts_all_on_two_threads(void **state) {
    (void)state;
    assert_true(rough_and_repeated(3, 0.03, 2) > 50);
}

static int clean(void **state) {
    (void)state;
    char command[100];
    (void)snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command);
}

static int begin(void **state) {
    (void)state;
    (void)strcpy(folder, "/tmp/mhe-repeat-XXXXXX");
    return mkdtemp(folder) == NULL;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_a_deadline),
        cmocka_unit_test(with_a_deadline_that_cuts_some),
        cmocka_unit_test(with_a_deadline_that_cuts_all_on_two_threads),
    };
    return cmocka_run_group_tests(tests, begin, clean);
}
