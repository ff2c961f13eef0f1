/* SPDX-License-Identifier: Apache-2.0 */
/* Which column serves a name of the model. */
#include "io/table.h"
#include "support.h"

#include <string.h>

static int32_t find(const char *labels, const char *name) {
    char text[512];
    mhi_table *table = NULL;
    mhe_error err = {0};
    int n = snprintf(text, sizeof text, "endheader\ntime\t%s\n0", labels);
    for (const char *p = labels; p != NULL; p = strchr(p + 1, '\t')) {
        n += snprintf(text + n, sizeof text - (size_t)n, "\t1");
    }
    if (mhi_sto_parse("memory", text, (size_t)n, &table, &err) != MHE_OK) {
        fail_msg("%s", err.text);
    }
    int32_t at = mhi_table_find(table, name);
    mhi_table_free(table);
    return at;
}

static void exact_name_wins(void **state) {
    (void)state;
    assert_int_equal(find("Anna:STER\tSTER", "STER"), 1);
    assert_int_equal(find("q.BRA\tBRA", "BRA"), 1);
    assert_int_equal(find("a\tb", "c"), -1);
}

static void subject_and_path_are_passed_over(void **state) {
    (void)state;
    assert_int_equal(find("x\tAnna:STER", "STER"), 1);
    assert_int_equal(find("x\t/forceset/BRA", "BRA"), 1);
    assert_int_equal(find("Anna:STER\tBert:STER", "STER"), -1);
    assert_int_equal(find("Anna:STER\tBert:STER", "Bert:STER"), 1);
}

static void opensim_states(void **state) {
    (void)state;
    const char *labels =
        "/jointset/elbow/elbow_flexion/value\t/jointset/elbow/elbow_flexion/speed\t"
        "/forceset/BRA/activation\t/forceset/BRA/fiber_length";
    assert_int_equal(find(labels, "elbow_flexion"), 0);
    assert_int_equal(find(labels, "q.elbow_flexion"), 0);
    assert_int_equal(find(labels, "qdot.elbow_flexion"), 1);
    assert_int_equal(find(labels, "elbow_flexion/speed"), 1);
    assert_int_equal(find(labels, "a.BRA"), 2);
    assert_int_equal(find(labels, "BRA/activation"), 2);
    assert_int_equal(find(labels, "F.BRA"), -1);
}

static void quantities_before_the_name(void **state) {
    (void)state;
    const char *labels = "q_elbow\tqdot_elbow\ta.BRA\te.BRA\tF_BRA";
    assert_int_equal(find(labels, "elbow"), 0);
    assert_int_equal(find(labels, "q.elbow"), 0);
    assert_int_equal(find(labels, "qdot.elbow"), 1);
    assert_int_equal(find(labels, "F.BRA"), 4);
    assert_int_equal(find(labels, "e_BRA"), 3);
    assert_int_equal(find(labels, "BRA"), -1); /* activation, excitation or force? */
    assert_int_equal(find("e.BRA\te.BRD", "BRD"), -1);
    assert_int_equal(find("qdot_elbow", "elbow"), -1); /* a speed never passes for a position */
    assert_int_equal(find("time2\tq", "q"), 1);
}

static void markers_are_found_by_number(void **state) {
    (void)state;
    const char *text = "PathFileType\t4\t(X/Y/Z)\tx.trc\nDataRate\tUnits\n100\tm\n"
                       "Frame#\tTime\tAnna:A\t\t\tAnna:B\n\t\tX1\n1\t0\t1\t2\t3\t4\t5\t6\n";
    mhi_table *table = NULL;
    assert_int_equal(mhi_trc_parse("memory", text, strlen(text), &table, NULL), MHE_OK);
    assert_string_equal(table->labels[1], "Anna:B");
    assert_int_equal(mhi_table_find(table, "B"), 1);
    mhi_table_free(table);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact_name_wins), cmocka_unit_test(subject_and_path_are_passed_over),
        cmocka_unit_test(opensim_states), cmocka_unit_test(quantities_before_the_name),
        cmocka_unit_test(markers_are_found_by_number)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
