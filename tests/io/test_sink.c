/* SPDX-License-Identifier: Apache-2.0 */
/* Result files: what is written reads back; nothing appears half-written. */
#include "io/slurp.h"
#include "io/table.h"
#include "support.h"
#include <mhe/outbox.h>

#include <dirent.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

static char folder[256];

static const char *path_of(const char *name) {
    static char path[512];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static int32_t count_files(void) {
    int32_t n = 0;
    DIR *dir = opendir(folder);
    assert_non_null(dir);
    for (const struct dirent *entry; (entry = readdir(dir)) != NULL;) {
        n += strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0;
    }
    (void)closedir(dir);
    return n;
}

static int make_folder(void **state) {
    (void)state;
    return test_folder(folder, sizeof folder) == NULL;
}

static int empty_folder(void **state) {
    (void)state;
    DIR *dir = opendir(folder);
    if (dir == NULL) {
        return 1;
    }
    for (const struct dirent *entry; (entry = readdir(dir)) != NULL;) {
        if (strcmp(entry->d_name, ".") != 0 && strcmp(entry->d_name, "..") != 0) {
            (void)remove(path_of(entry->d_name));
        }
    }
    (void)closedir(dir);
    return 0;
}

static int remove_folder(void **state) {
    return empty_folder(state) != 0 || rmdir(folder) != 0;
}

static void expect_text(const char *name, const char *expected) {
    char *text = NULL;
    size_t length = 0;
    assert_int_equal(mhi_slurp(path_of(name), &text, &length, NULL), MHE_OK);
    assert_string_equal(text, expected);
    free(text);
}

static void sto_reads_back(void **state) {
    (void)state;
    const char *labels[] = {"q.elbow", "F.BRA"};
    mhe_outbox *outbox = NULL;
    mhe_sink *sink = NULL;
    mhe_error err = {0};
    assert_int_equal(mhe_outbox_open(folder, &outbox, &err), MHE_OK);
    assert_int_equal(mhe_sink_sto(outbox, "x.sto", "estimates", labels, 2, &sink, &err), MHE_OK);
    for (int i = 0; i < 1234; i++) {
        double row[] = {0.1 * i, i % 7 == 3 ? NAN : 1e-7 / (i + 1)};
        assert_int_equal(mhe_sink_row(sink, 0.01 * i, row, &err), MHE_OK);
    }
    assert_int_equal(mhe_outbox_commit(outbox, &err), MHE_OK);
    mhe_outbox_close(outbox);
    mhi_table *t = NULL;
    if (mhi_sto_read(path_of("x.sto"), &t, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal(t->n_rows, 1234);
    assert_int_equal(t->n_warnings, 0); /* the header's counts are right */
    assert_string_equal(t->labels[1], "F.BRA");
    for (int i = 0; i < 1234; i++) {
        assert_true(fabs(t->time[i] - 0.01 * i) < 1e-9);
        assert_true(fabs(t->values[2 * i] - 0.1 * i) <= 1e-11 * i);
        double expected = i % 7 == 3 ? NAN : 1e-7 / (i + 1);
        assert_true(isnan(expected) ? isnan(t->values[2 * i + 1]) != 0
                                    : fabs(t->values[2 * i + 1] / expected - 1) < 1e-11);
    }
    mhi_table_free(t);
    assert_int_equal(count_files(), 1);
}

static void trc_reads_back(void **state) {
    (void)state;
    const char *markers[] = {"A", "B b"};
    mhe_outbox *outbox = NULL;
    mhe_sink *sink = NULL;
    mhe_error err = {0};
    assert_int_equal(mhe_outbox_open(folder, &outbox, &err), MHE_OK);
    assert_int_equal(mhe_sink_trc(outbox, "m.trc", markers, 2, 100, 1e-3, "mm", &sink, &err),
                     MHE_OK);
    const double rows[] = {0.001, 0.002, 0.003, NAN, NAN, NAN, 1, -2, 3e-9, 4, 5, 6};
    assert_int_equal(mhe_sink_row(sink, 0, rows, &err), MHE_OK);
    assert_int_equal(mhe_sink_row(sink, 0.01, rows + 6, &err), MHE_OK);
    assert_int_equal(mhe_outbox_commit(outbox, &err), MHE_OK);
    mhe_outbox_close(outbox);
    char expected[512];
    (void)snprintf(expected, sizeof expected,
                   "PathFileType\t4\t(X/Y/Z)\tm.trc%18s\nDataRate\tCameraRate\tNumFrames\t"
                   "NumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
                   "100\t100\t2\t2\tmm\t100\t1\t2\nFrame#\tTime\tA\t\t\tB b\n"
                   "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n1\t0\t1\t2\t3\t\t\t\n"
                   "2\t0.01\t1000\t-2000\t3e-06\t4000\t5000\t6000\n",
                   "");
    expect_text("m.trc", expected);
    mhi_table *t = NULL;
    if (mhi_trc_read(path_of("m.trc"), &t, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    assert_int_equal(t->n_warnings, 0);
    for (int i = 0; i < 12; i++) {
        assert_true(isnan(rows[i]) ? isnan(t->values[i]) != 0
                                   : fabs(t->values[i] - rows[i]) <= 1e-11 * fabs(rows[i]));
    }
    mhi_table_free(t);
}

static void nothing_without_commit(void **state) {
    (void)state;
    const char *labels[] = {"a"};
    double value = 1;
    mhe_outbox *outbox = NULL;
    mhe_sink *sink = NULL;
    FILE *old = fopen(path_of("x.sto"), "w");
    assert_non_null(old);
    assert_true(fputs("old", old) >= 0 && fclose(old) == 0);
    assert_int_equal(mhe_outbox_open(folder, &outbox, NULL), MHE_OK);
    assert_int_equal(mhe_sink_sto(outbox, "x.sto", "t", labels, 1, &sink, NULL), MHE_OK);
    assert_int_equal(mhe_sink_row(sink, 0, &value, NULL), MHE_OK);
    assert_int_equal(mhe_outbox_text(outbox, "summary.json", "{}", NULL), MHE_OK);
    assert_int_equal(count_files(), 3); /* the old one and two temporary ones */
    mhe_outbox_close(outbox);
    assert_int_equal(count_files(), 1);
    expect_text("x.sto", "old");
}

static void names_are_plain_and_unique(void **state) {
    (void)state;
    mhe_outbox *outbox = NULL;
    mhe_error err = {0};
    assert_int_equal(mhe_outbox_open(folder, &outbox, &err), MHE_OK);
    assert_int_equal(mhe_outbox_text(outbox, "../x", "", &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_outbox_text(outbox, "", "", &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_outbox_text(outbox, "a", "1", &err), MHE_OK);
    assert_int_equal(mhe_outbox_text(outbox, "a", "2", &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_outbox_commit(outbox, &err), MHE_OK);
    mhe_outbox_close(outbox);
    expect_text("a", "1");
    assert_int_equal(count_files(), 1);
}

static void folders_are_made(void **state) {
    (void)state;
    mhe_outbox *outbox = NULL;
    mhe_error err = {0};
    assert_int_equal(mhe_outbox_open(path_of("a/b//c/"), &outbox, &err), MHE_OK);
    mhe_outbox_close(outbox);
    assert_int_equal(access(path_of("a/b/c"), F_OK), 0);
    (void)rmdir(path_of("a/b/c"));
    (void)rmdir(path_of("a/b"));
    (void)rmdir(path_of("a"));
    FILE *file = fopen(path_of("file"), "w");
    assert_true(file != NULL && fclose(file) == 0);
    assert_int_equal(mhe_outbox_open(path_of("file"), &outbox, &err), MHE_E_IO);
    assert_int_equal(mhe_outbox_open(path_of("file/below"), &outbox, &err), MHE_E_IO);
    assert_non_null(strstr(err.text, "folder cannot be made"));
    assert_null(outbox);
}

/* As on a full disk: files may not grow beyond 64 KiB. */
static void full_disk(void **state) {
    (void)state;
    struct rlimit before, small;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    small = before;
    small.rlim_cur = 1 << 16;
    (void)signal(SIGXFSZ, SIG_IGN);
    const char *labels[] = {"a"};
    mhe_outbox *outbox = NULL;
    mhe_sink *sink = NULL;
    mhe_error err = {0};
    assert_int_equal(mhe_outbox_open(folder, &outbox, &err), MHE_OK);
    assert_int_equal(mhe_outbox_text(outbox, "config.yaml", "a: 1\n", &err), MHE_OK);
    assert_int_equal(mhe_sink_sto(outbox, "x.sto", "t", labels, 1, &sink, &err), MHE_OK);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
    mhe_status status = MHE_OK;
    for (int i = 0; i < 20000 && status == MHE_OK; i++) {
        double value = 1.0 / (i + 1);
        status = mhe_sink_row(sink, i, &value, &err);
    }
    mhe_status commit = mhe_outbox_commit(outbox, NULL);
    (void)setrlimit(RLIMIT_FSIZE, &before);
    assert_int_equal(status, MHE_E_IO);
    assert_non_null(strstr(err.text, "x.sto: cannot be written: File too large"));
    assert_int_equal(commit, MHE_E_IO);
    mhe_outbox_close(outbox);
    assert_int_equal(count_files(), 0);
}

/* So few rows that all stay in the buffer: the fault shows at commit. */
static void full_disk_at_commit(void **state) {
    (void)state;
    struct rlimit before, none;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    none = before;
    none.rlim_cur = 0;
    (void)signal(SIGXFSZ, SIG_IGN);
    const char *labels[] = {"a"};
    double value = 1;
    mhe_outbox *outbox = NULL;
    mhe_sink *sink = NULL;
    mhe_error err = {0};
    assert_int_equal(mhe_outbox_open(folder, &outbox, &err), MHE_OK);
    assert_int_equal(mhe_sink_sto(outbox, "x.sto", "t", labels, 1, &sink, &err), MHE_OK);
    assert_int_equal(mhe_sink_row(sink, 0, &value, &err), MHE_OK);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &none), 0);
    mhe_status commit = mhe_outbox_commit(outbox, &err);
    (void)setrlimit(RLIMIT_FSIZE, &before);
    assert_int_equal(commit, MHE_E_IO);
    mhe_outbox_close(outbox);
    assert_int_equal(count_files(), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(sto_reads_back, empty_folder),
        cmocka_unit_test_teardown(trc_reads_back, empty_folder),
        cmocka_unit_test_teardown(nothing_without_commit, empty_folder),
        cmocka_unit_test_teardown(names_are_plain_and_unique, empty_folder),
        cmocka_unit_test_teardown(folders_are_made, empty_folder),
        cmocka_unit_test_teardown(full_disk, empty_folder),
        cmocka_unit_test_teardown(full_disk_at_commit, empty_folder)};
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
