/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/columns.h"
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static int n_lines;
static char lines[2048];

static void count_line(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level;
    n_lines++;
    (void)snprintf(lines + strlen(lines), sizeof lines - strlen(lines), "%s\n", text);
}

static const mhe_host host = {.size = sizeof host, .log = count_line};

static mhi_table *parse(const char *text) {
    mhi_table *table = NULL;
    mhe_error err = {0};
    if (mhi_sto_parse("t.sto", text, strlen(text), &table, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    return table;
}

static mhe_status match(const mhi_table *table, const mhi_naming *naming, const char *const *names,
                        int32_t n, int32_t *column, mhe_error *err) {
    uint8_t used[16] = {0};
    int32_t found = 0;
    n_lines = 0;
    lines[0] = '\0';
    return mhi_columns_match(table, naming, names, n, table->n_columns, column, used, &found, &host,
                             err);
}

static void names_patterns_and_numbers(void **state) {
    (void)state;
    static const mhi_naming q = {"coordinate", {"q_%s", "%s", "q%d"}, 0};
    const char *names[] = {"elbow", "wrist"};
    int32_t column[2];
    mhi_table *t = parse("x\nendheader\ntime\tq_wrist\telbow\n0\t1\t2\n1\t3\t4\n");
    assert_int_equal(match(t, &q, names, 2, column, NULL), MHE_OK);
    assert_int_equal(column[0], 1);
    assert_int_equal(column[1], 0);
    mhi_table_free(t);
    t = parse("x\nendheader\ntime\tq1\tq2\n0\t1\t2\n1\t3\t4\n");
    assert_int_equal(match(t, &q, names, 2, column, NULL), MHE_OK);
    assert_int_equal(column[0], 0);
    assert_int_equal(column[1], 1);
    mhi_table_free(t);
    t = parse("x\nendheader\ntime\tq0\tq1\n0\t1\t2\n1\t3\t4\n");
    assert_int_equal(match(t, &q, names, 2, column, NULL), MHE_OK);
    assert_int_equal(column[0], 0);
    assert_int_equal(column[1], 1);
    mhi_table_free(t);
}

static void slips_and_strangers(void **state) {
    (void)state;
    static const mhi_naming muscle = {"muscle", {"e_%s", "%s"}, 1};
    const char *names[] = {"TricepsLong", "BRA"};
    int32_t column[2];
    mhe_error err = {0};
    mhi_table *t = parse("x\nendheader\ntime\tTricepLong\tBRA\n0\t1\t2\n");
    assert_int_equal(match(t, &muscle, names, 2, column, &err), MHE_OK);
    assert_int_equal(column[0], -1); /* a slip is told and never a dead end */
    assert_non_null(strstr(lines, "TricepLong (did you mean 'TricepsLong'?)"));
    assert_int_equal(n_lines, 2);
    mhi_table_free(t);
    t = parse("x\nendheader\ntime\tforceplate_vertical\tBRA\n0\t1\t2\n");
    assert_int_equal(match(t, &muscle, names, 2, column, &err), MHE_OK);
    assert_int_equal(column[0], -1);
    assert_int_equal(column[1], 1);
    assert_int_equal(n_lines, 2); /* one for the stranger, one for the absent muscle */
    mhi_table_free(t);
    t = parse("x\nendheader\ntime\tforceplate_vertical\n0\t1\n");
    assert_int_equal(match(t, &muscle, names, 2, column, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "no column is a muscle"));
    mhi_table_free(t);
}

static void other_spellings_and_subjects(void **state) {
    (void)state;
    static const mhi_naming marker = {"marker", {"%s"}, 1};
    const char *names[] = {"ELB.L", "WRI.L"};
    int32_t column[2];
    mhe_error err = {0};
    mhi_table *t = parse("x\nendheader\ntime\twri-l\tAnna:ELB_L\n0\t1\t2\n");
    assert_int_equal(match(t, &marker, names, 2, column, &err), MHE_OK);
    assert_int_equal(column[0], 1);
    assert_int_equal(column[1], 0);
    assert_int_equal(n_lines, 1);
    assert_non_null(strstr(lines, "Anna:ELB_L as ELB.L, wri-l as WRI.L"));
    mhi_table_free(t);
    /* not unique: neither is taken */
    t = parse("x\nendheader\ntime\telb_l\tELB-L\tWRI.L\n0\t1\t2\t3\n");
    assert_int_equal(match(t, &marker, names, 2, column, &err), MHE_OK);
    assert_int_equal(column[0], -1);
    assert_int_equal(column[1], 2);
    mhi_table_free(t);
    t = parse("x\nendheader\ntime\tA:ELB.L\tB:ELB.L\tA:WRI.L\n0\t1\t2\t3\n");
    assert_int_equal(match(t, &marker, names, 2, column, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "two subjects (A, B) have marker ELB.L: name one with "
                                     "data.subject"));
    mhi_table_free(t);
}

static void values_between_rows(void **state) {
    (void)state;
    mhi_table *t = parse("x\nendheader\ntime\ta\n0\t1\n1\t3\n2\tnan\n3\t5\n");
    assert_true(mhi_column_at(t, 0, 1, 0) == 3);
    assert_true(fabs(mhi_column_at(t, 0, 0.25, 0) - 1.5) < 1e-12);
    assert_true(mhi_column_at(t, 0, 0.25, 1) == 1);
    assert_true(isnan(mhi_column_at(t, 0, 1.5, 0)));
    assert_true(isnan(mhi_column_at(t, 0, -0.1, 0)));
    assert_true(isnan(mhi_column_at(t, 0, 3.1, 1)));
    assert_true(mhi_column_at(t, 0, 3, 0) == 5);
    assert_true(isnan(mhi_column_at(t, -1, 1, 0)));
    mhi_table_free(t);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(names_patterns_and_numbers), cmocka_unit_test(slips_and_strangers),
        cmocka_unit_test(other_spellings_and_subjects), cmocka_unit_test(values_between_rows)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
