/* SPDX-License-Identifier: Apache-2.0 */
/* A live run, whole: files as devices, results as files. Recorded and repeated it gives the same
 * bits; EMG that comes late in packets reaches every node; what goes wrong with streams is told in
 * a line and ends nothing. */
#include "live_rig.h"

#include <mhe/table.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LIVE_CONFIG                                                                               \
    LIVE_RIG_ARM                                                                                  \
    "initial: {q: [-0.1, -0.3, -0.1, 0.1], qdot: [0, 0, 0, 0]}\n"                                 \
    "horizon: {window: 7, ratio: 1}\n"                                                            \
    "costs: [mhe.cost.emg-markers-high]\n"                                                        \
    "sinks: [{plugin: mhe.sink.files, digits: 17, signals: [q, force, markers_measured, emg]}]\n" \
    "sources: [%s]\n"

static live_rig rig;

/* Runs to the end of the sources; results in a folder NAME. */
static mhe_status run(const char *name, const char *sources, const char *record) {
    char text[4096], filled[2048];
    (void)snprintf(filled, sizeof filled, sources, MHE_TEST_SOURCE_DIR, MHE_TEST_SOURCE_DIR);
    (void)snprintf(text, sizeof text, LIVE_CONFIG, filled);
    rig = (live_rig){.name = name, .config = text, .record = record};
    return live_rig_run(&rig);
}

static void must_run(const char *name, const char *sources, const char *record) {
    if (run(name, sources, record) != MHE_OK) {
        fail_msg("%s", rig.err.text);
    }
}

static int summary_says(const char *key) {
    return (int)live_rig_number(rig.summary, key);
}

#define DEMO                                                                          \
    "{plugin: mhe.source.recording, markers: %s/models/arm19/demo_markers.trc, emg: " \
    "%s/models/arm19/demo_emg.sto, speed: 0}"

static void repeat(const char *name, const char *record) {
    char source[256];
    (void)snprintf(source, sizeof source, "{plugin: mhe.source.recording, file: %s, speed: 0}",
                   record);
    must_run(name, source, NULL);
    mhe_free(rig.summary);
}

static void recorded_and_repeated(void **state) {
    (void)state;
    char record[128];
    (void)snprintf(record, sizeof record, "%s/a.xdf", live_rig_folder());
    must_run("first", DEMO, record);
    assert_int_equal(summary_says("frames"), 301);
    assert_int_equal(summary_says("estimates"), 294);
    assert_true(summary_says("converged") >= 290);
    assert_int_equal(summary_says("nodes_without"), 0);
    mhe_free(rig.summary);
    repeat("second", record);
    assert_true(live_rig_same("first", "second", "live_force.sto"));
    assert_true(live_rig_same("first", "second", "live_q.sto"));
    assert_true(live_rig_same("first", "second", "live_markers_measured.sto"));
    assert_false(live_rig_same("first", "second", "no_such_file"));
}

static void twice_as_fast_by_the_clock(void **state) {
    (void)state;
    char record[128];
    static const char fast[] =
        "{plugin: mhe.source.recording, markers: %s/models/arm19/demo_markers.trc, emg: "
        "%s/models/arm19/demo_emg.sto, speed: 2, }";
    (void)snprintf(record, sizeof record, "%s/b.xdf", live_rig_folder());
    must_run("third", fast, record);
    assert_int_equal(summary_says("frames"), 301);
    mhe_free(rig.summary);
    repeat("fourth", record);
    assert_true(live_rig_same("third", "fourth", "live_force.sto"));
    assert_true(live_rig_same("third", "fourth", "live_emg.sto"));
}

