/* SPDX-License-Identifier: Apache-2.0 */
/* .sto and .mot: every variation that is taken, every fault that is refused. */
#include "io/table.h"
#include "support.h"

#include <locale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define HEADER "name\nversion=1\nnRows=2\nnColumns=3\ninDegrees=no\nendheader\n"

#define assert_near(value, expected, tolerance) \
    assert_true(fabs((value) - (expected)) <= (tolerance))

static mhi_table *read_text(const char *text) {
    mhi_table *table = NULL;
    mhe_error err = {0};
    if (mhi_sto_parse("file.sto", text, strlen(text), &table, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return table;
}

/* The two rows (0; 1, 2) and (0.01; 3, 4) under a and b, without a warning unless said. */
static void expect_two_rows(const char *text, const char *warning) {
    mhi_table *t = read_text(text);
    assert_int_equal(t->n_rows, 2);
    assert_int_equal(t->n_columns, 2);
    assert_string_equal(t->labels[0], "a");
    assert_string_equal(t->labels[1], "b");
    const double expected[] = {1, 2, 3, 4};
    assert_memory_equal(t->values, expected, sizeof expected);
    assert_true(t->time[0] == 0 && t->time[1] == 0.01);
    assert_near(t->rate, 100, 1e-9);
    if (warning == NULL) {
        assert_int_equal(t->n_warnings, 0);
    } else {
        assert_true(t->n_warnings > 0);
        assert_non_null(strstr(t->warnings[0], warning));
    }
    mhi_table_free(t);
}

static void refuse(const char *text, const char *message) {
    mhi_table *table = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_sto_parse("file.sto", text, strlen(text), &table, &err), MHE_E_INPUT);
    assert_null(table);
    if (strstr(err.text, message) == NULL) {
        fail_msg("'%s' should hold '%s'", err.text, message);
    }
}

static void accepted_variations(void **state) {
    (void)state;
    expect_two_rows(HEADER "time\ta\tb\n0\t1\t2\n0.01\t3\t4\n", NULL);
    /* CRLF; no line end at the end; tabs at line ends; blanks round cells; old Mac line ends */
    expect_two_rows("name\r\nnRows=2\r\nendheader\r\ntime\ta\tb\r\n0\t1\t2\r\n0.01\t3\t4", NULL);
    expect_two_rows("nRows=2\t\nendheader\t \ntime\ta\tb\t\n0\t1\t2\t\n0.01\t3\t4\t\t\n", NULL);
    expect_two_rows("endheader\ntime\t a \tb\n 0 \t  1\t2\n0.01\t3e0\t+4.000\n", NULL);
    expect_two_rows("name\rendheader\rtime\ta\tb\r0\t1\t2\r0.01\t3\t4\r", NULL);
    /* byte order mark; version 3; DataType double; blanks round '='; blank lines before labels */
    expect_two_rows("\xef\xbb\xbf" HEADER "time\ta\tb\n0\t1\t2\n0.01\t3\t4\n", NULL);
    expect_two_rows("DataType=double\nversion=3\nOpenSimVersion=4.5\n nRows = 2\nendheader\n\n\n"
                    "time\ta\tb\n0\t1\t2\n0.01\t3\t4\n",
                    NULL);
    /* SIMM: datacolumns, datarows, range, Time, blanks */
    expect_two_rows("name walk\ndatacolumns 3\ndatarows 2\nrange 0.0 0.01\nendheader\n\n"
                    "Time a   b\n 0.0   1   2 \n 0.01\t3   4\n",
                    NULL);
    /* commas; a CSV without any header */
    expect_two_rows("anything\nendheader\ntime,a,b\n0,1,2\n0.01, 3, 4\n", NULL);
    expect_two_rows("time,a,b\n0,1,2\n0.01,3,4\n", "no header with 'endheader'");
    /* a decimal comma where cells are parted by tabs */
    expect_two_rows("endheader\ntime\ta\tb\n0\t1,0\t2\n0,01\t3\t4,0\n", "with a comma ('1,0')");
    /* labels by tabs, rows by blanks; a title that looks like labels */
    expect_two_rows("endheader\ntime\ta\tb\n0 1 2\n0.01 3 4\n", NULL);
    expect_two_rows("time, a title\n1 2 3 go\nendheader\ntime\ta\tb\n0\t1\t2\n0.01\t3\t4\n", NULL);
}

static void repaired_with_a_warning(void **state) {
    (void)state;
    expect_two_rows("nRows=99\nendheader\ntime\ta\tb\n0\t1\t2\n0.01\t3\t4\n", "says 99 rows");
    expect_two_rows("nColumns=9\nendheader\ntime\ta\tb\n0\t1\t2\n0.01\t3\t4\n", "says 9 columns");
    expect_two_rows("nRows=many\nendheader\ntime\ta\tb\n0\t1\t2\n0.01\t3\t4\n",
                    "file.sto:1: 'many' is no count");
    expect_two_rows("endheader\ntime\ta\tb\n0\t1\t2\n0.01\t3\t4\n\n0.02\t5\t6\nx\n",
                    "file.sto:5: this blank line ends the data; 2 later lines");
}

/* What exports of several programs do to a table that is else sound. */
static void mended_with_a_warning(void **state) {
    (void)state;
    expect_two_rows("endheader\ntime\ta\tb\n0\t1\t2\t9\t9\n0.01\t3\t4\n",
                    "file.sto:3: this row has 5 cells; 2 labels need 3: what is beyond");
    expect_two_rows("endheader\ntime\ta\tb\n0\t1\t2\n0.01\t3\t4\n0.02\t5",
                    "file.sto:5: the file ends within this row");
    expect_two_rows("endheader\ntime\ta\tb\n0\t1\t2\n0.01\t3\t4\n0.01\t5\t6\n",
                    "file.sto:5: 1 row has the time of the one before it");
    expect_two_rows("endheader\ntime\ta\tb\n0\t1\t2\n0.01\t3\t4\n\t\t\n", NULL);
    expect_two_rows("endheader\nTime (s)\ta\tb\n0\t1\t2\n0.01\t3\t4\n", NULL);
    mhi_table *t = read_text("endheader\ntime\ta\tb\n0\t1\n0.01\t3\t4\n");
    assert_true(isnan(t->values[1]) && t->values[2] == 3);
    assert_non_null(strstr(t->warnings[0], "file.sto:3: this row has 2 cells"));
    mhi_table_free(t);
    t = read_text("endheader\ntime\ta\ta\t\tb\n0\t1\t2\t3\t4\n");
    assert_string_equal(t->labels[0], "a");
    assert_string_equal(t->labels[1], "a__2");
    assert_string_equal(t->labels[2], "column_4");
    assert_int_equal(t->n_warnings, 2);
    mhi_table_free(t);
    t = read_text("endheader\ntime\t\xc9paule\n0\t1\n"); /* Latin-1 */
    assert_string_equal(t->labels[0], "\xc3\x89paule");
    assert_non_null(strstr(t->warnings[0], "file.sto:2: bytes that are no UTF-8 (1)"));
    mhi_table_free(t);
}

/* 240 Hz with two decimals, and with three, and a real pause that looks like neither. */
static void times_with_few_digits_become_even(void **state) {
    (void)state;
    for (int digits = 2; digits < 4; digits++) {
        char text[4096] = "endheader\ntime\ta\n";
        for (int k = 0; k < 60; k++) {
            (void)snprintf(text + strlen(text), 32, "%.*f\t%d\n", digits, k / 240.0, k);
        }
        mhi_table *t = read_text(text);
        assert_int_equal(t->n_rows, 60);
        assert_near(t->rate, 240, 5);
        for (int k = 1; k < 60; k++) {
            assert_near(t->time[k] - t->time[k - 1], 1 / t->rate, 1e-12);
        }
        assert_non_null(strstr(t->warnings[0], "they are taken as even at"));
        mhi_table_free(t);
    }
    mhi_table *t = read_text("endheader\ntime\ta\n0.00\t1\n0.01\t1\n0.02\t1\n0.04\t1\n0.05\t1\n");
    assert_true(t->time[3] == 0.04 && t->n_warnings == 0);
    mhi_table_free(t);
}

static void a_simm_motion_is_in_degrees(void **state) {
    (void)state;
    static const struct {
        const char *name, *text;
        int32_t degrees;
    } cases[] = {{"a.mot", "walk\ndatacolumns 2\ndatarows 1\nendheader\ntime a\n0 1\n", 1},
                 {"a.mot", "walk\nversion=1\nendheader\ntime\ta\n0\t1\n", 0},
                 {"a.mot", "walk\ninDegrees=no\nendheader\ntime\ta\n0\t1\n", 0},
                 {"a.sto", "walk\ndatacolumns 2\nendheader\ntime a\n0 1\n", 0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        mhi_table *t = NULL;
        assert_int_equal(
            mhi_sto_parse(cases[i].name, cases[i].text, strlen(cases[i].text), &t, NULL), MHE_OK);
        assert_int_equal(t->in_degrees, cases[i].degrees);
        assert_int_equal(t->n_warnings, cases[i].degrees);
        mhi_table_free(t);
    }
}

static void warnings_of_a_kind_are_counted(void **state) {
    (void)state;
    char text[65536] = "endheader\ntime\ta\n";
    for (int k = 0; k < 1000; k++) {
        (void)snprintf(text + strlen(text), 32, "%d\t1\t2\n", k);
    }
    mhi_table *t = read_text(text);
    assert_int_equal(t->n_warnings, 4);
    assert_non_null(strstr(t->warnings[3], "and 996 more of this kind, the last in line 1002"));
    mhi_table_free(t);
}

static void header_values(void **state) {
    (void)state;
    mhi_table *t = read_text("inDegrees=YES\nendheader\ntime\tb c\n-2e-7\t1\n0.017\t2\n0.033\t3\n");
    assert_int_equal(t->in_degrees, 1);
    assert_string_equal(t->labels[0], "b c");
    assert_true(t->unit == 1);
    /* rounded times: the mean step tells the rate better than any single one */
    assert_near(t->rate, 2 / (0.033 + 2e-7), 1e-9);
    mhi_table_free(t);
    t = read_text("endheader\ntime\ta\n0\t1\n0.01\t2\n0.02\t2\n0.5\t3\n0.51\t3\n0.52\t3\n");
    assert_near(t->rate, 100, 1e-6); /* a gap in time: the median step */
    mhi_table_free(t);
    t = read_text("endheader\ntime\ta\n0\t1\n");
    assert_true(t->rate == 0);
    mhi_table_free(t);
}

static void missing_values(void **state) {
    (void)state;
    mhi_table *t = read_text("endheader\ntime\ta\tb\tc\td\te\tf\n"
                             "0\tnan\tNaN\t -NAN \tnan(ind)\t-1.#IND00\t\n1\t1\t\t1\t1\t1\t1\n");
    for (int i = 0; i < 6; i++) {
        assert_true(isnan(t->values[i]));
    }
    assert_true(isnan(t->values[7]) && t->values[6] == 1);
    assert_int_equal(t->n_warnings, 1);
    assert_non_null(strstr(t->warnings[0], "2 empty cells"));
    mhi_table_free(t);
}

static void refused(void **state) {
    (void)state;
    refuse("", "file ends before the labels");
    refuse("some text\nmore\n", "no line 'endheader'");
    refuse("name\n0\t1\t2\nendheader\ntime\ta\tb\n", "file.sto:2: numbers before the end");
    refuse("endheader\n\n\n", "file ends before the labels");
    refuse("endheader\ntime\ta\n", "without a row");
    refuse("endheader\ntime\ta\n\n0\t1\n", "without a row");
    refuse("endheader\ntime\n0\n", "labels must be 'time'");
    refuse("endheader\nt\ta\n0\t1\n", "found 't'");
    refuse("endheader\ntime\ta\tb\n0 1\n1 2\n",
           "file.sto:3: this row has 2 columns; 2 labels need 3");
    refuse("endheader\ntime\ta\n0\t1\n0\t1\n", "file.sto:4: the time does not increase: 1 of 2");
    refuse("endheader\ntime\ta\n1\t1\n0.5\t1\n", "it must increase");
    refuse("endheader\ntime\ta\nnan\t1\n", "time 'nan' is not a finite number");
    refuse("endheader\ntime\ta\n\t1\n", "time '' is not a finite number");
    refuse("endheader\ntime\ta\n0\tabc\n", "column 'a': 'abc' is not a finite number");
    refuse("endheader\ntime\ta\n0\t1,5,2\n", "a point, no comma");
    refuse("endheader\ntime\ta\n0\t1.5.2\n", "'1.5.2' is not");
    refuse("endheader\ntime\ta\n0\tinf\n", "'inf' is not");
    refuse("endheader\ntime\ta\n0\t1e999\n", "'1e999' is not");
    refuse("endheader\ntime\ta\n0\t0x10\n", "'0x10' is not");
    refuse("endheader\ntime\ta\n0\tnancy\n", "'nancy' is not");
    refuse("endheader\ntime\ta\n0\t\x01x\n", "'.x' is not");
    refuse("DataType=Vec3\nendheader\ntime\ta\n0\t1,2,3\n", "DataType=Vec3");
    refuse("inDegrees=perhaps\nendheader\ntime\ta\n0\t1\n", "yes or no");
}

static void hostile_files(void **state) {
    (void)state;
    mhi_table *table = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_sto_parse("b", "endheader\0x", 11, &table, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "binary data"));
    assert_int_equal(mhi_sto_parse("b", NULL, 0, &table, &err), MHE_E_INPUT);
    /* the header's counts do not decide what is allocated */
    mhi_table *t = read_text("nRows=999999999\nnColumns=999999999\nendheader\ntime\ta\n0\t1\n");
    assert_int_equal(t->n_rows, 1);
    mhi_table_free(t);
    /* a cell of a megabyte in a message that stays a line */
    size_t n = 1 << 20;
    char *text = malloc(n + 64);
    assert_non_null(text);
    int head = snprintf(text, 64, "endheader\ntime\ta\n0\t");
    memset(text + head, 'x', n);
    assert_int_equal(mhi_sto_parse("b", text, (size_t)head + n, &table, &err), MHE_E_INPUT);
    assert_true(strlen(err.text) < 200);
    free(text);
    /* 100000 labels: finding a double one must not take for ever */
    char *labels = malloc(1 << 20);
    assert_non_null(labels);
    int used = sprintf(labels, "endheader\ntime");
    for (int i = 0; i < 100000; i++) {
        used += sprintf(labels + used, "\tc%d", i);
    }
    used += sprintf(labels + used, "\tc0\n0\t1\n");
    assert_int_equal(mhi_sto_parse("b", labels, (size_t)used, &t, &err), MHE_OK);
    assert_string_equal(t->labels[100000], "c0__100001");
    mhi_table_free(t);
    free(labels);
}

static void unreadable_files(void **state) {
    (void)state;
    mhi_table *table = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_sto_read("/nowhere/x.sto", &table, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "/nowhere/x.sto: cannot be opened: No such file"));
    const char *there = MHE_TEST_BINARY_DIR "/tests/sto_recording.sto";
    FILE *stream = fopen(there, "wb");
    assert_non_null(stream);
    (void)fclose(stream);
    assert_int_equal(mhi_sto_read(MHE_TEST_BINARY_DIR "/tests/sto_recordnig.sto", &table, &err),
                     MHE_E_INPUT);
    (void)remove(there);
    assert_non_null(strstr(err.text, "No such file or directory (did you mean "
                                     "'sto_recording.sto'?)"));
    assert_int_equal(mhi_sto_read("/", &table, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "is a folder"));
    assert_null(table);
}

