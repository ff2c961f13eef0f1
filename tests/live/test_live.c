/* SPDX-License-Identifier: Apache-2.0 */
/* A live run, whole: files as devices, results as files. Recorded and repeated it gives the same
 * bits; EMG that comes late in packets reaches every node; what goes wrong with streams is told in
 * a line and ends nothing. */
#include "support.h"

#include <math.h>
#include <mhe/library.h>
#include <mhe/live.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[64];

static void quiet(const mhe_host *host, int32_t level, const char *text) {
    (void)level;
    char *all = host->data;
    if (all != NULL && strlen(all) + strlen(text) + 2 < 8192) {
        (void)strcat(strcat(all, text), "\n");
    }
}

static const void *none(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

#define LIVE_CONFIG                                                                               \
    "model: {file: %s/models/arm19/arm19.osim}\n"                                                 \
    "muscle: {curves: paper2021}\n"                                                               \
    "initial: {q: [-0.1, -0.3, -0.1, 0.1], qdot: [0, 0, 0, 0]}\n"                                 \
    "horizon: {window: 7, ratio: 1}\n"                                                            \
    "integrator: {plugin: mhe.integrator.rk, tolerance: 0, stages: 2, max_step: 0.03}\n"          \
    "costs: [mhe.cost.emg-markers-high]\n"                                                        \
    "solver: {plugin: mhe.solver.rti, preset: speed}\n"                                           \
    "sinks: [{plugin: mhe.sink.files, digits: 17, signals: [q, force, markers_measured, emg]}]\n" \
    "sources: [%s]\n"

/* Runs to the end of the sources; results in folder/NAME. */
static mhe_status run(const char *name, const char *sources, const char *record, char **summary,
                      char *log, mhe_error *err) {
    char text[4096], out[128], filled[2048];
    const mhe_host host = {.size = sizeof host, .data = log, .log = quiet, .service = none};
    mhe_config *config = NULL;
    mhe_live *live = NULL;
    (void)snprintf(filled, sizeof filled, sources, MHE_TEST_SOURCE_DIR, MHE_TEST_SOURCE_DIR);
    (void)snprintf(text, sizeof text, LIVE_CONFIG, MHE_TEST_SOURCE_DIR, filled);
    (void)snprintf(out, sizeof out, "%s/%s", folder, name);
    char command[200];
    (void)snprintf(command, sizeof command, "mkdir -p %s", out);
    assert_int_equal(system(command), 0);
    mhe_status status =
        mhe_config_parse("live.yaml", text, strlen(text), "/", NULL, 0, 0, &host, &config, err);
    const mhe_live_setup setup = {.size = sizeof setup, .folder = out, .record = record, .wait = 5};
    status = status == MHE_OK ? mhe_live_open(config, &setup, &live, err) : status;
    status = status == MHE_OK ? mhe_live_run(live, 0, err) : status;
    if (status == MHE_OK && summary != NULL) {
        status = mhe_live_summary(live, summary, err);
    }
    mhe_live_close(live);
    mhe_config_close(config);
    return status;
}

static int same_files(const char *a, const char *b, const char *file) {
    char command[400];
    (void)snprintf(command, sizeof command, "cmp -s %s/%s/%s %s/%s/%s", folder, a, file, folder, b,
                   file);
    return system(command) == 0;
}

static double number_of(const char *json, const char *key) {
    char quoted[64];
    (void)snprintf(quoted, sizeof quoted, "\"%s\":", key);
    const char *at = strstr(json, quoted);
    assert_non_null(at);
    return strtod(at + strlen(quoted), NULL);
}

#define DEMO                                                                          \
    "{plugin: mhe.source.recording, markers: %s/models/arm19/demo_markers.trc, emg: " \
    "%s/models/arm19/demo_emg.sto, speed: 0}"

static void recorded_and_repeated(void **state) {
    (void)state;
    char record[128], again[256];
    char *summary = NULL;
    mhe_error err = {0};
    (void)snprintf(record, sizeof record, "%s/a.xdf", folder);
    mhe_status status = run("first", DEMO, record, &summary, NULL, &err);
    if (status != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal((int)number_of(summary, "frames"), 301);
    assert_int_equal((int)number_of(summary, "estimates"), 294);
    assert_true(number_of(summary, "converged") >= 290);
    assert_int_equal((int)number_of(summary, "nodes_without"), 0);
    mhe_free(summary);
    (void)snprintf(again, sizeof again, "{plugin: mhe.source.recording, file: %s, speed: 0}",
                   record);
    status = run("second", again, NULL, NULL, NULL, &err);
    if (status != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_true(same_files("first", "second", "live_force.sto"));
    assert_true(same_files("first", "second", "live_q.sto"));
    assert_true(same_files("first", "second", "live_markers_measured.sto"));
    assert_false(same_files("first", "second", "no_such_file"));
}

static void twice_as_fast_by_the_clock(void **state) {
    (void)state;
    char record[128], again[256];
    char *summary = NULL;
    mhe_error err = {0};
    static const char fast[] =
        "{plugin: mhe.source.recording, markers: %s/models/arm19/demo_markers.trc, emg: "
        "%s/models/arm19/demo_emg.sto, speed: 2, }";
    (void)snprintf(record, sizeof record, "%s/b.xdf", folder);
    assert_int_equal(run("third", fast, record, &summary, NULL, &err), MHE_OK);
    assert_int_equal((int)number_of(summary, "frames"), 301);
    mhe_free(summary);
    (void)snprintf(again, sizeof again, "{plugin: mhe.source.recording, file: %s, speed: 0}",
                   record);
    assert_int_equal(run("fourth", again, NULL, NULL, NULL, &err), MHE_OK);
    assert_true(same_files("third", "fourth", "live_force.sto"));
    assert_true(same_files("third", "fourth", "live_emg.sto"));
}

/* data.transform holds for streams as for files: five metres off, nothing fits the model. */
static void markers_are_turned_into_the_models_frame(void **state) {
    (void)state;
    char *summary = NULL;
    mhe_error err = {0};
    assert_int_equal(run("shifted", DEMO "]\ndata:\n  transform:\n    shift: [5, 0, 0", NULL,
                         &summary, NULL, &err),
                     MHE_OK);
    assert_int_equal((int)number_of(summary, "frames"), 301);
    assert_int_equal((int)number_of(summary, "estimates"), 0);
    mhe_free(summary);
}

static void refused(const char *sources, const char *said) {
    mhe_error err = {0};
    const mhe_status status = run("refused", sources, NULL, NULL, NULL, &err);
    assert_true(status < 0);
    if (strstr(err.text, said) == NULL) {
        fail_msg("'%s' does not say '%s'", err.text, said);
    }
}

static void what_cannot_run(void **state) {
    (void)state;
    refused("", "there is no section 'sources'");
    refused("{plugin: mhe.source.recording}", "live.yaml:9: mhe.source.recording: no file");
    refused("{plugin: mhe.source.recording, markers: /no/such.trc}", "/no/such.trc");
    refused("{plugin: mhe.source.recordin}", "mhe.source.recording");
    refused("{plugin: mhe.source.recording, speed: -1, markers: a.trc}", "speed");
    refused("{plugin: mhe.source.recording, emg: %s/models/arm19/demo_emg.sto, speed: 0}",
            "no stream has a marker or a joint angle of the model");
}

static int clean(void **state) {
    (void)state;
    char command[100];
    (void)snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command);
}

static int begin(void **state) {
    (void)state;
    (void)strcpy(folder, "/tmp/mhe-live-XXXXXX");
    return mkdtemp(folder) == NULL;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(recorded_and_repeated),
        cmocka_unit_test(twice_as_fast_by_the_clock),
        cmocka_unit_test(markers_are_turned_into_the_models_frame),
        cmocka_unit_test(what_cannot_run),
    };
    return cmocka_run_group_tests(tests, begin, clean);
}
