/* SPDX-License-Identifier: Apache-2.0 */
/* test_options.c: option tables of made-up plugins against YAML mappings. */
#include "base/arena.h"
#include "config/options.h"
#include "support.h"

#include <math.h>
#include <string.h>

struct sample {
    double real, angle;
    int32_t count, flag, method;
    const char *text, *path, *fallback;
    mhe_real_list reals;
    mhe_text_list texts;
    mhe_text_map map;
};

static const mhe_option options[] = {
    MHE_OPT_REAL(struct sample, real, 0.5, -1, INFINITY, "1", "A number."),
    MHE_OPT_REAL(struct sample, angle, 0, -3.2, 3.2, "rad", "An angle."),
    MHE_OPT_INT(struct sample, count, 15, 1, 1000, "1", "A count."),
    MHE_OPT_BOOL(struct sample, flag, 0, "A switch."),
    MHE_OPT_ENUM(struct sample, method, "gauss", "gauss|rk4|euler", "A choice."),
    MHE_OPT_TEXT(struct sample, text, 0, "abc", "A text."),
    MHE_OPT_PATH(struct sample, path, 0, "A path."),
    {.key = "fallback",
     .help = "A path with a default.",
     .text_default = "curves.txt",
     .type = MHE_TYPE_PATH,
     .offset = MHE_OPT_OFFSET(struct sample, fallback, const char *)},
    MHE_OPT_REALS(struct sample, reals, 0, 0, 10, "m", "Numbers."),
    MHE_OPT_TEXTS(struct sample, texts, 0, "Texts."),
    MHE_OPT_MAP(struct sample, map, 0, "Key to text."),
    {.key = "old_count",
     .help = "Former name of count.",
     .unit = "1",
     .replaced_by = "count",
     .min = 1,
     .max = 1000,
     .type = MHE_TYPE_INT,
     .flags = MHE_OPT_DEPRECATED},
};
#define N_OPTIONS ((int32_t)(sizeof options / sizeof options[0]))

static const char *const common[] = {"plugin", "weight"};

struct filled {
    mhi_tree *tree;
    mhi_arena arena;
    struct sample sample;
    mhe_status status;
    mhe_error err;
};

static struct filled fill(const char *yaml) {
    struct filled f = {0};
    assert_int_equal(mhi_tree_parse("f.yaml", yaml, strlen(yaml), &f.tree, &f.err), MHE_OK);
    f.status = mhi_options_fill(options, N_OPTIONS, f.tree, mhi_tree_root(f.tree), common, 2,
                                "org.test.x", "/work dir", &f.arena, &f.sample, &f.err);
    return f;
}

static void release(struct filled *f) {
    mhi_tree_free(f->tree);
    mhi_arena_free(&f->arena);
}

static struct filled fill_good(const char *yaml) {
    struct filled f = fill(yaml);
    assert_string_equal(f.err.text, "");
    assert_int_equal(f.status, MHE_OK);
    return f;
}

static void assert_refused(const char *yaml, const char *message) {
    struct filled f = fill(yaml);
    assert_int_equal(f.status, MHE_E_CONFIG);
    assert_string_equal(f.err.text, message);
    release(&f);
}

static void the_table_is_sound(void **state) {
    (void)state;
    mhe_error err = {0};
    mhi_options_check(options, N_OPTIONS, sizeof(struct sample), &err);
    assert_string_equal(err.text, "");
}

static void defaults(void **state) {
    (void)state;
    struct filled f = fill_good("plugin: x\nweight: 2\n");
    assert_true(f.sample.real == 0.5);
    assert_int_equal(f.sample.count, 15);
    assert_int_equal(f.sample.flag, 0);
    assert_int_equal(f.sample.method, 0);
    assert_string_equal(f.sample.text, "abc");
    assert_null(f.sample.path);
    assert_string_equal(f.sample.fallback, "/work dir/curves.txt");
    assert_int_equal(f.sample.reals.n, 0);
    assert_int_equal(f.sample.texts.n, 0);
    assert_int_equal(f.sample.map.n, 0);
    release(&f);
    struct sample bare = {0}; /* without any file */
    mhi_arena arena = {0};
    mhe_error err = {0};
    assert_int_equal(
        mhi_options_fill(options, N_OPTIONS, NULL, NULL, NULL, 0, "x", NULL, &arena, &bare, &err),
        MHE_OK);
    assert_string_equal(bare.fallback, "curves.txt");
    mhi_arena_free(&arena);
}

