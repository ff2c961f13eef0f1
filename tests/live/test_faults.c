/* SPDX-License-Identifier: Apache-2.0 */
/* Whole runs in which something goes wrong with what comes: each is told in a line, nothing stalls,
 * estimates go on to the end, and a recording of it gives the same bits. (Senders that are killed,
 * come with other labels or at another rate: test_lsl_run; deaf clients and garbage on the page's
 * port: test_page.) */
#include "live_rig.h"
#include "qtm_server.h"

#include <arpa/inet.h>
#include <math.h>
#include <mhe/table.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define ARM MHE_TEST_SOURCE_DIR "/models/arm19"
#define CONFIG                                                               \
    "plugin_path: " TEST_PLUGINS "\n" LIVE_RIG_ARM                           \
    "initial: {q: [-0.1, -0.3, -0.1, 0.1], qdot: [0, 0, 0, 0]}\n"            \
    "horizon: {window: 7, ratio: 1}\n"                                       \
    "costs: [mhe.cost.emg-markers-high]\n"                                   \
    "data: {labels: {A: STYLr, B: LARMl}}\n"                                 \
    "sinks: [{plugin: mhe.sink.files, digits: 17, signals: [q, force, emg, " \
    "markers_measured]}%s]\n"                                                \
    "sources: [%s]\n"
#define ROUGH                                                                                    \
    "{plugin: test.source.rough, markers: " ARM "/demo_markers.trc, emg: " ARM "/demo_emg.sto, " \
    "speed: 3, fault: %s}"

static live_rig rig;

static mhe_status run(const char *name, const char *sources, const char *more_sinks,
                      const char *record, double seconds, void *(*director)(void *)) {
    static char text[8192];
    (void)snprintf(text, sizeof text, CONFIG, more_sinks, sources);
    rig = (live_rig){.name = name,
                     .config = text,
                     .record = record,
                     .seconds = seconds,
                     .trust = 1,
                     .director = director};
    return live_rig_run(&rig);
}

