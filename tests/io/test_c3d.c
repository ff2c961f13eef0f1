/* SPDX-License-Identifier: Apache-2.0 */
/* .c3d: points, analog channels and labels in every byte order and both number formats; files that
 * are not what they say. */
#include "c3d_writer.h"
#include "io/c3d.h"
#include "io/motion_file.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static void place(int32_t frame, int32_t point, double xyz[3]) {
    xyz[0] = 100 * frame + point;
    xyz[1] = -250.25;
    xyz[2] = 12.5 * point + 0.5;
    if (point == 1 && frame == 2) {
        xyz[0] = NAN;
    }
}

static double signal_at(int32_t row, int32_t channel) {
    return 3000 - 37 * row + 1000 * channel;
}

static const char *const labels[] = {"Anna:STER", "C7", "C7"};
static const char *const channels[] = {"EMG.Delt", "Fz"};

static test_c3d usual(void) {
    return (test_c3d){.processor = 84,
                      .n_points = 3,
                      .n_channels = 2,
                      .per_frame = 4,
                      .n_frames = 5,
                      .first = 11,
                      .rate = 100,
                      .scale = 0.25,
                      .unit = "mm",
                      .labels = labels,
                      .channels = channels,
                      .gain = 0.5,
                      .general = 0.001,
                      .offset = 8,
                      .point = place,
                      .sample = signal_at};
}

typedef struct outcome {
    mhe_status status;
    mhi_table *points, *analog;
    mhe_error err;
} outcome;

static outcome parse(const uint8_t *data, size_t size) {
    outcome o = {0};
    o.status = mhi_c3d_parse("a.c3d", (const char *)data, size, &o.points, &o.analog, &o.err);
    return o;
}

static outcome read_made(const test_c3d *c3d) {
    size_t size = 0;
    uint8_t *data = test_c3d_make(c3d, &size);
    outcome o = parse(data, size);
    free(data);
    assert_string_equal(o.err.text, "");
    assert_int_equal(o.status, MHE_OK);
    return o;
}

static void release(outcome *o) {
    mhi_table_free(o->points);
    mhi_table_free(o->analog);
}

/* All numbers of the usual file are exact in every format. */
static void check_usual(const outcome *o, double metres, double offset) {
    const mhi_table *p = o->points, *a = o->analog;
    assert_int_equal(p->n_rows, 5);
    assert_int_equal(p->n_labels, 3);
    assert_int_equal(p->n_columns, 9);
    assert_string_equal(p->labels[0], "Anna:STER");
    assert_string_equal(p->labels[1], "C7");
    assert_string_equal(p->labels[2], "C7__3");
    assert_int_equal(mhi_table_find(p, "STER"), 0);
    assert_true(p->rate == 100 && p->unit == metres);
    assert_int_equal(a->n_rows, 20);
    assert_int_equal(a->n_labels, 2);
    assert_true(a->rate == 400);
    assert_string_equal(a->labels[1], "Fz");
    for (int k = 0; k < 5; k++) {
        assert_true(fabs(p->time[k] - (0.1 + 0.01 * k)) < 1e-12);
        for (int i = 0; i < 3; i++) {
            double want[3];
            place(k, i, want);
            for (int axis = 0; axis < 3; axis++) {
                const double is = p->values[9 * k + 3 * i + axis];
                assert_true(isnan(want[0]) ? isnan(is) : is == metres * want[axis]);
            }
        }
    }
    for (int k = 0; k < 20; k++) {
        assert_true(fabs(a->time[k] - (0.1 + 0.0025 * k)) < 1e-12);
        for (int c = 0; c < 2; c++) {
            const double want = (signal_at(k, c) - offset) * (0.5 * (c + 1)) * (double)0.001f;
            assert_true(a->values[2 * k + c] == want);
        }
    }
}

static void every_byte_order_and_format(void **state) {
    (void)state;
    static const struct {
        const char *unit;
        double metres;
    } units[] = {{"mm", 1e-3}, {"m", 1}, {"CM", 1e-2}};
    for (int32_t processor = 84; processor <= 86; processor++) {
        for (int32_t is_float = 0; is_float < 2; is_float++) {
            test_c3d c = usual();
            c.processor = processor;
            c.is_float = is_float;
            c.unit = units[processor - 84].unit;
            outcome o = read_made(&c);
            check_usual(&o, units[processor - 84].metres, 8);
            release(&o);
        }
    }
}

static double large_sample(int32_t row, int32_t channel) {
    return 65535 - 5000 * row - channel;
}

static void unsigned_samples(void **state) {
    (void)state;
    test_c3d c = usual();
    c.is_unsigned = 1;
    c.offset = 40000;
    c.sample = large_sample;
    c.per_frame = 1;
    outcome o = read_made(&c);
    for (int k = 0; k < 5; k++) {
        const double want = (large_sample(k, 1) - 40000) * 1 * (double)0.001f;
        assert_true(o.analog->values[2 * k + 1] == want);
    }
    release(&o);
}