static void values(void **state) {
    (void)state;
    struct filled f = fill_good("real: 1e-4\nangle: -3\ncount: 1e2\nflag: Yes\nmethod: rk4\n"
                                "text: 12.50\npath: ./sub/a b.trc\nfallback: /abs\n"
                                "reals: [1, 2.5, .5]\ntexts: [a, \"\", 3]\n"
                                "map: {max_iter: 15, linear_solver: mumps}\n");
    assert_true(f.sample.real == 1e-4);
    assert_true(f.sample.angle == -3);
    assert_int_equal(f.sample.count, 100);
    assert_int_equal(f.sample.flag, 1);
    assert_int_equal(f.sample.method, 1);
    assert_string_equal(f.sample.text, "12.50"); /* as written */
    assert_string_equal(f.sample.path, "/work dir/sub/a b.trc");
    assert_string_equal(f.sample.fallback, "/abs");
    assert_int_equal(f.sample.reals.n, 3);
    assert_true(f.sample.reals.values[2] == 0.5);
    assert_int_equal(f.sample.texts.n, 3);
    assert_string_equal(f.sample.texts.values[1], "");
    assert_string_equal(f.sample.texts.values[2], "3");
    assert_int_equal(f.sample.map.n, 2);
    assert_string_equal(f.sample.map.keys[1], "linear_solver");
    assert_string_equal(f.sample.map.values[0], "15");
    release(&f);
    f = fill_good("real: .inf\ntexts: single\nflag: OFF\n");
    assert_true(isinf(f.sample.real));
    assert_int_equal(f.sample.texts.n, 1);
    assert_string_equal(f.sample.texts.values[0], "single");
    release(&f);
    f = fill_good("path: null\nfallback: ~\nreals:\ntexts:\nmap:\n"); /* switched off */
    assert_null(f.sample.fallback);
    assert_int_equal(f.sample.texts.n, 0);
    release(&f);
}

static void unknown_keys(void **state) {
    (void)state;
    assert_refused("real: 1\nmetod: rk4\n",
                   "f.yaml:2: org.test.x: unknown key 'metod' (did you mean 'method'?)");
    assert_refused("wieght: 1\n",
                   "f.yaml:1: org.test.x: unknown key 'wieght' (did you mean 'weight'?)");
    /* an old name works but is not advertised */
    assert_refused("zzzzzzzzzzz: 1\n",
                   "f.yaml:1: org.test.x: unknown key 'zzzzzzzzzzz' (valid: real, angle, count, "
                   "flag, method, text, path, fallback, reals, texts, map, plugin, weight)");
}

