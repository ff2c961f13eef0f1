/* SPDX-License-Identifier: Apache-2.0 */
/* test_tree.c: YAML to nodes, lines in errors, --set. */
#include "config/tree.h"
#include "support.h"

#include <stdlib.h>
#include <string.h>

static mhi_tree *parse(const char *text) {
    mhi_tree *tree = NULL;
    mhe_error err = {0};
    mhe_status status = mhi_tree_parse("f.yaml", text, strlen(text), &tree, &err);
    assert_string_equal(err.text, "");
    assert_int_equal(status, MHE_OK);
    return tree;
}

static void assert_refused_n(const char *text, size_t length, const char *message) {
    mhi_tree *tree = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_tree_parse("f.yaml", text, length, &tree, &err), MHE_E_INPUT);
    assert_null(tree);
    assert_string_equal(err.text, message);
}

static void assert_refused(const char *text, const char *message) {
    assert_refused_n(text, strlen(text), message);
}

static const mhi_node *at(const mhi_tree *tree, const char *section, const char *key) {
    const mhi_node *node = mhi_node_find(mhi_tree_root(tree), section);
    return key == NULL ? node : mhi_node_find(node, key);
}

static void nodes_know_lines(void **state) {
    (void)state;
    mhi_tree *tree = parse("# comment\n"
                           "model: {file: a.osim}\n"
                           "\n"
                           "solver:\n"
                           "  tolerance: 1e-4\n"
                           "  text: \"1e-4\"\n"
                           "  none:\n"
                           "costs:\n"
                           "  - plugin: a\n"
                           "  - b\n");
    assert_string_equal(mhi_tree_path(tree), "f.yaml");
    assert_int_equal(mhi_node_count(mhi_tree_root(tree)), 3);
    assert_int_equal(at(tree, "model", NULL)->line, 2);
    assert_int_equal(at(tree, "model", NULL)->kind, MHI_MAPPING);
    assert_string_equal(at(tree, "model", "file")->text, "a.osim");
    assert_int_equal(at(tree, "solver", NULL)->line, 4);
    assert_int_equal(at(tree, "solver", "tolerance")->line, 5);
    assert_int_equal(at(tree, "solver", "tolerance")->quoted, 0);
    assert_int_equal(at(tree, "solver", "text")->quoted, 1);
    assert_int_equal(mhi_node_is_null(at(tree, "solver", "none")), 1);
    assert_int_equal(mhi_node_is_null(at(tree, "solver", "text")), 0);
    assert_int_equal(at(tree, "solver", "none")->line, 7);
    const mhi_node *costs = at(tree, "costs", NULL);
    assert_int_equal(costs->kind, MHI_SEQUENCE);
    assert_int_equal(mhi_node_count(costs), 2);
    assert_int_equal(costs->first->line, 9);
    assert_int_equal(costs->first->next->line, 10);
    assert_null(at(tree, "nothing", NULL));
    assert_null(at(tree, "costs", "plugin"));
    mhi_tree_free(tree);
}

static void empty_file_is_empty_mapping(void **state) {
    (void)state;
    const char *texts[] = {"", "# only a comment\n", "---\n"};
    for (int i = 0; i < 2; i++) {
        mhi_tree *tree = parse(texts[i]);
        assert_int_equal(mhi_tree_root(tree)->kind, MHI_MAPPING);
        assert_int_equal(mhi_node_count(mhi_tree_root(tree)), 0);
        mhi_tree_free(tree);
    }
    mhi_tree *tree = parse(texts[2]); /* an explicit document without content is null */
    assert_int_equal(mhi_node_is_null(mhi_tree_root(tree)), 1);
    mhi_tree_free(tree);
    mhi_tree_free(NULL);
}

static void anchors_are_copied(void **state) {
    (void)state;
    mhi_tree *tree = parse("a: &x {k: 1}\nb: *x\n");
    assert_string_equal(at(tree, "b", "k")->text, "1");
    assert_ptr_not_equal(at(tree, "a", "k"), at(tree, "b", "k"));
    mhe_error err = {0};
    assert_int_equal(mhi_tree_set(tree, "b.k=2", &err), MHE_OK);
    assert_string_equal(at(tree, "a", "k")->text, "1");
    assert_string_equal(at(tree, "b", "k")->text, "2");
    mhi_tree_free(tree);
}

