/* SPDX-License-Identifier: Apache-2.0 */
/* .xdf: markers and EMG of two senders with clocks of their own come out on one time, in metres and
 * by name; what recorders leave behind when they are killed; files that are not what they say. */
#include "io/motion_file.h"
#include "io/xdf.h"
#include "support.h"

#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* A file under construction, written by the format's description alone. */
typedef struct file {
    uint8_t data[1 << 20];
    size_t size;
} file;

static void put(file *f, const void *bytes, size_t n) {
    assert_true(f->size + n <= sizeof f->data);
    memcpy(f->data + f->size, bytes, n);
    f->size += n;
}

static void put_integer(file *f, uint64_t value, size_t bytes) {
    for (size_t i = 0; i < bytes; i++) {
        const uint8_t byte = (uint8_t)(value >> (8 * i));
        put(f, &byte, 1);
    }
}

static void put_double(file *f, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_integer(f, bits, 8);
}

static void put_chunk(file *f, uint16_t tag, const file *content) {
    put_integer(f, 8, 1); /* the longest form of a length */
    put_integer(f, content->size + 2, 8);
    put_integer(f, tag, 2);
    put(f, content->data, content->size);
}

static file content, whole;

static void assert_near(double value, double expected, double tolerance) {
    if (!(fabs(value - expected) <= tolerance)) {
        fail_msg("%.12g is not within %g of %.12g", value, tolerance, expected);
    }
}

static void begin(uint32_t id) {
    content.size = 0;
    put_integer(&content, id, 4);
}

static void add(uint16_t tag) {
    put_chunk(&whole, tag, &content);
}

static void add_header(uint32_t id, const char *name, const char *type, int32_t n,
                       const char *format, const char *rate, const char *channels) {
    char xml[4096];
    const int length = snprintf(
        xml, sizeof xml,
        "<?xml version=\"1.0\"?><info><name>%s</name><type>%s</type><channel_count>%d"
        "</channel_count><nominal_srate>%s</nominal_srate><channel_format>%s</channel_format>"
        "<desc><channels>%s</channels></desc></info>",
        name, type, (int)n, rate, format, channels);
    begin(id);
    put(&content, xml, (size_t)length);
    add(2);
}

static void add_offset(uint32_t id, double time, double offset) {
    begin(id);
    put_double(&content, time);
    put_double(&content, offset);
    add(4);
}

#define AXES(name)                                                                         \
    "<channel><label>" name "_X</label><type>PositionX</type><unit>mm</unit><marker>" name \
    "</marker></channel><channel><label>" name "_Y</label><type>PositionY</type><unit>mm"  \
    "</unit><marker>" name "</marker></channel><channel><label>" name                      \
    "_Z</label><type>PositionZ</type><unit>mm</unit><marker>" name "</marker></channel>"

#define RATE 100.0
#define N_FRAMES 200
#define N_SAMPLES 4000   /* of EMG, at 2000 Hz */
#define EMG_CLOCK 1234.5 /* s that the sender's clock is ahead */

static double jitter(int32_t k) {
    return 2e-3 * sin(12.9898 * k); /* s */
}

/* Two markers at 100 Hz from t = 10 s; EMG from 10.05 s on another clock, in chunks of which only
 * the first sample is stamped. */
static void make_file(void) {
    whole.size = 0;
    put(&whole, "XDF:", 4);
    content.size = 0;
    put(&content, "<info/>", 7);
    add(1);
    add_header(7, "QTM", "MoCap", 6, "float32", "100", AXES("STER") AXES("ELB.L"));
    add_header(3, "Delsys", "EMG", 2, "int16", "2000",
               "<channel><label>bic</label><unit>uV</unit></channel><channel><label>tri</label>"
               "</channel>");
    for (int32_t k = 0; k < N_FRAMES; k++) {
        begin(7);
        put_integer(&content, 1, 1);
        put_integer(&content, 1, 1);
        put_integer(&content, 8, 1);
        put_double(&content, 10 + k / RATE + jitter(k));
        for (int32_t i = 0; i < 6; i++) {
            const float value = k == 5 && i < 3 ? 0 : (float)(1000 * i + k);
            uint32_t bits;
            memcpy(&bits, &value, sizeof bits);
            put_integer(&content, bits, 4);
        }
        add(3);
    }
    for (int32_t k = 0; k < N_SAMPLES; k += 27) {
        const int32_t n = N_SAMPLES - k < 27 ? N_SAMPLES - k : 27;
        begin(3);
        put_integer(&content, 4, 1);
        put_integer(&content, (uint64_t)n, 4);
        for (int32_t i = 0; i < n; i++) {
            put_integer(&content, i == 0 ? 8 : 0, 1);
            if (i == 0) {
                put_double(&content, 10.05 + EMG_CLOCK + k / 2000.0 + jitter(k));
            }
            put_integer(&content, (uint16_t)(int16_t)((k + i) % 30000), 2);
            put_integer(&content, (uint16_t)(int16_t)(-(k + i) % 30000), 2);
        }
        add(3);
    }
    for (int32_t k = 0; k < 10; k++) { /* one of the measurements was held up */
        add_offset(3, 10 + EMG_CLOCK + 0.2 * k, -EMG_CLOCK + (k == 4 ? 0.05 : 0));
    }
}