static void more_than_255_labels(void **state) {
    (void)state;
    test_c3d c = usual();
    c.labels = NULL;
    c.channels = NULL;
    c.n_points = 600;
    c.n_channels = 2;
    outcome o = read_made(&c);
    assert_int_equal(o.points->n_labels, 600);
    for (int i = 0; i < 600; i++) {
        char name[16];
        (void)snprintf(name, sizeof name, "P%d", i + 1);
        assert_string_equal(o.points->labels[i], name);
    }
    assert_true(o.points->values[1800 + 3 * 599] == 0.001 * (100 + 599));
    release(&o);
}

static void one_place(int32_t frame, int32_t point, double xyz[3]) {
    xyz[0] = frame % 1000 + 1;
    xyz[1] = xyz[2] = point;
}

static void more_frames_than_the_header_can_say(void **state) {
    (void)state;
    test_c3d c = usual();
    c.n_points = 1;
    c.n_channels = 0;
    c.n_frames = 70000;
    c.first = 1;
    c.long_frames = 1;
    c.point = one_place;
    c.labels = NULL;
    outcome o = read_made(&c);
    assert_int_equal(o.points->n_rows, 70000);
    assert_null(o.analog);
    assert_true(o.points->values[3 * 69999] == 0.001 * (999 + 1));
    assert_true(fabs(o.points->time[69999] - 699.99) < 1e-9);
    release(&o);
}

static void what_is_not_said(void **state) {
    (void)state;
    test_c3d c = usual();
    const char *const few[] = {"A", "", "B"};
    c.unit = NULL;
    c.labels = few;
    c.n_channels = 0;
    outcome o = read_made(&c);
    assert_string_equal(o.points->labels[1], "point_2");
    assert_true(o.points->unit == 1e-3);
    assert_string_equal(o.points->unit_name, "mm");
    assert_int_equal(o.points->n_warnings, 1);
    assert_non_null(strstr(o.points->warnings[0], "a.c3d: POINT:UNITS is '', none of mm, cm, m"));
    release(&o);
}

static void equal_labels_are_told_apart(void **state) {
    (void)state;
    test_c3d c = usual();
    const char *const equal[] = {"A", "A", "A__2"};
    c.labels = equal;
    outcome o = read_made(&c);
    assert_string_equal(o.points->labels[0], "A");
    assert_string_equal(o.points->labels[1], "A__2");
    assert_string_equal(o.points->labels[2], "A__2__3");
    release(&o);
}

static void a_file_cut_short(void **state) {
    (void)state;
    const test_c3d c = usual();
    size_t size = 0;
    uint8_t *data = test_c3d_make(&c, &size);
    const size_t frame = 2 * (4 * 3 + 2 * 4), start = size - 512;
    outcome o = parse(data, start + 3 * frame + 1);
    assert_int_equal(o.status, MHE_OK);
    assert_int_equal(o.points->n_rows, 3);
    assert_non_null(strstr(o.points->warnings[0], "the file ends 2 frames too early; 3 are there"));
    release(&o);
    for (size_t n = 0; n < start + frame; n++) { /* never more than is there */
        uint8_t *part = malloc(n + 1);
        memcpy(part, data, n);
        o = parse(part, n);
        assert_int_equal(o.status, MHE_E_INPUT);
        assert_null(o.points);
        free(part);
    }
    free(data);
}

static void check_refused(size_t at, int value, const char *text) {
    const test_c3d c = usual();
    size_t size = 0;
    uint8_t *data = test_c3d_make(&c, &size);
    data[at] = (uint8_t)value;
    outcome o = parse(data, size);
    assert_int_equal(o.status, MHE_E_INPUT);
    if (strstr(o.err.text, text) == NULL || strchr(o.err.text, '\n') != NULL) {
        fail_msg("'%s' is not in: %s", text, o.err.text);
    }
    free(data);
}

/* Sets `n` bytes of a parameter's data. */
static void set_parameter(uint8_t *data, size_t size, const char *name, const void *bytes,
                          size_t n) {
    const size_t length = strlen(name);
    for (size_t i = 512; i + length + 5 + n < size; i++) {
        if (data[i - 2] == length && memcmp(data + i, name, length) == 0) {
            memcpy(data + i + length + 5, bytes, n); /* offset, type, one dimension */
            return;
        }
    }
    fail_msg("no parameter %s", name);
}

static void expect_warning(const mhi_table *t, const char *text) {
    for (int32_t i = 0; i < t->n_warnings; i++) {
        if (strstr(t->warnings[i], text) != NULL) {
            return;
        }
    }
    fail_msg("no warning with '%s'", text);
}

