/* SPDX-License-Identifier: Apache-2.0 */
/* mhe.source.qualisys against a server that speaks QTM's real-time protocol, which the official
 * client of Qualisys reads, too: numbers, clocks, and whatever goes wrong on the way. */
#include "qtm_server.h"
#include "use.h"

#include <math.h>
#include <mhe/source.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define PATIENCE 30.0           /* s until a test gives up; nothing is judged by its speed */
#define SOON ", retry: 0.02"    /* and not after half a second, which every fault would take */
#define SILENT ", silence: 0.1" /* and not two seconds */

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

typedef struct reader {
    const mhe_source_ops *ops;
    void *self;
    int32_t n_frames, n_analog, n_wrong, seen[8];
    char text[8][512]; /* of the last event of each kind */
} reader;

/* What stands in a chunk is what the server's formula says of its time. */
static void take_chunk(void *data, const mhe_chunk *chunk) {
    reader *r = data;
    mhe_stream_info info = {.size = sizeof info};
    (void)r->ops->stream(r->self, chunk->stream, &info, NULL);
    for (int32_t k = 0; k < chunk->n; k++) {
        const double *v = chunk->values + (ptrdiff_t)k * info.n_channels;
        if (chunk->stream == 0) {
            const int64_t frame = llround(100 * chunk->stamp[k]);
            for (int32_t i = 0; i < info.n_channels; i++) {
                const double m = 1e-3 * (double)qtm_marker(frame, i / 3, i % 3);
                r->n_wrong += isnan(m) ? !isnan(v[i]) : v[i] != m;
            }
            r->n_frames++;
        } else { /* the packet's time is that of its last sample */
            const int64_t n = llround(info.rate * chunk->stamp[k]) + llround(info.rate / 100) - 1;
            for (int32_t i = 0; i < info.n_channels; i++) {
                r->n_wrong += v[i] != (double)qtm_analog(n, i);
            }
            r->n_analog++;
        }
    }
}

static void take_event(void *data, int32_t event, int32_t stream, const char *text) {
    reader *r = data;
    (void)stream;
    r->seen[event & 7]++;
    (void)snprintf(r->text[event & 7], sizeof r->text[0], "%s", text);
}

static void begin_reader(reader *r, int32_t port, const char *more) {
    const mhe_plugin *plugin = test_plugin("mhe.source.qualisys", MHE_SOURCE_IFACE);
    char yaml[200];
    mhe_error err = {0};
    assert_non_null(plugin);
    (void)snprintf(yaml, sizeof yaml, "{host: 127.0.0.1, port: %d%s}", (int)port, more);
    *r = (reader){.ops = plugin->ops};
    assert_int_equal(r->ops->create(test_host(), test_config(plugin, yaml), &r->self, &err),
                     MHE_OK);
}

static mhe_status open_reader(reader *r, const char *said, mhe_error *err) {
    const double until = now() + PATIENCE;
    mhe_status status = MHE_RETRY;
    while (status == MHE_RETRY && now() < until && (said == NULL || !strstr(err->text, said))) {
        status = r->ops->open(r->self, now() + 0.5, err);
    }
    return status;
}