/* A locale with a decimal comma must not change what is read. Passed over where none is there. */
static void locale_does_not_matter(void **state) {
    (void)state;
    static const char *const comma[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "fr_CA.utf8"};
    const char *found = NULL;
    for (size_t i = 0; i < 4 && found == NULL; i++) {
        found = setlocale(LC_ALL, comma[i]);
    }
    if (found == NULL) {
        skip();
    }
    mhi_table *t = read_text("endheader\ntime\ta\n0.5\t1.25\n");
    assert_true(t->time[0] == 0.5 && t->values[0] == 1.25);
    mhi_table_free(t);
    char text[16];
    (void)snprintf(text, sizeof text, "%.1f", 0.5);
    assert_string_equal(text, "0,5"); /* the caller's locale is back */
    (void)setlocale(LC_ALL, "C");
}

static void reference_files(void **state) {
    (void)state;
    char path[512];
    mhe_error err = {0};
    mhi_table *t = NULL;
    if (test_data_path(path, sizeof path, "arm19/seed_reference_states.sto") == NULL) {
        skip();
    }
    if (mhi_sto_read(path, &t, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal(t->n_rows, 801);
    assert_int_equal(t->n_columns, 46);
    assert_int_equal(t->n_warnings, 0);
    assert_near(t->rate, 100, 1e-9);
    assert_true(t->values[0] == -0.0930150865);
    assert_string_equal(t->labels[45], "e.BicepsShort");
    mhi_table_free(t);
    assert_non_null(test_data_path(path, sizeof path, "abduction/abd_emg_raw.sto"));
    assert_int_equal(mhi_sto_read(path, &t, &err), MHE_OK);
    assert_int_equal(t->n_rows, 14000);
    assert_near(t->rate, 2000, 1e-6);
    mhi_table_free(t);
}

/* Its text is given back in parcels of 8 MB while it is read. */
static void large_file_is_as_from_memory(void **state) {
    (void)state;
    const int32_t rows = 400000;
    char folder[256], path[300], line[96];
    const size_t room = (size_t)rows * 80;
    char *text = malloc(room);
    assert_non_null(text);
    assert_non_null(test_folder(folder, sizeof folder));
    (void)snprintf(path, sizeof path, "%s/large.sto", folder);
    size_t n = (size_t)snprintf(text, room, "endheader\ntime\ta\tb\n");
    for (int32_t k = 0; k < rows; k++) {
        const int length = snprintf(line, sizeof line, "%.4f\t%.17g\t%.17g\n", k / 2000.0,
                                    sin(0.1 * k), cos(0.3 * k));
        memcpy(text + n, line, (size_t)length);
        n += (size_t)length;
    }
    assert_true(n > 2 * (8u << 20));
    FILE *out = fopen(path, "w");
    assert_true(out != NULL && fwrite(text, 1, n, out) == n && fclose(out) == 0);
    mhi_table *lent = NULL, *read = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_sto_parse(path, text, n, &lent, &err), MHE_OK);
    assert_int_equal(mhi_sto_read(path, &read, &err), MHE_OK);
    assert_int_equal(read->n_rows, rows);
    assert_memory_equal(read->time, lent->time, sizeof(double) * (size_t)rows);
    assert_memory_equal(read->values, lent->values, sizeof(double) * 2 * (size_t)rows);
    mhi_table_free(lent);
    mhi_table_free(read);
    (void)unlink(path);
    free(text);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(accepted_variations),
                                       cmocka_unit_test(repaired_with_a_warning),
                                       cmocka_unit_test(mended_with_a_warning),
                                       cmocka_unit_test(times_with_few_digits_become_even),
                                       cmocka_unit_test(a_simm_motion_is_in_degrees),
                                       cmocka_unit_test(warnings_of_a_kind_are_counted),
                                       cmocka_unit_test(header_values),
                                       cmocka_unit_test(missing_values),
                                       cmocka_unit_test(refused),
                                       cmocka_unit_test(hostile_files),
                                       cmocka_unit_test(unreadable_files),
                                       cmocka_unit_test(locale_does_not_matter),
                                       cmocka_unit_test(large_file_is_as_from_memory),
                                       cmocka_unit_test(reference_files)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