/* Rows of a table: finite, their times increasing; gives the last time. */
static double check_times(const char *name) {
    char path[256];
    mhe_table *table = NULL;
    mhe_table_info info = {.size = sizeof info};
    mhe_error err = {0};
    (void)snprintf(path, sizeof path, "%s/%s/live_q.sto", live_rig_folder(), name);
    if (mhe_table_read_signals(path, &table, &err) != MHE_OK ||
        mhe_table_describe(table, &info, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_true(info.n_rows > 100);
    for (int32_t k = 0; k < info.n_rows; k++) {
        assert_true(k == 0 || info.time[k] > info.time[k - 1]);
        for (int32_t i = 0; i < info.n_columns; i++) {
            assert_true(isfinite(info.values[(ptrdiff_t)k * info.n_columns + i]));
        }
    }
    const double last = info.time[info.n_rows - 1];
    mhe_table_close(table);
    return last;
}

/* The demo lasts 3 s; what is told of the fault in its middle. Recorded and repeated. */
static void fault(const char *which, const char *said, double least_frames) {
    char source[1024], again[64], record[160];
    static const char *const files[] = {"live_q.sto", "live_force.sto", "live_emg.sto"};
    (void)snprintf(source, sizeof source, ROUGH, which);
    (void)snprintf(record, sizeof record, "%s/%s.xdf", live_rig_folder(), which);
    if (run(which, source, "", record, 0, NULL) != MHE_OK) {
        fail_msg("%s: %s", which, rig.err.text);
    }
    const double estimates = live_rig_number(rig.summary, "estimates");
    if (live_words_count(&rig.words, said) < 1 ||
        live_rig_number(rig.summary, "frames") < least_frames || estimates < least_frames - 30) {
        fail_msg("%s: not told '%s' but:\n%s\n%s", which, said, rig.words.text, rig.summary);
    }
    mhe_free(rig.summary);
    const double last = check_times(which);
    assert_true(last > 2.9 && last < 4); /* to the end, on one time */
    (void)snprintf(again, sizeof again, "%s-again", which);
    (void)snprintf(source, sizeof source, "{plugin: mhe.source.recording, file: %s, speed: 0}",
                   record);
    if (run(again, source, "", NULL, 0, NULL) != MHE_OK) {
        fail_msg("%s: %s", again, rig.err.text);
    }
    mhe_free(rig.summary);
    for (size_t i = 0; i < 3; i++) {
        assert_true(live_rig_same(which, again, files[i]));
    }
}

static void a_clock_that_jumps(void **state) {
    (void)state;
    fault("jump-ahead", "its clock was set by", 301);
    fault("jump-back", "its clock was set by -", 301);
}

static void nothing_but_nan(void **state) {
    (void)state;
    fault("nan", "frames come from", 301); /* its line is the table: all markers missing */
}

static void other_channels(void **state) {
    (void)state;
    fault("more", "the markers are others", 301);
    fault("fewer", "the markers are others", 301);
    assert_int_equal(live_words_count(&rig.words, "a stream is another from here on"), 2);
}

static void another_rate(void **state) {
    (void)state;
    fault("rate", "the EMG is another", 301);
}

static void two_of_one_name(void **state) {
    (void)state;
    fault("twice", "are of one kind: the second is passed over", 301);
}

/* ---- ports ---- */

static void a_port_in_use(void **state) {
    (void)state;
    char sink[100];
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    socklen_t length = sizeof here;
    const int held = socket(AF_INET, SOCK_STREAM, 0);
    assert_true(held >= 0);
    assert_int_equal(bind(held, (struct sockaddr *)&here, sizeof here), 0);
    assert_int_equal(listen(held, 1), 0);
    assert_int_equal(getsockname(held, (struct sockaddr *)&here, &length), 0);
    (void)snprintf(sink, sizeof sink, ", {plugin: mhe.sink.web, port: %d}",
                   (int)ntohs(here.sin_port));
    const mhe_status status =
        run("port", "{plugin: mhe.source.recording, markers: " ARM "/demo_markers.trc}", sink, NULL,
            0, NULL);
    (void)close(held);
    if (status == MHE_E_PLUGIN || strstr(rig.err.text, "no plugin") != NULL) {
        skip(); /* built without libwebsockets */
    }
    assert_int_equal(status, MHE_E_IO);
    if (strstr(rig.err.text, "is it in use?") == NULL ||
        strstr(rig.err.text, "live.yaml:11") == NULL) {
        fail_msg("%s", rig.err.text);
    }
}

/* Whether a port of loopback takes a connection there. */
static int answers(uint32_t address, int port) {
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    at.sin_addr.s_addr = htonl(address);
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    const int code = connect(fd, (struct sockaddr *)&at, sizeof at);
    (void)close(fd);
    return code == 0;
}

static int here, elsewhere;

static void *knock(void *data) {
    static const char url[] = "http://127.0.0.1:";
    (void)data;
    here = elsewhere = -1;
    if (live_words_wait(&rig.words, url, 1)) {
        const int port = atoi(strstr(rig.words.text, url) + strlen(url));
        here = answers(INADDR_LOOPBACK, port);
        elsewhere = answers(INADDR_LOOPBACK + 1, port);
    }
    mhe_live_stop(rig.live);
    return NULL;
}

/* The page is to be had at the address that was asked for, and at no other of this machine. */
static void one_address_alone(void **state) {
    (void)state;
    static const char demo[] = "{plugin: mhe.source.recording, markers: " ARM "/demo_markers.trc}";
    const mhe_status status =
        run("address", demo, ", {plugin: mhe.sink.web, port: 0}", NULL, 0, knock);
    if (status == MHE_E_PLUGIN || strstr(rig.err.text, "no plugin") != NULL) {
        skip(); /* built without libwebsockets */
    }
    assert_int_equal(status, MHE_OK);
    mhe_free(rig.summary);
    assert_int_equal(here, 1);
    assert_int_equal(elsewhere, 0);
    assert_int_equal(run("other", demo, ", {plugin: mhe.sink.web, port: 0, address: 203.0.113.77}",
                         NULL, 0, NULL),
                     MHE_E_IO);
    assert_non_null(strstr(rig.err.text, "'203.0.113.77' is none of this machine's"));
    assert_int_equal(
        run("none", demo, ", {plugin: mhe.sink.web, port: 0, address: 300.1.2.3}", NULL, 0, NULL),
        MHE_E_CONFIG);
}

/* A device whose port sends garbage in the middle of a run, then works again. */
static qtm_server *server;
static int went_on;

static void *send_garbage(void *data) {
    (void)data;
    went_on = 0;
    if (live_words_wait(&rig.words, "frames come from", 1)) {
        qtm_server_set(server, QTM_GARBAGE);
        const int told = live_words_wait(&rig.words, "this is no real-time server of QTM", 1);
        qtm_server_set(server, QTM_STREAM);
        went_on = told && live_words_wait(&rig.words, "QTM is back", 1);
    }
    mhe_live_stop(rig.live);
    return NULL;
}

static void garbage_on_a_devices_port(void **state) {
    (void)state;
    char source[200];
    server = qtm_server_start(0);
    assert_non_null(server);
    (void)snprintf(source, sizeof source,
                   "{plugin: mhe.source.qualisys, host: 127.0.0.1, port: %d}",
                   (int)qtm_server_port(server));
    const mhe_status status = run("garbage", source, "", NULL, 0, send_garbage);
    qtm_server_stop(server);
    if (status != MHE_OK) {
        fail_msg("%s\n%s", rig.err.text, rig.words.text);
    }
    assert_true(went_on);
    mhe_free(rig.summary);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_clock_that_jumps), cmocka_unit_test(nothing_but_nan),
        cmocka_unit_test(other_channels),     cmocka_unit_test(another_rate),
        cmocka_unit_test(two_of_one_name),    cmocka_unit_test(a_port_in_use),
        cmocka_unit_test(one_address_alone),  cmocka_unit_test(garbage_on_a_devices_port)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