/* A recording that begins again goes on a period after its last sample: its times stay a line. */
static void begun_again(void **state) {
    (void)state;
    char path[256], text[4096];
    mhe_table *table = NULL;
    mhe_table_info info = {.size = sizeof info};
    mhe_error err = {0};
    (void)snprintf(text, sizeof text, LIVE_CONFIG,
                   "{plugin: mhe.source.recording, markers: " MHE_TEST_SOURCE_DIR
                   "/models/arm19/demo_markers.trc, speed: 30, loop: true}");
    rig = (live_rig){.name = "loop", .config = text, .seconds = 7};
    live_rig_must_run(&rig);
    mhe_free(rig.summary);
    (void)snprintf(path, sizeof path, "%s/loop/live_q.sto", live_rig_folder());
    if (mhe_table_read_signals(path, &table, &err) != MHE_OK ||
        mhe_table_describe(table, &info, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_true(info.n_rows > 602); /* three times around */
    for (int32_t k = 1; k < info.n_rows; k++) {
        const double step = info.time[k] - info.time[k - 1];
        if (!(step > 0.01 - 1e-6 && step < 0.01 + 1e-6)) {
            fail_msg("%.9g s between rows %d and %d", step, (int)k - 1, (int)k);
        }
    }
    mhe_table_close(table);
}

/* data.transform holds for streams as for files: five metres off, nothing fits the model. */
static void markers_are_turned_into_the_models_frame(void **state) {
    (void)state;
    must_run("shifted", DEMO "]\ndata:\n  transform:\n    shift: [5, 0, 0", NULL);
    assert_int_equal(summary_says("frames"), 301);
    assert_int_equal(summary_says("estimates"), 0);
    mhe_free(rig.summary);
}

/* data.subject holds for streams as for files: of two persons with the same markers. */
static mhe_status of_subject(const char *name, const char *subject) {
    char command[800], source[600];
    (void)snprintf(
        command, sizeof command,
        "sed '4{s/DELT/Anna:DELT/;s/ARMl/Bob:ARMl/;s/EPICl/Anna:EPICl/;s/EPICm/Anna:EPICm/"
        ";s/LARMl/Anna:LARMl/;s/LARM_elb/Anna:LARM_elb/;s/STYLr/Anna:STYLr/"
        ";s/STYLu/Anna:STYLu/}' %s/models/arm19/demo_markers.trc > %s/two.trc",
        MHE_TEST_SOURCE_DIR, live_rig_folder());
    assert_int_equal(system(command), 0);
    (void)snprintf(
        source, sizeof source,
        "{plugin: mhe.source.recording, markers: %s/two.trc, emg: %s/models/arm19/"
        "demo_emg.sto, speed: 0}]\ndata:\n  subject: %s\n  transform:\n    shift: [0, 0, 0",
        live_rig_folder(), MHE_TEST_SOURCE_DIR, subject);
    return run(name, source, NULL);
}

static void whose_markers(void **state) {
    (void)state;
    if (of_subject("anna", "Anna") != MHE_OK) {
        fail_msg("%s", rig.err.text);
    }
    assert_int_equal(summary_says("found"), 7);
    assert_non_null(strstr(rig.summary, "\"ARMl\"")); /* Bob's is nobody's of hers */
    assert_non_null(strstr(rig.summary, "\"Bob:ARMl\""));
    assert_true(summary_says("estimates") > 290);
    mhe_free(rig.summary);
    assert_int_equal(of_subject("carl", "Carl"), MHE_E_CONFIG);
    if (strstr(rig.err.text, "has no subject 'Carl' (it has Anna, Bob)") == NULL) {
        fail_msg("%s", rig.err.text);
    }
}

static void refused(const char *sources, const char *said) {
    assert_true(run("refused", sources, NULL) < 0);
    if (strstr(rig.err.text, said) == NULL) {
        fail_msg("'%s' does not say '%s'", rig.err.text, said);
    }
}

static void what_cannot_run(void **state) {
    (void)state;
    refused("", "live.yaml:10: the section 'sources' is empty");
    refused("{plugin: mhe.source.recording}", "live.yaml:10: mhe.source.recording: no file");
    refused("{plugin: mhe.source.recording, markers: /no/such.trc}", "/no/such.trc");
    refused("{plugin: mhe.source.recordin}", "mhe.source.recording");
    refused("{plugin: mhe.source.recording, speed: -1, markers: a.trc}", "speed");
    refused("{plugin: mhe.source.recording, emg: %s/models/arm19/demo_emg.sto, speed: 0}",
            "no stream has a marker or a joint angle of the model");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(recorded_and_repeated),
        cmocka_unit_test(twice_as_fast_by_the_clock),
        cmocka_unit_test(begun_again),
        cmocka_unit_test(markers_are_turned_into_the_models_frame),
        cmocka_unit_test(whose_markers),
        cmocka_unit_test(what_cannot_run),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