static void open_well(reader *r) {
    mhe_error err = {0};
    if (open_reader(r, NULL, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

static void read_once(reader *r) {
    const mhe_source_taker taker = {sizeof taker, r, take_chunk, take_event};
    mhe_error err = {0};
    assert_int_equal(r->ops->read(r->self, now() + 0.02, &taker, &err), MHE_OK);
}

static void read_frames(reader *r, int32_t more) {
    const int32_t n = r->n_frames + more;
    const double until = now() + PATIENCE;
    while (r->n_frames < n && now() < until) {
        read_once(r);
    }
    assert_true(r->n_frames >= n);
    assert_int_equal(r->n_wrong, 0);
}

/* Where the machine stands still for a moment, a short silence is told beside what is waited for.
 */
static void read_until(reader *r, int32_t event, int32_t times, const char *said) {
    const double until = now() + PATIENCE;
    while ((r->seen[event] < times || strstr(r->text[event], said) == NULL) && now() < until) {
        read_once(r);
    }
    if (r->seen[event] < times || strstr(r->text[event], said) == NULL) {
        fail_msg("event %d: %d times, '%s' does not say '%s'", (int)event, (int)r->seen[event],
                 r->text[event], said);
    }
}

/* A server that goes on otherwise after ten frames. */
static qtm_server *read_ten_then(reader *r, int what) {
    qtm_server *server = qtm_server_start(0);
    begin_reader(r, qtm_server_port(server), SOON);
    open_well(r);
    read_frames(r, 10);
    qtm_server_set(server, what);
    return server;
}

static void end(reader *r, qtm_server *server) {
    r->ops->destroy(r->self);
    qtm_server_stop(server);
}

static void numbers_as_they_are(void **state) {
    (void)state;
    qtm_server *server = qtm_server_start(0);
    reader r;
    mhe_error err = {0};
    mhe_stream_info info = {.size = sizeof info};
    assert_non_null(server);
    begin_reader(&r, qtm_server_port(server), "");
    open_well(&r);
    assert_int_equal(r.ops->count(r.self), 2);
    assert_int_equal(r.ops->stream(r.self, 0, &info, &err), MHE_OK);
    assert_int_equal(info.n_channels, 6);
    assert_string_equal(info.labels[4], "B.y");
    assert_string_equal(info.units[0], "m");
    assert_true(info.rate == 100 && info.up == 2);
    assert_int_equal(r.ops->stream(r.self, 1, &info, &err), MHE_OK);
    assert_string_equal(info.labels[1], "Triceps");
    assert_string_equal(info.name, "EMG box");
    assert_true(info.rate == 500);
    read_frames(&r, 200);
    assert_true(r.n_analog >= 5 * 199);
    assert_int_equal(r.seen[MHE_SOURCE_WARNING], 0);
    end(&r, server);
}

/* The official client sees the same server, at the same time. */
static void the_official_client(void **state) {
    (void)state;
    qtm_server *server = qtm_server_start(0);
    char command[600];
    reader r;
    assert_non_null(server);
    begin_reader(&r, qtm_server_port(server), "");
    open_well(&r);
    (void)snprintf(command, sizeof command, "command -v node >/dev/null || exit 77; node %s %d",
                   MHE_TEST_SOURCE_DIR "/tests/live/qtm_client.js", (int)qtm_server_port(server));
    const int code = system(command);
    read_frames(&r, 20);
    end(&r, server);
    if (WEXITSTATUS(code) == 77) {
        print_message("skipped: qualisys-rt is not installed (./bootstrap test does)\n");
        skip();
    }
    assert_int_equal(code, 0);
}

static void markers_alone(void **state) {
    (void)state;
    qtm_server *server = qtm_server_start(0);
    reader r;
    begin_reader(&r, qtm_server_port(server), ", emg: false");
    open_well(&r);
    assert_int_equal(r.ops->count(r.self), 1);
    read_frames(&r, 20);
    assert_int_equal(r.n_analog, 0);
    end(&r, server);
}

static void what_is_not_there(void **state) {
    (void)state;
    qtm_server *server = qtm_server_start(0);
    const int32_t port = qtm_server_port(server);
    reader r;
    mhe_error err = {0};
    begin_reader(&r, port, ", device: Nobody");
    assert_int_equal(open_reader(&r, "no analog device 'Nobody'", &err), MHE_RETRY);
    assert_non_null(strstr(err.text, "no analog device 'Nobody'"));
    r.ops->destroy(r.self);
    qtm_server_set(server, QTM_BAD_XML);
    begin_reader(&r, port, "");
    assert_int_equal(open_reader(&r, NULL, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "no valid XML"));
    end(&r, server);
    begin_reader(&r, port, "");
    err.text[0] = '\0';
    assert_int_equal(open_reader(&r, "no QTM at 127.0.0.1", &err), MHE_RETRY);
    assert_non_null(strstr(err.text, "no QTM at 127.0.0.1"));
    r.ops->destroy(r.self);
}

/* A fault in the middle: told, and streaming goes on when it is over. */
static void fault(const char *more, int what, int32_t event, const char *said) {
    qtm_server *server = qtm_server_start(0);
    reader r;
    assert_non_null(server);
    begin_reader(&r, qtm_server_port(server), more);
    open_well(&r);
    read_frames(&r, 10);
    qtm_server_set(server, what);
    read_until(&r, event, 1, said);
    qtm_server_set(server, QTM_STREAM);
    read_frames(&r, 10);
    end(&r, server);
}

static void faults(void **state) {
    (void)state;
    fault(SOON, QTM_CLOSE, MHE_SOURCE_LOST, "QTM has closed the connection");
    fault(SOON, QTM_GARBAGE, MHE_SOURCE_LOST, "this is no real-time server of QTM");
    fault(SOON, QTM_HUGE, MHE_SOURCE_LOST, "this is no real-time server of QTM");
    fault(SOON, QTM_CUT, MHE_SOURCE_WARNING, "cut short");
    fault(SOON, QTM_END, MHE_SOURCE_LOST, "no more data");
    fault(SOON, QTM_LOSE, MHE_SOURCE_WARNING, "5 analog samples were lost");
    fault(SOON, QTM_SIZE, MHE_SOURCE_WARNING, "cut short or larger");
    fault(SOON, QTM_SAYS, MHE_SOURCE_WARNING, "QTM says: Out of?licences");
    fault(SOON SILENT, QTM_2D, MHE_SOURCE_LOST, "no 3D data for 0.1 s");
    fault(SOON SILENT, QTM_AMID, MHE_SOURCE_LOST, "in the middle of a packet");
    fault(SOON, QTM_BARE, MHE_SOURCE_LOST, "no labelled markers");
}

/* What a server says before it streams: told while it is waited for, none of it ends the run. */
static void a_server_that_is_no_use(void **state) {
    (void)state;
    static const struct {
        int what;
        const char *says;
        mhe_status status;
    } cases[] = {{QTM_TURNED, "its little-endian port is one below", MHE_E_INPUT},
                 {QTM_OLD, "QTM says: Version NOT supported", MHE_RETRY},
                 {QTM_BARE, "QTM has no labelled markers", MHE_RETRY}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        qtm_server *server = qtm_server_start(0);
        reader r;
        mhe_error err = {0};
        assert_non_null(server);
        qtm_server_set(server, cases[i].what);
        begin_reader(&r, qtm_server_port(server), "");
        assert_int_equal(open_reader(&r, cases[i].says, &err), cases[i].status);
        if (strstr(err.text, cases[i].says) == NULL) {
            fail_msg("'%s' does not say '%s'", err.text, cases[i].says);
        }
        r.ops->destroy(r.self);
        qtm_server_stop(server);
    }
}

/* Times that go back are the core's to deal with; the source hands all frames on. */
static void frames_that_go_back(void **state) {
    (void)state;
    reader r;
    qtm_server *server = read_ten_then(&r, QTM_BACK);
    read_frames(&r, 100);
    assert_int_equal(r.seen[MHE_SOURCE_LOST] + r.seen[MHE_SOURCE_WARNING], 0);
    end(&r, server);
}

static void another_rate(void **state) {
    (void)state;
    reader r;
    mhe_stream_info info = {.size = sizeof info};
    qtm_server *server = read_ten_then(&r, QTM_SPEED);
    read_until(&r, MHE_SOURCE_CHANGED, 1, "other markers or channels");
    assert_int_equal(r.ops->stream(r.self, 1, &info, NULL), MHE_OK);
    assert_true(info.rate == 1000);
    const int32_t before = r.n_analog;
    read_frames(&r, 20);
    assert_true(r.n_analog - before >= 2 * QTM_SAMPLES * 19);
    end(&r, server);
}

/* Data that differ from what is described for good are told once, not with every frame. */
static void unlike_its_settings(void **state) {
    (void)state;
    reader r;
    qtm_server *server = read_ten_then(&r, QTM_UNLIKE);
    read_until(&r, MHE_SOURCE_WARNING, 1, "other numbers of markers");
    const int32_t analog = r.n_analog;
    const double later = now() + 0.1, until = now() + PATIENCE;
    while ((r.n_analog < analog + 50 * QTM_SAMPLES || now() < later) && now() < until) {
        read_once(&r); /* several times as long as it waits before it asks again */
    }
    assert_true(r.n_analog >= analog + 50 * QTM_SAMPLES);
    assert_int_equal(r.seen[MHE_SOURCE_WARNING], 1);
    assert_int_equal(r.seen[MHE_SOURCE_CHANGED], 0);
    qtm_server_set(server, QTM_STREAM);
    read_frames(&r, 10);
    end(&r, server);
}

/* The server is started anew on the same port. */
static void started_again(void **state) {
    (void)state;
    qtm_server *server = qtm_server_start(0);
    const int32_t port = qtm_server_port(server);
    reader r;
    begin_reader(&r, port, SOON);
    open_well(&r);
    read_frames(&r, 10);
    qtm_server_stop(server);
    read_until(&r, MHE_SOURCE_LOST, 1, "closed");
    server = qtm_server_start(port);
    assert_non_null(server);
    read_until(&r, MHE_SOURCE_CHANGED, 1, "QTM is back");
    read_frames(&r, 10);
    end(&r, server);
}

static void other_markers(void **state) {
    (void)state;
    qtm_server *server = qtm_server_start(0);
    reader r;
    mhe_stream_info info = {.size = sizeof info};
    begin_reader(&r, qtm_server_port(server), SOON);
    open_well(&r);
    read_frames(&r, 10);
    qtm_server_set(server, QTM_OTHER); /* with the event that says so */
    read_until(&r, MHE_SOURCE_CHANGED, 1, "other markers");
    assert_int_equal(r.ops->stream(r.self, 0, &info, NULL), MHE_OK);
    assert_string_equal(info.labels[3], "C.x");
    read_frames(&r, 10);
    qtm_server_set(server, QTM_FEWER); /* and without */
    read_until(&r, MHE_SOURCE_CHANGED, 2, "other markers");
    assert_int_equal(r.ops->stream(r.self, 0, &info, NULL), MHE_OK);
    assert_int_equal(info.n_channels, 3);
    read_frames(&r, 10);
    end(&r, server);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(numbers_as_they_are),
                                       cmocka_unit_test(the_official_client),
                                       cmocka_unit_test(markers_alone),
                                       cmocka_unit_test(what_is_not_there),
                                       cmocka_unit_test(faults),
                                       cmocka_unit_test(a_server_that_is_no_use),
                                       cmocka_unit_test(frames_that_go_back),
                                       cmocka_unit_test(another_rate),
                                       cmocka_unit_test(unlike_its_settings),
                                       cmocka_unit_test(started_again),
                                       cmocka_unit_test(other_markers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
