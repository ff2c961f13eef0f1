/* SPDX-License-Identifier: Apache-2.0 */
/* mhe.source.lsl against senders of liblsl itself, on loopback: what a stream says of itself, what
 * comes of its samples, and what is told of a sender that goes, comes, is another, or is no use. */
#include "lsl_rig.h"
#include "use.h"

#include <math.h>
#include <mhe/source.h>
#include <stdlib.h>
#include <string.h>

#define PATIENCE 20.0 /* s until a test gives up; nothing is judged by its speed */

static lsl_rig rig;
static char folder[256];

/* ---- the source's side ---- */

typedef struct taken {
    int32_t n_samples, n_events, last_event, n_channels;
    double values[4096], stamps[4096], received[4096];
    char text[512];
    int32_t seen[8]; /* events by kind */
} taken;

static void take_chunk(void *data, const mhe_chunk *chunk) {
    taken *t = data;
    for (int32_t k = 0; k < chunk->n && t->n_samples < 512; k++) {
        t->stamps[t->n_samples] = chunk->stamp[k];
        t->received[t->n_samples] = chunk->received;
        for (int32_t i = 0; i < t->n_channels && i < 8; i++) {
            t->values[8 * t->n_samples + i] = chunk->values[k * t->n_channels + i];
        }
        t->n_samples++;
    }
}

static void take_event(void *data, int32_t event, int32_t stream, const char *text) {
    taken *t = data;
    (void)stream;
    t->n_events++;
    t->last_event = event;
    t->seen[event & 7]++;
    (void)snprintf(t->text, sizeof t->text, "%s", text);
}

typedef struct reader {
    const mhe_source_ops *ops;
    void *self;
    taken got;
} reader;

