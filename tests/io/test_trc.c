/* SPDX-License-Identifier: Apache-2.0 */
/* .trc: every variation that is taken, every fault that is refused. */
#include "io/table.h"
#include "support.h"

#include <math.h>
#include <string.h>

#define FIRST "PathFileType\t4\t(X/Y/Z)\tC:/my data/a b.trc\n"
#define KEYS                                                                                 \
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\t" \
    "OrigNumFrames\n"
#define VALUES "100\t100\t2\t2\tmm\t100\t1\t2\n"
#define LABELS "Frame#\tTime\tA\t\t\tB b\t\t\n"
#define XYZ "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n"
#define ROWS "1\t0.00\t1\t2\t3\t4\t5\t6\n2\t0.01\t7\t8\t9\t10\t11\t12\n"

#define assert_near(value, expected, tolerance) \
    assert_true(fabs((value) - (expected)) <= (tolerance))

static mhi_table *read_text(const char *text) {
    mhi_table *table = NULL;
    mhe_error err = {0};
    if (mhi_trc_parse("file.trc", text, strlen(text), &table, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return table;
}

/* Markers A and "B b", 2 frames, values 1 ... 12 of the file's unit. */
static void expect_two_frames(const char *text, double unit, const char *warning) {
    mhi_table *t = read_text(text);
    assert_int_equal(t->n_rows, 2);
    assert_int_equal(t->n_columns, 6);
    assert_int_equal(t->n_labels, 2);
    assert_string_equal(t->labels[0], "A");
    for (int i = 0; i < 12; i++) {
        assert_near(t->values[i], unit * (i + 1), 1e-15);
    }
    assert_true(t->time[0] == 0 && t->time[1] == 0.01);
    assert_true(t->rate == 100 && t->unit == unit);
    if (warning == NULL) {
        assert_int_equal(t->n_warnings, 0);
    } else {
        assert_int_equal(t->n_warnings, 1);
        assert_non_null(strstr(t->warnings[0], warning));
    }
    mhi_table_free(t);
}

static void refuse(const char *text, const char *message) {
    mhi_table *table = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_trc_parse("file.trc", text, strlen(text), &table, &err), MHE_E_INPUT);
    assert_null(table);
    if (strstr(err.text, message) == NULL) {
        fail_msg("'%s' should hold '%s'", err.text, message);
    }
}

static void accepted_variations(void **state) {
    (void)state;
    expect_two_frames(FIRST KEYS VALUES LABELS XYZ "\n" ROWS, 1e-3, NULL);
    expect_two_frames(FIRST KEYS VALUES LABELS XYZ ROWS, 1e-3, NULL); /* no blank line */
    expect_two_frames(FIRST KEYS VALUES LABELS XYZ "\n \t\n" ROWS "\n", 1e-3, NULL);
    expect_two_frames(FIRST KEYS VALUES LABELS ROWS, 1e-3, NULL); /* no X1 Y1 Z1 */
    expect_two_frames(FIRST KEYS VALUES "Frame#\tTimes\tA\tB b\n" XYZ ROWS, 1e-3, NULL);
    /* tabs at line ends, double tabs, exponents */
    expect_two_frames("PathFileType 4 (X/Y/Z) a.trc\t\n" KEYS VALUES LABELS XYZ
                      "1\t0.0\t1\t2\t3\t4\t5\t6\t\n2\t1e-2\t7\t8E0\t0.9e+1\t10\t11\t12\t \t\n",
                      1e-3, NULL);
    expect_two_frames(FIRST KEYS "100\t\t100\t2\t2\t\tmm\t100\t1\t2\n"
                                 "Frame#\t\tTime\t\tA\t\t\t\tB b\n" XYZ
                                 "1\t\t0.00\t\t1\t\t2\t\t3\t\t4\t\t5\t\t6\n"
                                 "2\t\t0.01\t\t7\t\t8\t\t9\t\t10\t\t11\t\t12\n",
                      1e-3, NULL);
    /* blanks alone; other order of the keys; unknown keys; units */
    expect_two_frames("PathFileType 4 (X/Y/Z) a.trc\nUnits Foo DataRate\nm bar 100\n"
                      "Frame# Time A B\nX1 Y1 Z1 X2 Y2 Z2\n1 0 1 2 3 4 5 6\n2 0.01 7 8 9 10 11 12",
                      1, NULL);
    expect_two_frames(FIRST "DataRate\tUnits\n100\tcm\n" LABELS XYZ ROWS, 1e-2, NULL);
    expect_two_frames(FIRST "DataRate\tUnits\n100\tMillimetres\n" LABELS XYZ ROWS, 1e-3, NULL);
    expect_two_frames(FIRST "Units\nM\n" LABELS XYZ ROWS, 1, NULL);
    /* CRLF */
    expect_two_frames("PathFileType\t4\r\nDataRate\tUnits\r\n100\tmm\r\nFrame#\tTime\tA\tB b\r\n"
                      "\t\tX1\r\n\r\n1\t0.00\t1\t2\t3\t4\t5\t6\r\n2\t0.01\t7\t8\t9\t10\t11\t12\r\n",
                      1e-3, NULL);
}

static void repaired_with_a_warning(void **state) {
    (void)state;
    expect_two_frames(FIRST KEYS "100\t100\t7\t2\tmm\t100\t1\t2\n" LABELS XYZ ROWS, 1e-3,
                      "says 7 frames");
    expect_two_frames(FIRST KEYS "100\t100\t2\t9\tmm\t100\t1\t2\n" LABELS XYZ ROWS, 1e-3,
                      "says 9 markers");
    expect_two_frames(FIRST KEYS "60\t60\t2\t2\tmm\t100\t1\t2\n" LABELS XYZ ROWS, 1e-3,
                      "says 60 Hz");
    expect_two_frames(FIRST KEYS VALUES LABELS XYZ ROWS "\nmore\n", 1e-3, "ends the data");
}

static void mended_with_a_warning(void **state) {
    (void)state;
    expect_two_frames(FIRST "DataRate\n100\n" LABELS XYZ ROWS, 1e-3, "mm is taken");
    expect_two_frames(FIRST "DataRate\tUnits\n100\tparsec\n" LABELS XYZ ROWS, 1e-3, "'parsec'");
    expect_two_frames(FIRST "Units\n[mm]\n" LABELS XYZ ROWS, 1e-3, NULL);
    expect_two_frames(FIRST "Units\nInches\n" LABELS XYZ ROWS, 0.0254, NULL);
    expect_two_frames(FIRST KEYS VALUES LABELS XYZ "1\t0\t1\t2\t3\t4\t5\t6\t7\t8\t9\n"
                                                   "2\t0.01\t7\t8\t9\t10\t11\t12\n",
                      1e-3, "file.trc:6: this row has 11 cells");
    mhi_table *t = read_text(FIRST KEYS "100\t100\t3\t2\tmm\t100\t1\t3\n" LABELS XYZ
                                        "1\t0\t1\t2\t3\n2\t0.01\t1\t2\t3\t0\t0\t0\n"
                                        "3\t0.02\t1\t2\t3\t4\t5\t6\n");
    assert_true(isnan(t->values[3]) && isnan(t->values[9]) && t->values[12] == 1e-3);
    assert_int_equal(t->n_warnings, 2);
    assert_non_null(strstr(t->warnings[0], "has 5 cells"));
    assert_non_null(strstr(t->warnings[1], "file.trc:6: 1 samples of a marker at exactly 0 0 0"));
    mhi_table_free(t);
    t = read_text(FIRST "Units\nm\nFrame#\tTime\tA\tA\n" XYZ "1\t0\t1\t2\t3\t4\t5\t6\n");
    assert_string_equal(t->labels[1], "A__2");
    mhi_table_free(t);
}

/* The header's rate and the frames' numbers know better than a time of two decimals. */
static void frames_tell_the_time(void **state) {
    (void)state;
    char text[8192] = FIRST KEYS "240\t240\t60\t1\tmm\t240\t1\t60\nFrame#\tTime\tA\n" XYZ;
    for (int k = 0; k < 60; k++) {
        const int frame = k < 30 ? k + 1 : k + 41; /* 40 frames are missing */
        (void)snprintf(text + strlen(text), 64, "%d\t%.2f\t1\t2\t3\n", frame, (frame - 1) / 240.0);
    }
    mhi_table *t = read_text(text);
    assert_int_equal(t->n_rows, 60);
    assert_near(t->time[29], 29 / 240.0, 1e-9);
    assert_near(t->time[30], 70 / 240.0, 1e-9);
    assert_true(t->rate == 240);
    mhi_table_free(t);
}

static void missing_markers(void **state) {
    (void)state;
    mhi_table *t = read_text(FIRST KEYS VALUES LABELS XYZ "\n1\t0\t\t\t\t4\t5\t6\t\n"
                                                          "2\t0.01\tNaN\tnan \t NAN\t4\t\t6\n"
                                                          "3\t0.02\t1\t2\t3\t\t\t\n");
    int missing[] = {1, 1, 1, 0, 0, 0, 1, 1, 1, 1, 1, 1, 0, 0, 0, 1, 1, 1};
    for (int i = 0; i < 18; i++) {
        assert_int_equal(isnan(t->values[i]) != 0, missing[i]);
    }
    mhi_table_free(t);
}

static void subject_stays_in_the_name(void **state) {
    (void)state;
    mhi_table *t = read_text(FIRST "Units\nm\nFrame#\tTime\tAnna:STER\n" XYZ "1\t0\t1\t2\t3\n");
    assert_string_equal(t->labels[0], "Anna:STER");
    assert_int_equal(mhi_table_find(t, "STER"), 0);
    assert_true(t->rate == 0);
    mhi_table_free(t);
}

static void refused(void **state) {
    (void)state;
    refuse("", "file ends before its first line");
    refuse("name\n", "must begin with 'PathFileType'");
    refuse(FIRST, "ends before the header's keys");
    refuse(FIRST KEYS, "ends before the header's values");
    refuse(FIRST KEYS VALUES, "ends before the marker names");
    refuse(FIRST KEYS VALUES "Time\tA\n" XYZ ROWS, "line 4 must hold 'Frame#'");
    refuse(FIRST KEYS VALUES "Frame#\tTime\n" XYZ ROWS, "no label stands beside the time");
    refuse(FIRST KEYS VALUES LABELS XYZ, "without a row");
    refuse(FIRST KEYS VALUES LABELS XYZ "1 0 1 2 3 4 5\n",
           "file.trc:6: this row has 7 columns; 2 labels need 8");
    refuse(FIRST KEYS VALUES LABELS XYZ ROWS "3\t0.005\t1\t2\t3\t4\t5\t6\n", "must increase");
    refuse(FIRST KEYS VALUES LABELS XYZ "1\tNaN\t1\t2\t3\t4\t5\t6\n", "time 'NaN'");
    refuse(FIRST KEYS VALUES LABELS XYZ "1\t0\t1\t2\t3\t4\tx\t6\n", "column 'B b': 'x'");
}

static void reference_file(void **state) {
    (void)state;
    char path[512];
    mhe_error err = {0};
    mhi_table *t = NULL;
    if (test_data_path(path, sizeof path, "abduction/abd_markers.trc") == NULL) {
        skip();
    }
    if (mhi_trc_read(path, &t, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal(t->n_rows, 700);
    assert_int_equal(t->n_labels, 16);
    assert_int_equal(t->n_warnings, 0);
    assert_string_equal(t->labels[15], "STYLr");
    assert_near(t->values[0], 0.5322829, 1e-15);
    mhi_table_free(t);
}

static void times_in_ms(void **state) {
    (void)state;
    mhi_table *t = read_text(FIRST KEYS VALUES LABELS XYZ "1\t0\t1\t2\t3\t4\t5\t6\n"
                                                          "2\t10\t7\t8\t9\t10\t11\t12\n");
    assert_near(t->time[1], 0.01, 1e-15);
    assert_near(t->rate, 100, 0);
    assert_int_equal(t->n_warnings, 1);
    assert_non_null(strstr(t->warnings[0], "they are taken as ms"));
    mhi_table_free(t);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(accepted_variations),
                                       cmocka_unit_test(repaired_with_a_warning),
                                       cmocka_unit_test(mended_with_a_warning),
                                       cmocka_unit_test(frames_tell_the_time),
                                       cmocka_unit_test(missing_markers),
                                       cmocka_unit_test(times_in_ms),
                                       cmocka_unit_test(subject_stays_in_the_name),
                                       cmocka_unit_test(refused),
                                       cmocka_unit_test(reference_file)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