/* Header and parameters say much twice; whichever is sound counts. */
static void what_contradicts_is_settled(void **state) {
    (void)state;
    const float scale = 0.25F, floats = -0.25F;
    const uint8_t nothing[4] = {0}, beyond[2] = {255, 255};
    test_c3d c = usual();
    for (int is_float = 0; is_float < 2; is_float++) {
        size_t size = 0;
        c.is_float = is_float;
        uint8_t *data = test_c3d_make(&c, &size);
        set_parameter(data, size, "DATA_START", nothing, 2);
        outcome o = parse(data, size);
        assert_int_equal(o.status, MHE_OK);
        check_usual(&o, 1e-3, 8);
        release(&o);
        set_parameter(data, size, "DATA_START", beyond, 2);
        o = parse(data, size);
        assert_int_equal(o.status, MHE_OK);
        check_usual(&o, 1e-3, 8);
        expect_warning(o.points, "POINT:DATA_START contradicts the header");
        release(&o);
        free(data);
        /* the sign of the scale says whether the numbers are floats: the size knows */
        test_c3d longer = c;
        longer.n_frames = 60;
        data = test_c3d_make(&longer, &size);
        set_parameter(data, size, "SCALE", is_float ? &scale : &floats, 4);
        o = parse(data, size);
        assert_int_equal(o.status, MHE_OK);
        assert_int_equal(o.points->n_rows, 60);
        assert_true(fabs(o.points->values[9 * 59] - 5.9) < 1e-12 && o.points->values[1] < -0.25);
        expect_warning(o.points, is_float ? "floats of -0.25 taken" : "integers of 0.25 taken");
        release(&o);
        free(data);
    }
}

static void unit_words(void **state) {
    (void)state;
    static const struct {
        const char *word;
        double metres;
    } words[] = {{"Millimeters", 1e-3}, {"[m]", 1}, {"METERS", 1}, {"centimetre", 1e-2}};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        test_c3d c = usual();
        c.unit = words[i].word;
        outcome o = read_made(&c);
        check_usual(&o, words[i].metres, 8);
        assert_int_equal(o.points->n_warnings, 1); /* the label that is there twice */
        release(&o);
    }
}

/* EMG alone: no points, and neither their rate nor their scale. */
static void analog_without_points(void **state) {
    (void)state;
    const uint8_t nothing[4] = {0};
    for (int is_float = 0; is_float < 2; is_float++) {
        test_c3d c = usual();
        c.n_points = 0;
        c.is_float = is_float;
        size_t size = 0;
        uint8_t *data = test_c3d_make(&c, &size);
        outcome o = parse(data, size);
        assert_string_equal(o.err.text, "");
        assert_null(o.points);
        assert_int_equal(o.analog->n_rows, 20);
        assert_true(o.analog->values[0] == (signal_at(0, 0) - 8) * 0.5 * (double)0.001f);
        release(&o);
        set_parameter(data, size, "RATE", nothing, 4);
        memcpy(data + 20, nothing, 4);
        o = parse(data, size);
        assert_int_equal(o.status, MHE_E_INPUT); /* nothing says the rate */
        release(&o);
        free(data);
    }
}

static void latin_labels(void **state) {
    (void)state;
    static const char *const french[] = {"\xc9paule", "C7", "T8"};
    test_c3d c = usual();
    c.labels = french;
    outcome o = read_made(&c);
    assert_string_equal(o.points->labels[0], "\xc3\x89paule");
    release(&o);
}

static void wrong_files_are_refused(void **state) {
    (void)state;
    check_refused(1, 'P' + 1, "a.c3d: is no .c3d file");
    check_refused(0, 0, "a.c3d: is no .c3d file");
    check_refused(0, 200, "a.c3d: the parameters should begin at byte 101888");
    check_refused(512 + 3, 83, "a.c3d: the processor is 83; 84 (Intel)");
    check_refused(4, 7, "POINT:USED or ANALOG:USED contradicts the header");
    check_refused(8, 3, "a.c3d: holds no frame"); /* the last one before the first */
}

static void files_by_their_ending(void **state) {
    (void)state;
    char folder[256], path[300];
    mhi_table *table = NULL;
    mhe_error err = {0};
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(path, sizeof path, "%s/Walk.C3D", folder);
    test_c3d c = usual();
    assert_int_equal(test_c3d_write(&c, path), 0);
    assert_int_equal(mhi_markers_read(path, &table, &err), MHE_OK);
    assert_int_equal(table->n_labels, 3);
    mhi_table_free(table);
    assert_int_equal(mhi_signals_read(path, &table, &err), MHE_OK);
    assert_string_equal(table->labels[0], "EMG.Delt");
    mhi_table_free(table);
    c.n_channels = 0;
    assert_int_equal(test_c3d_write(&c, path), 0);
    assert_int_equal(mhi_signals_read(path, &table, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "Walk.C3D: holds no analog channels"));
    (void)unlink(path);
    assert_int_equal(mhi_markers_read(path, &table, &err), MHE_E_INPUT);
    (void)rmdir(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_byte_order_and_format),
        cmocka_unit_test(unsigned_samples),
        cmocka_unit_test(more_than_255_labels),
        cmocka_unit_test(more_frames_than_the_header_can_say),
        cmocka_unit_test(what_is_not_said),
        cmocka_unit_test(equal_labels_are_told_apart),
        cmocka_unit_test(a_file_cut_short),
        cmocka_unit_test(what_contradicts_is_settled),
        cmocka_unit_test(unit_words),
        cmocka_unit_test(analog_without_points),
        cmocka_unit_test(latin_labels),
        cmocka_unit_test(wrong_files_are_refused),
        cmocka_unit_test(files_by_their_ending),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