static void begin_reader(reader *r, const char *yaml) {
    const mhe_plugin *plugin = test_plugin("mhe.source.lsl", MHE_SOURCE_IFACE);
    mhe_error err = {0};
    assert_non_null(plugin);
    *r = (reader){.ops = plugin->ops};
    if (r->ops->create(test_host(), test_config(plugin, yaml), &r->self, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

/* Tries to open until the status is as hoped for; err: of the last try. */
static mhe_status open_reader(reader *r, mhe_status hoped, const char *said, mhe_error *err) {
    const double until = lsl_rig_now() + PATIENCE;
    mhe_status status = MHE_RETRY;
    do {
        status = r->ops->open(r->self, lsl_rig_now() + 0.5, err);
    } while (!(status == hoped && (said == NULL || strstr(err->text, said) != NULL)) &&
             status >= 0 && status != MHE_OK && lsl_rig_now() < until);
    return status;
}

static void read_once(reader *r) {
    const mhe_source_taker taker = {sizeof taker, &r->got, take_chunk, take_event};
    mhe_error err = {0};
    mhe_stream_info info = {.size = sizeof info};
    if (r->ops->stream(r->self, 0, &info, &err) == MHE_OK) {
        r->got.n_channels = info.n_channels;
    }
    assert_int_equal(r->ops->read(r->self, lsl_rig_now() + 0.02, &taker, &err), MHE_OK);
}

/* Reads until an event of this kind was told. */
static void read_until(reader *r, int32_t event) {
    const double until = lsl_rig_now() + PATIENCE;
    while (r->got.seen[event] == 0 && lsl_rig_now() < until) {
        read_once(r);
    }
    if (r->got.seen[event] == 0) {
        fail_msg("event %d was not told; the last was %d: %s", (int)event, (int)r->got.last_event,
                 r->got.text);
    }
}

/* A machine that was busy for a second may have told of a loss already. */
static void forget(reader *r) {
    memset(r->got.seen, 0, sizeof r->got.seen);
}

/* Sends the sample again and again until some of it has come. */
static void exchange(reader *r, lsl_outlet outlet, const double *sample, int32_t least) {
    const double until = lsl_rig_now() + PATIENCE;
    while (r->got.n_samples < least && lsl_rig_now() < until) {
        (void)rig.lsl.push_sample_dtp(outlet, sample, rig.lsl.local_clock(), 1);
        read_once(r);
    }
    assert_true(r->got.n_samples >= least);
}

static void open_well(reader *r) {
    mhe_error err = {0};
    if (open_reader(r, MHE_OK, NULL, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
}

/* ---- senders ---- */

static const lsl_channel two_markers[] = {{"A_X", "mm", "PositionX"}, {"A_Y", "mm", "PositionY"},
                                          {"A_Z", "mm", "PositionZ"}, {"B.x", "mm", ""},
                                          {"B.y", "mm", ""},          {"B.z", "mm", ""}};
static const lsl_channel other_markers[] = {{"A", "mm", "PositionX"}, {"A", "mm", "PositionY"},
                                            {"A", "mm", "PositionZ"}, {"C", "mm", "PositionX"},
                                            {"C", "mm", "PositionY"}, {"C", "mm", "PositionZ"}};
static const double positions[] = {0.1, -2.5e-3, 1e300, 4, NAN, 1.0 / 3};

static lsl_outlet send_markers(const char *name, double rate, const lsl_channel *channels,
                               int32_t n) {
    lsl_outlet outlet = lsl_rig_send(&rig, name, "MoCap", lsl_double64, rate, channels, n);
    assert_non_null(outlet);
    return outlet;
}

static void a_stream_as_it_is(void **state) {
    (void)state;
    reader r;
    mhe_error err = {0};
    lsl_outlet outlet = send_markers("plain", 100, two_markers, 6);
    begin_reader(&r, "markers: [\"name='plain'\"]");
    open_well(&r);
    mhe_stream_info info = {.size = sizeof info};
    assert_int_equal(r.ops->count(r.self), 1);
    assert_int_equal(r.ops->stream(r.self, 0, &info, &err), MHE_OK);
    assert_string_equal(info.name, "plain");
    assert_int_equal(info.n_channels, 6);
    assert_string_equal(info.labels[0], "A.x");
    assert_string_equal(info.labels[2], "A.z");
    assert_string_equal(info.labels[4], "B.y");
    assert_string_equal(info.units[3], "mm");
    assert_true(info.rate == 100);
    const double begun = lsl_rig_now();
    exchange(&r, outlet, positions, 20);
    for (int32_t k = 0; k < r.got.n_samples; k++) { /* bits, NaN too */
        assert_memory_equal(r.got.values + 8 * k, positions, sizeof positions);
    }
    double offset = NAN;
    assert_int_equal(r.ops->clock_offset(r.self, 0, &offset, &err), MHE_OK);
    for (int32_t k = 0; k < r.got.n_samples; k++) { /* stamps are this machine's time */
        const double at = r.got.stamps[k] + offset;
        assert_true(at > begun - 0.01 && at < r.got.received[k] + 0.01);
    }
    rig.lsl.destroy_outlet(outlet);
    r.ops->destroy(r.self);
}

static void sixteen_bits(void **state) {
    (void)state;
    reader r;
    static const lsl_channel channels[] = {{"one", "uV", "EMG"}, {"", "", ""}};
    static const int16_t sample[] = {-32768, 1234};
    lsl_outlet outlet = lsl_rig_send(&rig, "short", "EMG", lsl_int16, 1000, channels, 2);
    begin_reader(&r, "emg: [\"name='short'\"]");
    open_well(&r);
    mhe_stream_info info = {.size = sizeof info};
    assert_int_equal(r.ops->stream(r.self, 0, &info, NULL), MHE_OK);
    assert_string_equal(info.labels[0], "one");
    assert_string_equal(info.labels[1], "channel_2"); /* one without a name */
    const double until = lsl_rig_now() + PATIENCE;
    while (r.got.n_samples < 5 && lsl_rig_now() < until) {
        (void)rig.push_int16(outlet, sample, rig.lsl.local_clock(), 1);
        read_once(&r);
    }
    assert_true(r.got.n_samples >= 5);
    assert_true(r.got.values[0] == -32768 && r.got.values[1] == 1234);
    rig.lsl.destroy_outlet(outlet);
    r.ops->destroy(r.self);
}

static void refused(const char *yaml, mhe_status hoped, const char *said) {
    reader r;
    mhe_error err = {0};
    begin_reader(&r, yaml);
    const mhe_status status = open_reader(&r, hoped, said, &err);
    if (status != hoped || strstr(err.text, said) == NULL) {
        fail_msg("status %d, '%s' does not say '%s'", (int)status, err.text, said);
    }
    r.ops->destroy(r.self);
}

static void what_is_no_use(void **state) {
    (void)state;
    static const lsl_channel word[] = {{"event", "", ""}};
    lsl_outlet text = lsl_rig_send(&rig, "words", "Markers", lsl_string, 0, word, 1);
    lsl_outlet wide = lsl_rig_send(&rig, "wide", "EMG", lsl_float32, 100, NULL, 5000);
    lsl_outlet first = send_markers("twice", 100, two_markers, 6);
    lsl_outlet second = send_markers("twice", 100, two_markers, 6);
    refused("markers: [\"name='nobody'\"]", MHE_RETRY, "no stream with name='nobody'");
    refused("markers: [\"name='words'\"]", MHE_E_INPUT, "holds text: numbers are needed");
    refused("emg: [\"name='wide'\"]", MHE_E_INPUT, "no channel, or too many");
    refused("markers: [\"name='twice'\"]", MHE_RETRY, "2 streams with name='twice'");
    refused("markers: [\"name='\"]", MHE_RETRY, "no stream with name='"); /* no XPath at all */
    rig.lsl.destroy_outlet(text);
    rig.lsl.destroy_outlet(wide);
    rig.lsl.destroy_outlet(first);
    rig.lsl.destroy_outlet(second);
}

/* One that ends and comes again as it was; then as another. */
static void goes_and_comes(void **state) {
    (void)state;
    reader r;
    lsl_outlet outlet = send_markers("guest", 100, two_markers, 6);
    begin_reader(&r, "markers: [\"name='guest'\"]");
    open_well(&r);
    exchange(&r, outlet, positions, 3);
    rig.lsl.destroy_outlet(outlet);
    forget(&r);
    read_until(&r, MHE_SOURCE_LOST);
    assert_non_null(strstr(r.got.text, "'guest' sends nothing any more"));
    outlet = send_markers("guest", 100, two_markers, 6);
    read_until(&r, MHE_SOURCE_BACK);
    r.got.n_samples = 0;
    exchange(&r, outlet, positions, 3);
    assert_int_equal(r.got.seen[MHE_SOURCE_CHANGED], 0);
    rig.lsl.destroy_outlet(outlet);
    r.ops->destroy(r.self);
}

/* What comes back is `channels` at `rate`: told as changed, described anew, and read. */
static void comes_as(const char *name, double rate, const lsl_channel *channels, int32_t n,
                     const char *fourth) {
    reader r;
    char yaml[100];
    (void)snprintf(yaml, sizeof yaml, "markers: [\"name='%s'\"]", name);
    lsl_outlet outlet = send_markers(name, 100, two_markers, 6);
    begin_reader(&r, yaml);
    open_well(&r);
    exchange(&r, outlet, positions, 3);
    rig.lsl.destroy_outlet(outlet);
    forget(&r);
    read_until(&r, MHE_SOURCE_LOST);
    outlet = send_markers(name, rate, channels, n);
    read_until(&r, MHE_SOURCE_CHANGED);
    assert_non_null(strstr(r.got.text, "other channels, units or another rate"));
    mhe_stream_info info = {.size = sizeof info};
    assert_int_equal(r.ops->stream(r.self, 0, &info, NULL), MHE_OK);
    assert_int_equal(info.n_channels, n);
    assert_true(info.rate == rate);
    if (fourth != NULL) {
        assert_string_equal(info.labels[3], fourth);
    }
    r.got.n_samples = 0;
    exchange(&r, outlet, positions, 3);
    assert_memory_equal(r.got.values, positions, sizeof(double) * (size_t)n);
    rig.lsl.destroy_outlet(outlet);
    r.ops->destroy(r.self);
}

static void comes_with_other_labels(void **state) {
    (void)state;
    comes_as("labels", 100, other_markers, 6, "C.x");
}

static void comes_with_another_rate(void **state) {
    (void)state;
    comes_as("rate", 200, two_markers, 6, "B.x");
}

static void comes_with_fewer_channels(void **state) {
    (void)state;
    comes_as("fewer", 100, two_markers, 3, NULL);
}

/* What comes back is text: told once, and waited for something better. */
static void comes_as_text(void **state) {
    (void)state;
    reader r;
    static const lsl_channel word[] = {{"event", "", ""}};
    lsl_outlet outlet = send_markers("worse", 100, two_markers, 6);
    begin_reader(&r, "markers: [\"name='worse'\"]");
    open_well(&r);
    exchange(&r, outlet, positions, 3);
    rig.lsl.destroy_outlet(outlet);
    forget(&r);
    read_until(&r, MHE_SOURCE_LOST);
    outlet = lsl_rig_send(&rig, "worse", "MoCap", lsl_string, 0, word, 1);
    read_until(&r, MHE_SOURCE_WARNING);
    assert_non_null(strstr(r.got.text, "holds text"));
    for (int32_t k = 0; k < 20; k++) {
        read_once(&r);
    }
    assert_int_equal(r.got.seen[MHE_SOURCE_WARNING], 1);
    rig.lsl.destroy_outlet(outlet);
    outlet = send_markers("worse", 100, two_markers, 6);
    read_until(&r, MHE_SOURCE_BACK);
    rig.lsl.destroy_outlet(outlet);
    r.ops->destroy(r.self);
}

/* Connected, but silent: told, and told when it speaks again. */
static void falls_silent(void **state) {
    (void)state;
    reader r;
    lsl_outlet outlet = send_markers("silent", 100, two_markers, 6);
    begin_reader(&r, "markers: [\"name='silent'\"]");
    open_well(&r);
    exchange(&r, outlet, positions, 3);
    read_until(&r, MHE_SOURCE_LOST);
    r.got.n_samples = 0;
    exchange(&r, outlet, positions, 3);
    assert_int_equal(r.got.seen[MHE_SOURCE_BACK], 1);
    rig.lsl.destroy_outlet(outlet);
    r.ops->destroy(r.self);
}

static void without_the_library(void **state) {
    (void)state;
    const mhe_plugin *plugin = test_plugin("mhe.source.lsl", MHE_SOURCE_IFACE);
    const mhe_source_ops *ops = plugin->ops;
    void *self = NULL;
    mhe_error err = {0};
    const void *config =
        test_config(plugin, "{emg: [\"type='EMG'\"], library: /no/such/liblsl.so}");
    assert_int_equal(ops->create(test_host(), config, &self, &err), MHE_E_IO);
    assert_non_null(strstr(err.text, "library: liblsl cannot be loaded: /no/such/liblsl.so"));
    assert_null(strchr(err.text, '\n'));
    assert_int_equal(ops->create(test_host(), test_config(plugin, ""), &self, &err), MHE_E_CONFIG);
    assert_non_null(strstr(err.text, "no stream is asked for"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_stream_as_it_is),
        cmocka_unit_test(sixteen_bits),
        cmocka_unit_test(what_is_no_use),
        cmocka_unit_test(goes_and_comes),
        cmocka_unit_test(comes_with_other_labels),
        cmocka_unit_test(comes_with_another_rate),
        cmocka_unit_test(comes_with_fewer_channels),
        cmocka_unit_test(comes_as_text),
        cmocka_unit_test(falls_silent),
        cmocka_unit_test(without_the_library),
    };
    if (test_folder(folder, sizeof folder) == NULL || !lsl_rig_open(folder, &rig)) {
        (void)puts("skipped: there is no liblsl (vendor/take fetches it)");
        return TEST_SKIPPED;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
