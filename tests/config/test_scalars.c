/* SPDX-License-Identifier: Apache-2.0 */
/* test_scalars.c: numbers and texts survive being written and read. */
#include "config/tree.h"
#include "config/yaml_scalar.h"
#include "support.h"

#include <float.h>
#include <locale.h>
#include <math.h>
#include <string.h>

static void numbers_are_read(void **state) {
    (void)state;
    const struct {
        const char *text;
        double value;
    } good[] = {{"1", 1},        {"-0.5", -0.5}, {"+3", 3},          {".5", 0.5},
                {"2.", 2},       {"1e-4", 1e-4}, {"1E+3", 1e3},      {"007", 7},
                {"1e-999", 0.0}, {"0", 0},       {".inf", INFINITY}, {"-.INF", -INFINITY}};
    for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
        double value = -1;
        assert_int_equal(mhi_yaml_number(good[i].text, &value), 1);
        assert_true(value == good[i].value);
    }
    const char *bad[] = {"",      "-",      ".",      "e5",       "1e",  "1e+", "1.2.3", "0x10",
                         "1_000", "inf",    "nan",    ".nan",     " 1",  "1 ",  "1,5",   "--1",
                         "1e999", "+-.inf", "-1e999", "infinity", "0b1", "1:30"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        double value = 0;
        assert_int_equal(mhi_yaml_number(bad[i], &value), 0);
    }
}

static void numbers_round_trip(void **state) {
    (void)state;
    char out[MHI_YAML_REAL_SIZE];
    assert_string_equal(mhi_yaml_real(0.1, out), "0.1");
    assert_string_equal(mhi_yaml_real(1e-4, out), "0.0001");
    assert_string_equal(mhi_yaml_real(7, out), "7");
    assert_string_equal(mhi_yaml_real(INFINITY, out), ".inf");
    assert_string_equal(mhi_yaml_real(-INFINITY, out), "-.inf");
    assert_string_equal(mhi_yaml_real(0.30000000000000004, out), "0.30000000000000004");
    const double edges[] = {0.0, -0.0, DBL_MAX, -DBL_MAX, DBL_MIN, 5e-324, 1.0 / 3, -INFINITY};
    for (size_t i = 0; i < sizeof edges / sizeof edges[0]; i++) {
        double back = 1;
        assert_int_equal(mhi_yaml_number(mhi_yaml_real(edges[i], out), &back), 1);
        assert_memory_equal(&back, &edges[i], sizeof back);
    }
    uint64_t seed = 7;
    for (int i = 0; i < 20000; i++) {
        double value = ldexp(test_random(&seed, -1, 1), (int)test_random(&seed, -1000, 1000));
        double back = 0;
        assert_int_equal(mhi_yaml_number(mhi_yaml_real(value, out), &back), 1);
        assert_true(back == value);
    }
}

static void decimal_comma_of_the_application(void **state) {
    (void)state;
    if (setlocale(LC_ALL, "de_DE.UTF-8") == NULL && setlocale(LC_ALL, "fr_FR.UTF-8") == NULL) {
        skip(); /* no such locale is installed */
    }
    char out[MHI_YAML_REAL_SIZE];
    double value = 0;
    assert_string_equal(mhi_yaml_real(0.5, out), "0.5");
    assert_int_equal(mhi_yaml_number("0.5", &value), 1);
    assert_true(value == 0.5);
    setlocale(LC_ALL, "C");
}

static void assert_text(const char *text, const char *yaml) {
    mhi_text out = {0};
    mhi_yaml_text(text, &out);
    if (yaml != NULL) {
        assert_string_equal(out.data, yaml);
    }
    mhi_tree *tree = NULL;
    mhe_error err = {0};
    mhi_text document = {0};
    mhi_text_add(&document, "{%s: %s}", out.data, out.data);
    mhi_tree_parse("f.yaml", document.data, document.length, &tree, &err);
    assert_string_equal(err.text, "");
    assert_string_equal(mhi_tree_root(tree)->first->key, text);
    assert_string_equal(mhi_tree_root(tree)->first->text, text);
    mhi_tree_free(tree);
    mhi_text_free(&document);
    mhi_text_free(&out);
}

static void texts_round_trip(void **state) {
    (void)state;
    assert_text("mhe.solver.ipopt", "mhe.solver.ipopt");
    assert_text("/a/b_c-d.osim", "/a/b_c-d.osim");
    assert_text("", "\"\"");
    assert_text("a b", "\"a b\"");
    assert_text("Null", "\"Null\"");
    assert_text("yes", "\"yes\"");
    assert_text("1e3", "\"1e3\"");
    assert_text("~", "\"~\"");
    assert_text("a: #b \"c\" \\d", "\"a: #b \\\"c\\\" \\\\d\"");
    assert_text("line\nnext\ttab\r", "\"line\\u000anext\\u0009tab\\u000d\"");
    assert_text("\x7f\xc2\x80\xc2\x85\xc2\xa0", "\"\\u007f\\u0080\\u0085\xc2\xa0\"");
    assert_text("\xe2\x80\xa8\xe2\x80\xa9\xef\xbb\xbf", "\"\\u2028\\u2029\\ufeff\"");
    assert_text("\xc3\xa4\xe2\x82\xac\xf0\x9d\x84\x9e", "\"\xc3\xa4\xe2\x82\xac\xf0\x9d\x84\x9e\"");
    char all[128] = {0};
    for (int c = 1; c < 128; c++) {
        all[c - 1] = (char)c;
    }
    assert_text(all, NULL);
    const char *malformed[] = {
        "\xff",     "\x80", "\xc3", "\xc0\xaf", "\xe0\x80\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80",
        "\xe2\x82x"};
    for (size_t i = 0; i < sizeof malformed / sizeof malformed[0]; i++) {
        assert_int_equal(mhi_yaml_is_utf8(malformed[i]), 0);
    }
    assert_int_equal(mhi_yaml_is_utf8("\xc3\xa4\xe2\x82\xac\xf0\x9d\x84\x9e"), 1);
    mhi_text out = {0};
    mhi_yaml_text("a\xff", &out);
    assert_string_equal(out.data, "\"a\\ufffd\"");
    mhi_text_free(&out);
    mhi_yaml_text(NULL, &out);
    assert_string_equal(out.data, "null");
    mhi_text_free(&out);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers_are_read),
        cmocka_unit_test(numbers_round_trip),
        cmocka_unit_test(decimal_comma_of_the_application),
        cmocka_unit_test(texts_round_trip),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