/* As editors of Windows save it. */
static void other_encodings_are_read(void **state) {
    (void)state;
    static const char utf16[] = "\xff\xfe"
                                "a\0:\0 \0\xe9\0\n";
    mhi_tree *tree = parse("\xef\xbb\xbfmodel: {k: 1}\n");
    assert_string_equal(at(tree, "model", "k")->text, "1");
    mhi_tree_free(tree);
    tree = parse("# caf\xe9 \x96\na: {b: \xc9paule}\n");
    assert_string_equal(at(tree, "a", "b")->text, "\xc3\x89paule");
    mhi_tree_free(tree);
    mhe_error err = {0};
    assert_int_equal(mhi_tree_parse("f.yaml", utf16, sizeof utf16, &tree, &err), MHE_OK);
    assert_string_equal(mhi_node_find(mhi_tree_root(tree), "a")->text, "\xc3\xa9");
    mhi_tree_free(tree);
}

static void wrong_yaml_is_refused(void **state) {
    (void)state;
    assert_refused("a: 1\nb: 2\na: 3\n", "f.yaml:3: the key 'a' occurs twice (first in line 1)");
    assert_refused("a:\n  b: 1\n  b: 2\n", "f.yaml:3: the key 'b' occurs twice (first in line 2)");
    assert_refused("a:\n\tb: 1\n",
                   "f.yaml:2: not valid YAML: a tab in the indentation; use blanks");
    assert_refused_n("a: 1\0b", 6,
                     "f.yaml:1: not YAML in UTF-8: control characters are not allowed");
    assert_refused("a: \"x\\0y\"\n", "f.yaml:1: a text holds a NUL character");
    assert_refused("a: 1\n? [b]\n: 2\n",
                   "f.yaml:2: a key must be a plain text, not a list or mapping");
    assert_refused("a: &x {b: 1}\nc: {<<: *x}\n", "f.yaml:2: merge keys ('<<') are not supported");
    assert_refused("a: !include b\n", "f.yaml:1: the tag '!include' is not supported");
    assert_refused("a: 1\n---\nb: 2\n", "f.yaml:3: a second YAML document starts here");
    assert_refused("a: *nobody\n", "f.yaml:1: not valid YAML: found undefined alias");
    assert_refused("a:\n  - [1, 2\nb: 3\n",
                   "f.yaml:3: not valid YAML: while parsing a flow sequence that starts in line "
                   "2: did not find expected ',' or ']'");
}

static void quoted_keys_are_text(void **state) {
    (void)state;
    mhi_tree *tree = parse("'<<': {\"~\": 1}\n");
    assert_string_equal(at(tree, "<<", "~")->text, "1");
    mhi_tree_free(tree);
}

static void endless_trees_are_refused(void **state) {
    (void)state;
    assert_refused("a: &x [*x]\n",
                   "f.yaml:1: nested deeper than 64 levels, or an alias inside its own anchor");
    char text[1024] = "a0: &a0 [1,1,1,1,1,1,1,1,1,1]\n";
    for (int i = 1; i < 9; i++) { /* 10^9 values */
        char line[100];
        (void)snprintf(line, sizeof line, "a%d: &a%d [*a%d,*a%d,*a%d,*a%d,*a%d,*a%d,*a%d,*a%d]\n",
                       i, i, i - 1, i - 1, i - 1, i - 1, i - 1, i - 1, i - 1, i - 1);
        strcat(text, line);
    }
    assert_refused(text, "f.yaml:1: more than 10000 values, aliases expanded");
    const size_t megabyte = 1 << 20; /* refused without reading it all */
    char *deep = malloc(megabyte);
    assert_non_null(deep);
    memset(deep, '[', megabyte);
    assert_refused_n(deep, megabyte,
                     "f.yaml:1: nested deeper than 64 levels, or an alias inside its own anchor");
    memset(deep, ',', megabyte);
    for (size_t i = 0; i + 1 < megabyte; i += 2) {
        deep[i] = i == 0 ? '[' : '1';
    }
    deep[1] = ' ';
    assert_refused_n(deep, megabyte, "f.yaml:1: more than 10000 values, aliases expanded");
    free(deep);
    char key[400];
    memset(key, 'k', 300);
    memcpy(key + 300, ": 1", 4);
    assert_refused(key, "f.yaml:1: a key is longer than 160 bytes");
}

static void assert_set(mhi_tree *tree, const char *assignment) {
    mhe_error err = {0};
    mhe_status status = mhi_tree_set(tree, assignment, &err);
    assert_string_equal(err.text, "");
    assert_int_equal(status, MHE_OK);
}