static void wrong_numbers(void **state) {
    (void)state;
    assert_refused("\nreal: abc\n", "f.yaml:2: org.test.x: 'real' must be a number, not 'abc'");
    assert_refused("real: .nan\n", "f.yaml:1: org.test.x: 'real' must be a number, not '.nan'");
    assert_refused("real: 0x10\n", "f.yaml:1: org.test.x: 'real' must be a number, not '0x10'");
    assert_refused("real: 1e999\n", "f.yaml:1: org.test.x: 'real' must be a number, not '1e999'");
    assert_refused("real:\n", "f.yaml:1: org.test.x: 'real' must be a number, not without a value");
    assert_refused("real: [1]\n", "f.yaml:1: org.test.x: 'real' must be a number, not a list");
    assert_refused("real: {a: 1}\n",
                   "f.yaml:1: org.test.x: 'real' must be a number, not a mapping");
    assert_refused("real: \"1\"\n", "f.yaml:1: org.test.x: 'real' must be a number, not \"1\"; "
                                    "leave out the quotes");
    assert_refused("angle: 5 deg\n",
                   "f.yaml:1: org.test.x: 'angle' must be a number (rad), not '5 deg'; write the "
                   "number alone, without a unit, with a decimal point");
    assert_refused("angle: 1,5\n",
                   "f.yaml:1: org.test.x: 'angle' must be a number (rad), not '1,5'; write the "
                   "number alone, without a unit, with a decimal point");
    assert_refused("angle: 4\n", "f.yaml:1: org.test.x: 'angle' must lie in -3.2 .. 3.2, not '4'");
    assert_refused("angle: -.inf\n", "f.yaml:1: org.test.x: 'angle' must be finite, not '-.inf'");
    assert_refused("real: -2\n", "f.yaml:1: org.test.x: 'real' must be at least -1, not '-2'");
    assert_refused("count: 1.5\n", "f.yaml:1: org.test.x: 'count' must be an integer, not '1.5'");
    assert_refused("count: 0\n", "f.yaml:1: org.test.x: 'count' must lie in 1 .. 1000, not '0'");
    assert_refused("count: 1e10\n", "f.yaml:1: org.test.x: 'count' must fit into 32 bits");
    assert_refused("count: .inf\n", "f.yaml:1: org.test.x: 'count' must fit into 32 bits");
}

static void wrong_others(void **state) {
    (void)state;
    assert_refused("flag: maybe\n",
                   "f.yaml:1: org.test.x: 'flag' must be true or false, not 'maybe'");
    assert_refused("flag: 1\n", "f.yaml:1: org.test.x: 'flag' must be true or false, not '1'");
    assert_refused("flag: \"true\"\n",
                   "f.yaml:1: org.test.x: 'flag' must be true or false, not \"true\"; leave out "
                   "the quotes");
    assert_refused("method: rk\n",
                   "f.yaml:1: org.test.x: 'method' cannot be 'rk' (did you mean 'rk4'?)");
    assert_refused("method: runge-kutta\n", "f.yaml:1: org.test.x: 'method' cannot be "
                                            "'runge-kutta' (valid: gauss, rk4, euler)");
    assert_refused("text: [a]\n", "f.yaml:1: org.test.x: 'text' must be a text, not a list");
    assert_refused("text:\n", "f.yaml:1: org.test.x: 'text' must be a text, not without a value");
    assert_refused("path: \"\"\n", "f.yaml:1: org.test.x: 'path' must be a path, not \"\"");
    assert_refused("path: [a]\n", "f.yaml:1: org.test.x: 'path' must be a path, not a list");
    assert_refused("reals: 0.5\n", "f.yaml:1: org.test.x: 'reals' must be a list of numbers (m), "
                                   "not '0.5'; put it in brackets");
    assert_refused("reals:\n  - 1\n  - x\n",
                   "f.yaml:3: org.test.x: 'reals' must be a list of numbers (m), not 'x'");
    assert_refused("reals:\n  - 1\n  - 11\n",
                   "f.yaml:3: org.test.x: 'reals' must lie in 0 .. 10, not '11'");
    assert_refused("texts: {a: b}\n",
                   "f.yaml:1: org.test.x: 'texts' must be a list of texts, not a mapping");
    assert_refused("texts: [a, [b]]\n",
                   "f.yaml:1: org.test.x: 'texts' must be a list of texts, not a list");
    assert_refused("map: [a]\n",
                   "f.yaml:1: org.test.x: 'map' must be a mapping of texts, not a list");
    assert_refused("map:\n  a: 1\n  b: {c: 1}\n",
                   "f.yaml:3: org.test.x: 'map' must be a mapping of texts, not a mapping");
    assert_refused("[1]\n",
                   "f.yaml:1: org.test.x: must be a mapping like {key: value}, not a list");
    assert_refused("plain\n",
                   "f.yaml:1: org.test.x: must be a mapping like {key: value}, not a single value");
    /* 45 letters of two bytes are cut between letters */
    assert_refused("flag: \xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4"
                   "\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4x"
                   "xx\xc3\xa4\xc3\xa4\xc3\xa4\n",
                   "f.yaml:1: org.test.x: 'flag' must be true or false, not '\xc3\xa4\xc3\xa4"
                   "\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4"
                   "\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4\xc3\xa4xxx...'");
}

