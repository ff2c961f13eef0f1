/* SPDX-License-Identifier: Apache-2.0 */
/* Results that an application writes, and tables that it reads. */
#include "outside.h"

#include <math.h>
#include <mhe/outbox.h>
#include <mhe/table.h>
#include <unistd.h>

static char folder[] = "/tmp/mhe-files-XXXXXX";
static const char *const labels[] = {"/forceset/BRA", "TRI"};

static const char *path_of(const char *name) {
    static char path[96];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static mhe_outbox *open_outbox(void) {
    mhe_outbox *outbox = NULL;
    mhe_error err = {0};
    expect_done(mhe_outbox_open(folder, &outbox, &err), &err);
    return outbox;
}

static void rows_are_read_back(void **state) {
    (void)state;
    mhe_outbox *outbox = open_outbox();
    mhe_sink *sink = NULL;
    mhe_error err = {0};
    expect_done(mhe_sink_sto(outbox, "f.sto", "forces", labels, 2, &sink, &err), &err);
    for (int32_t k = 0; k < 5; k++) {
        const double row[] = {1.5 * k, k == 3 ? (double)NAN : -1.0 * k};
        expect_done(mhe_sink_row(sink, 0.25 * k, row, &err), &err);
    }
    assert_int_not_equal(access(path_of("f.sto"), F_OK), 0); /* not before it is complete */
    expect_done(mhe_outbox_commit(outbox, &err), &err);
    mhe_outbox_close(outbox);
    mhe_table *table = NULL;
    mhe_table_info info = {.size = sizeof info};
    expect_done(mhe_table_read_signals(path_of("f.sto"), &table, &err), &err);
    expect_done(mhe_table_describe(table, &info, &err), &err);
    assert_int_equal(info.n_rows, 5);
    assert_int_equal(info.n_columns, 2);
    assert_int_equal(mhe_table_find(table, "BRA"), 0);
    assert_int_equal(mhe_table_find(table, "BRD"), -1);
    assert_true(info.time[4] == 1 && info.values[8] == 6 && isnan(info.values[7]));
    assert_true(info.rate == 4);
    mhe_table_close(table);
    (void)unlink(path_of("f.sto"));
}

typedef struct job {
    mhe_status status;
    int released;
} job;

static mhe_status write_later(void *data, const char *path, mhe_error *err) {
    const job *j = data;
    FILE *file = fopen(path, "w");
    if (j->status != MHE_OK || file == NULL || fputs("later\n", file) < 0 || fclose(file) != 0) {
        return mhe_fail(err, j->status, "the library failed");
    }
    return MHE_OK;
}

static void release(void *data) {
    job *j = data;
    j->released++;
}

static void a_file_may_be_written_by_another_library(void **state) {
    (void)state;
    job good = {0}, bad = {.status = MHE_E_IO};
    mhe_error err = {0};
    mhe_outbox *outbox = open_outbox();
    FILE *stream = NULL;
    expect_done(mhe_outbox_later(outbox, "a.mat", write_later, release, &good, &err), &err);
    expect_done(mhe_outbox_stream(outbox, "b.txt", &stream, &err), &err);
    (void)fputs("now\n", stream);
    expect_done(mhe_outbox_commit(outbox, &err), &err);
    mhe_outbox_close(outbox);
    assert_int_equal(good.released, 1);
    char line[16] = "";
    FILE *file = fopen(path_of("a.mat"), "r");
    assert_non_null(file);
    assert_non_null(fgets(line, sizeof line, file));
    assert_string_equal(line, "later\n");
    (void)fclose(file);
    /* one that fails takes the others with it, and what was there stays */
    outbox = open_outbox();
    expect_done(mhe_outbox_later(outbox, "a.mat", write_later, release, &bad, &err), &err);
    expect_done(mhe_outbox_text(outbox, "c.txt", "new", &err), &err);
    assert_int_equal(mhe_outbox_commit(outbox, &err), MHE_E_IO);
    assert_non_null(strstr(err.text, "a.mat: the library failed"));
    mhe_outbox_close(outbox);
    assert_int_equal(bad.released, 1);
    assert_int_equal(access(path_of("a.mat"), F_OK), 0);
    assert_int_not_equal(access(path_of("c.txt"), F_OK), 0);
    (void)unlink(path_of("a.mat"));
    (void)unlink(path_of("b.txt"));
}

static void null_is_an_argument_error(void **state) {
    (void)state;
    mhe_outbox *outbox = open_outbox(), *none = NULL;
    mhe_sink *sink = NULL;
    mhe_table *table = NULL;
    mhe_error err = {0};
    FILE *stream = NULL;
    const double row[] = {0};
    assert_int_equal(mhe_outbox_open(NULL, &none, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_outbox_text(outbox, "x", NULL, &err), MHE_E_ARGUMENT);
    assert_string_equal(err.text, "mhe_outbox_text: 'text' is NULL");
    assert_int_equal(mhe_outbox_stream(outbox, NULL, &stream, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_outbox_later(outbox, "x", NULL, NULL, NULL, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_outbox_commit(NULL, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_sink_csv(outbox, "x", NULL, 1, &sink, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_sink_row(NULL, 0, row, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_table_read_markers(NULL, &table, &err), MHE_E_ARGUMENT);
    assert_int_equal(mhe_table_find(NULL, "x"), -1);
    mhe_outbox_close(outbox);
    mhe_outbox_close(NULL);
    mhe_table_close(NULL);
}

static int set_up(void **state) {
    (void)state;
    return mkdtemp(folder) == NULL ? -1 : 0;
}

static int tear_down(void **state) {
    (void)state;
    return rmdir(folder); /* nothing is left behind */
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(rows_are_read_back),
                                       cmocka_unit_test(a_file_may_be_written_by_another_library),
                                       cmocka_unit_test(null_is_an_argument_error)};
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