static void set_replaces_and_adds(void **state) {
    (void)state;
    mhi_tree *tree = parse("solver:\n  tolerance: 1e-4\n  last: 1\n"
                           "costs: [{plugin: a}, {plugin: b}]\nempty:\n");
    assert_set(tree, "solver.tolerance=1e-3");
    assert_string_equal(at(tree, "solver", "tolerance")->text, "1e-3");
    assert_int_equal(at(tree, "solver", "tolerance")->line, 0);
    assert_string_equal(at(tree, "solver", "last")->text, "1");
    assert_set(tree, "costs.1.markers=5");
    const mhi_node *second = at(tree, "costs", NULL)->first->next;
    assert_string_equal(mhi_node_find(second, "markers")->text, "5");
    assert_string_equal(mhi_node_find(second, "plugin")->text, "b");
    assert_set(tree, "costs.2=c");
    assert_int_equal(mhi_node_count(at(tree, "costs", NULL)), 3);
    assert_string_equal(at(tree, "costs", NULL)->first->next->next->text, "c");
    assert_set(tree, "costs.0={plugin: z}");
    assert_string_equal(mhi_node_find(at(tree, "costs", NULL)->first, "plugin")->text, "z");
    assert_ptr_equal(at(tree, "costs", NULL)->first->next, second);
    assert_set(tree, "initial.q=[0.1, -2]");
    assert_int_equal(at(tree, "initial", "q")->kind, MHI_SEQUENCE);
    assert_string_equal(at(tree, "initial", "q")->first->next->text, "-2");
    assert_set(tree, "empty.a.b=x=y");
    assert_string_equal(mhi_node_find(at(tree, "empty", "a"), "b")->text, "x=y");
    assert_set(tree, "data.emg=");
    assert_int_equal(mhi_node_is_null(at(tree, "data", "emg")), 1);
    assert_set(tree, "data.emg=\"a b.sto\"");
    assert_string_equal(at(tree, "data", "emg")->text, "a b.sto");
    mhi_tree_free(tree);
}

static void assert_set_refused(mhi_tree *tree, const char *assignment, mhe_status code,
                               const char *message) {
    mhe_error err = {0};
    assert_int_equal(mhi_tree_set(tree, assignment, &err), code);
    assert_string_equal(err.text, message);
}

static void wrong_set_is_refused(void **state) {
    (void)state;
    mhi_tree *tree = parse("solver: {tolerance: 1e-4}\ncosts: [a, b]\n");
    assert_set_refused(tree, "solver.tolerance", MHE_E_CONFIG,
                       "--set solver.tolerance: not of the form path.to.key=value");
    assert_set_refused(tree, "=1", MHE_E_CONFIG, "--set =1: not of the form path.to.key=value");
    assert_set_refused(tree, "", MHE_E_CONFIG, "--set : not of the form path.to.key=value");
    assert_set_refused(tree, "a..b=1", MHE_E_CONFIG, "--set a..b=1: the path has an empty step");
    assert_set_refused(tree, "a.=1", MHE_E_CONFIG, "--set a.=1: the path has an empty step");
    assert_set_refused(tree, "solver.tolerance.x=1", MHE_E_CONFIG,
                       "--set solver.tolerance.x=1: there is nothing below the value '1e-4': 'x' "
                       "has no place");
    assert_set_refused(tree, "costs.3=c", MHE_E_CONFIG,
                       "--set costs.3=c: '3' is no entry of a list of 2 (0 is the first, 2 "
                       "appends)");
    assert_set_refused(tree, "costs.plugin=c", MHE_E_CONFIG,
                       "--set costs.plugin=c: 'plugin' is no entry of a list of 2 (0 is the "
                       "first, 2 appends)");
    assert_set_refused(tree, "costs.99999999999999999999=c", MHE_E_CONFIG,
                       "--set costs.99999999999999999999=c: '99999999999999999999' is no entry of "
                       "a list of 2 (0 is the first, 2 appends)");
    assert_set_refused(tree, "solver.x=[1", MHE_E_INPUT,
                       "--set solver.x=[1: not valid YAML: while parsing a flow sequence: did not "
                       "find expected ',' or ']'");
    assert_set_refused(tree, "x={a: 1, a: 2}", MHE_E_INPUT,
                       "--set x={a: 1, a: 2}: the key 'a' occurs twice");
    assert_set_refused(tree, "a.\xff=1", MHE_E_CONFIG,
                       "--set a.\xff=1: the path has a step that is not UTF-8 or over 160 bytes "
                       "long");
    char deep[200] = "a";
    for (int i = 0; i < 64; i++) {
        strcat(deep, ".a");
    }
    strcat(deep, "=1");
    mhe_error err = {0};
    assert_int_equal(mhi_tree_set(tree, deep, &err), MHE_E_CONFIG);
    assert_non_null(strstr(err.text, "the path has more than 64 steps"));
    /* nothing of all this has changed the tree */
    assert_int_equal(mhi_node_count(mhi_tree_root(tree)), 2);
    assert_int_equal(mhi_node_count(at(tree, "solver", NULL)), 1);
    assert_int_equal(mhi_node_count(at(tree, "costs", NULL)), 2);
    mhi_tree_free(tree);
}