static mhe_status parse(mhi_table **markers, mhi_table **analog, mhe_error *err) {
    return mhi_xdf_tables_parse("a.xdf", (const char *)whole.data, whole.size, markers, analog,
                                err);
}

static void both_streams_on_one_time(void **state) {
    (void)state;
    mhi_table *m = NULL, *a = NULL;
    mhe_error err = {0};
    make_file();
    assert_int_equal(parse(&m, &a, &err), MHE_OK);
    assert_int_equal(m->n_labels, 2);
    assert_string_equal(m->labels[0], "STER");
    assert_string_equal(m->labels[1], "ELB.L");
    assert_string_equal(m->unit_name, "mm");
    assert_int_equal(m->n_rows, N_FRAMES);
    assert_int_equal(a->n_rows, N_SAMPLES);
    assert_string_equal(a->labels[1], "tri");
    /* float32 of thousands of mm has 1e-7 of a metre */
    assert_near(m->values[8 * 6 + 4], 1e-3 * (4000 + 8), 1e-6);
    assert_true(m->values[5 * 6] != m->values[5 * 6] && m->values[32] != m->values[32]); /* 0 0 0 */
    assert_true(m->values[5 * 6 + 3] == m->values[5 * 6 + 3]);
    assert_near(a->values[2 * 1234 + 1], -1234, 0);
    /* jitter of 2 ms is gone to a tenth of it, the clock's 1234.5 s to 2 ms though one measurement
     * was 50 ms late */
    const double shift = m->time[0];
    for (int32_t k = 1; k < N_FRAMES; k++) {
        assert_near(m->time[k] - shift, k / RATE, 2e-4);
    }
    assert_near(a->time[0] - m->time[0], 0.05, 2e-3);
    assert_near(a->time[N_SAMPLES - 1] - a->time[0], (N_SAMPLES - 1) / 2000.0, 2e-3);
    assert_near(m->rate, RATE, 0);
    mhi_table_free(m);
    mhi_table_free(a);
}

static void a_killed_recorder(void **state) {
    (void)state;
    mhi_table *m = NULL;
    mhe_error err = {0};
    make_file();
    whole.size -= 7;
    assert_int_equal(parse(&m, NULL, &err), MHE_OK);
    assert_int_equal(m->n_rows, N_FRAMES);
    assert_int_equal(m->n_warnings, 1);
    assert_non_null(strstr(m->warnings[0], "ends within a chunk"));
    mhi_table_free(m);
}

static void refused(const char *text) {
    mhi_table *m = NULL;
    mhe_error err = {0};
    assert_int_equal(parse(&m, NULL, &err), MHE_E_INPUT);
    assert_null(m);
    assert_memory_equal(err.text, "a.xdf: ", 7);
    if (strstr(err.text, text) == NULL) {
        fail_msg("'%s' does not say '%s'", err.text, text);
    }
}

static void what_is_no_recording(void **state) {
    (void)state;
    make_file();
    whole.data[0] = 'Y';
    refused("does not begin with 'XDF:'");

    make_file();
    begin(99); /* samples without a header */
    put_integer(&content, 1, 1);
    put_integer(&content, 0, 1);
    add(3);
    refused("no header");

    make_file();
    begin(7); /* four samples promised, none there */
    put_integer(&content, 1, 1);
    put_integer(&content, 4, 1);
    add(3);
    refused("more samples than it has bytes");

    make_file();
    add_header(7, "again", "EMG", 1, "float32", "1", "");
    refused("twice");

    make_file();
    add_header(8, "odd", "EMG", 1, "float16", "1", "");
    refused("channel_format");

    make_file();
    add_header(8, "many", "EMG", 100000000, "float32", "1", "");
    refused("channel_count");
}

static void by_the_name_of_the_file(void **state) {
    (void)state;
    char folder[256], path[300];
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(path, sizeof path, "%s/a.XDF", folder);
    const int fd = open(path, O_WRONLY | O_CREAT, 0600);
    assert_true(fd >= 0);
    make_file();
    assert_true(write(fd, whole.data, whole.size) == (ssize_t)whole.size);
    (void)close(fd);
    mhi_table *m = NULL, *a = NULL;
    assert_int_equal(mhi_markers_read(path, &m, NULL), MHE_OK);
    assert_int_equal(mhi_signals_read(path, &a, NULL), MHE_OK);
    assert_int_equal(m->n_columns, 6);
    assert_int_equal(a->n_columns, 2);
    mhi_table_free(m);
    mhi_table_free(a);
    (void)unlink(path);
    (void)rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(both_streams_on_one_time),
        cmocka_unit_test(a_killed_recorder),
        cmocka_unit_test(what_is_no_recording),
        cmocka_unit_test(by_the_name_of_the_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