static void old_names(void **state) {
    (void)state;
    struct filled f = fill_good("old_count: 20\n");
    assert_int_equal(f.sample.count, 20);
    release(&f);
    assert_refused("old_count: 0\n",
                   "f.yaml:1: org.test.x: 'count' must lie in 1 .. 1000, not '0'");
    assert_refused("count: 1\nold_count: 2\n",
                   "f.yaml:2: org.test.x: 'old_count' is an old name of 'count', which is set too");
}

struct need {
    const char *file;
};

static void required_keys(void **state) {
    (void)state;
    const mhe_option table[] = {
        MHE_OPT_PATH(struct need, file, MHE_OPT_REQUIRED, "Model file."),
    };
    const char *yamls[] = {"\nmodel: {}\n", "\nmodel:\n", "\nmodel: {file: }\n"};
    const char *messages[] = {"f.yaml:2: model: the key 'file' is missing: Model file.",
                              "f.yaml:2: model: the key 'file' is missing: Model file.",
                              "f.yaml:2: model: 'file' must be a path, not without a value"};
    for (int i = 0; i < 3; i++) {
        mhi_tree *tree = NULL;
        mhi_arena arena = {0};
        struct need need = {0};
        mhe_error err = {0};
        assert_int_equal(mhi_tree_parse("f.yaml", yamls[i], strlen(yamls[i]), &tree, &err), MHE_OK);
        assert_int_equal(mhi_options_fill(table, 1, tree,
                                          mhi_node_find(mhi_tree_root(tree), "model"), NULL, 0,
                                          "model", "/", &arena, &need, &err),
                         MHE_E_CONFIG);
        assert_string_equal(err.text, messages[i]);
        mhi_tree_free(tree);
        mhi_arena_free(&arena);
    }
}

static void written_config_reads_back(void **state) {
    (void)state;
    struct filled f =
        fill_good("real: 0.1\nangle: 3.0000000000000004\nflag: on\nmethod: euler\n"
                  "text: \"true: \\\"x\\\" \\u2028\"\npath: 'c d/e.trc'\nfallback: null\n"
                  "reals: [0.30000000000000004, 1e-300]\ntexts: [\"\", \"null\", a/b.c]\n"
                  "map: {\"k 1\": \"v\\n2\", plain: \"#no\"}\n");
    mhi_text first = {0}, second = {0};
    mhi_options_write(options, N_OPTIONS, &f.sample, 0, &first);
    assert_string_equal(first.data,
                        "real: 0.1\nangle: 3.0000000000000004\ncount: 15\nflag: true\n"
                        "method: euler\ntext: \"true: \\\"x\\\" \\u2028\"\n"
                        "path: \"/work dir/c d/e.trc\"\nfallback: null\n"
                        "reals: [0.30000000000000004, 1e-300]\ntexts: [\"\", \"null\", a/b.c]\n"
                        "map: {\"k 1\": \"v\\u000a2\", plain: \"#no\"}\n");
    struct filled g = fill_good(first.data);
    mhi_options_write(options, N_OPTIONS, &g.sample, 0, &second);
    assert_string_equal(second.data, first.data);
    assert_string_equal(g.sample.map.values[0], "v\n2");
    mhi_text_free(&first);
    mhi_text_free(&second);
    release(&f);
    release(&g);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_table_is_sound),
        cmocka_unit_test(defaults),
        cmocka_unit_test(values),
        cmocka_unit_test(unknown_keys),
        cmocka_unit_test(wrong_numbers),
        cmocka_unit_test(wrong_others),
        cmocka_unit_test(old_names),
        cmocka_unit_test(required_keys),
        cmocka_unit_test(written_config_reads_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