static void messages_point(void **state) {
    (void)state;
    mhi_tree *tree = parse("a: 1\nb: 2\n");
    mhe_error err = {0};
    assert_int_equal(mhi_fail_at(&err, MHE_E_CONFIG, tree, at(tree, "b", NULL), "bad %d", 7),
                     MHE_E_CONFIG);
    assert_string_equal(err.text, "f.yaml:2: bad 7");
    mhi_fail_at(&err, MHE_E_CONFIG, tree, NULL, "two\nlines");
    assert_string_equal(err.text, "f.yaml: two?lines");
    mhi_fail_at(&err, MHE_E_CONFIG, NULL, NULL, "bare");
    assert_string_equal(err.text, "bare");
    assert_set(tree, "b=3");
    mhi_fail_at(&err, MHE_E_CONFIG, tree, at(tree, "b", NULL), "bad");
    assert_string_equal(err.text, "--set: bad");
    assert_int_equal(mhi_fail_at(NULL, MHE_E_CONFIG, tree, NULL, "no one listens"), MHE_E_CONFIG);
    mhi_tree_free(tree);
}

static void unreadable_files(void **state) {
    (void)state;
    mhi_tree *tree = NULL;
    mhe_error err = {0};
    assert_int_equal(mhi_tree_read("/nowhere/f.yaml", &tree, &err), MHE_E_INPUT);
    assert_string_equal(err.text, "/nowhere/f.yaml: cannot be opened: No such file or directory");
    assert_int_equal(mhi_tree_read("/tmp", &tree, &err), MHE_E_INPUT);
    assert_non_null(strstr(err.text, "/tmp: "));
    assert_null(tree);
}

/* What is written reads back as the same: kinds, texts, what is in quotes. */
static void nodes_are_written(void **state) {
    (void)state;
    static const char text[] = "{a: [1, -2.5e3, .inf], b: {c: \"7\", 'd e': '1, 2', f: [], g: {}}, "
                               "h: 'it''s #1', i: null, j: yes, k: '', l: x..y}\n";
    mhi_tree *tree = parse(text);
    mhi_text once = {0}, twice = {0};
    mhi_node_write(mhi_tree_root(tree), &once);
    mhi_tree *again = parse(once.data);
    mhi_node_write(mhi_tree_root(again), &twice);
    assert_string_equal(once.data, twice.data);
    const mhi_node *c = at(again, "b", "c"), *d = at(again, "b", "d e");
    assert_string_equal(c->text, "7");
    assert_true(c->quoted);
    assert_string_equal(d->text, "1, 2");
    assert_string_equal(at(again, "h", NULL)->text, "it's #1");
    assert_true(mhi_node_is_null(at(again, "i", NULL)));
    assert_false(mhi_node_is_null(at(again, "k", NULL)));
    assert_false(at(again, "j", NULL)->quoted);
    assert_int_equal(mhi_node_count(at(again, "a", NULL)), 3);
    assert_string_equal(at(again, "a", NULL)->first->next->text, "-2.5e3");
    assert_int_equal(at(again, "b", "f")->kind, MHI_SEQUENCE);
    assert_int_equal(at(again, "b", "g")->kind, MHI_MAPPING);
    mhi_text_free(&once);
    mhi_text_free(&twice);
    mhi_tree_free(tree);
    mhi_tree_free(again);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nodes_know_lines),          cmocka_unit_test(empty_file_is_empty_mapping),
        cmocka_unit_test(anchors_are_copied),        cmocka_unit_test(quoted_keys_are_text),
        cmocka_unit_test(other_encodings_are_read),  cmocka_unit_test(wrong_yaml_is_refused),
        cmocka_unit_test(endless_trees_are_refused), cmocka_unit_test(set_replaces_and_adds),
        cmocka_unit_test(wrong_set_is_refused),      cmocka_unit_test(messages_point),
        cmocka_unit_test(unreadable_files),          cmocka_unit_test(nodes_are_written),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
