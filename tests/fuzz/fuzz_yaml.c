/* SPDX-License-Identifier: Apache-2.0 */
/* fuzz_yaml.c: YAML text -> tree -> --set -> options -> YAML again.
 *
 * The input is a document; lines behind a line "%%" are assignments as --set takes them. Whatever
 * is accepted must be written as YAML that is accepted and written the same. */
#include "base/arena.h"
#include "config/options.h"
#include "fuzz.h"

#include <stdlib.h>
#include <string.h>

struct sample {
    double real;
    int32_t count, flag, method;
    const char *text, *path;
    mhe_real_list reals;
    mhe_text_list texts;
    mhe_text_map map;
};

static const mhe_option options[] = {
    MHE_OPT_REAL(struct sample, real, 0.5, -1e300, 1e300, "1", "A number."),
    MHE_OPT_INT(struct sample, count, 15, INT32_MIN, INT32_MAX, "1", "A count."),
    MHE_OPT_BOOL(struct sample, flag, 0, "A switch."),
    MHE_OPT_ENUM(struct sample, method, "gauss", "gauss|rk4", "A choice."),
    MHE_OPT_TEXT(struct sample, text, 0, "abc", "A text."),
    MHE_OPT_PATH(struct sample, path, 0, "A path."),
    MHE_OPT_REALS(struct sample, reals, 0, -1e300, 1e300, "m", "Numbers."),
    MHE_OPT_TEXTS(struct sample, texts, 0, "Texts."),
    MHE_OPT_MAP(struct sample, map, 0, "Key to text."),
};
#define N_OPTIONS ((int32_t)(sizeof options / sizeof options[0]))

static void require(int condition) {
    if (!condition) {
        abort();
    }
}

/* The options of `tree` as YAML; 0 where they are refused. */
static int resolve(const mhi_tree *tree, mhi_text *out) {
    struct sample sample = {0};
    mhi_arena arena = {0};
    mhe_error err = {0};
    mhe_status status = mhi_options_fill(options, N_OPTIONS, tree, mhi_tree_root(tree), NULL, 0,
                                         "fuzz", "/d", &arena, &sample, &err);
    require((status == MHE_OK) == (err.text[0] == '\0'));
    require(strpbrk(err.text, "\n\r") == NULL);
    if (status == MHE_OK) {
        mhi_options_write(options, N_OPTIONS, &sample, 0, out);
    }
    mhi_arena_free(&arena);
    return status == MHE_OK;
}

static void check_round_trip(const mhi_text *text) {
    mhi_tree *tree = NULL;
    mhi_text again = {0};
    require(mhi_tree_parse("again", text->data, text->length, &tree, NULL) == MHE_OK);
    require(resolve(tree, &again));
    require(strcmp(text->data, again.data) == 0);
    mhi_text_free(&again);
    mhi_tree_free(tree);
}

static void set_all(mhi_tree *tree, char *lines) {
    for (char *line = lines; line != NULL;) {
        char *end = strchr(line, '\n');
        if (end != NULL) {
            *end = '\0';
        }
        mhe_error err = {0};
        mhe_status status = mhi_tree_set(tree, line, &err);
        require((status == MHE_OK) == (err.text[0] == '\0'));
        line = end == NULL ? NULL : end + 1;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    char *text = calloc(size + 1, 1);
    require(text != NULL);
    memcpy(text, data, size);
    char *lines = strstr(text, "\n%%\n");
    size_t length = lines == NULL ? size : (size_t)(lines - text);
    mhi_tree *tree = NULL;
    mhe_error err = {0};
    mhe_status status = mhi_tree_parse("fuzz", text, length, &tree, &err);
    require((status == MHE_OK) == (tree != NULL));
    require((status == MHE_OK) == (err.text[0] == '\0'));
    if (tree != NULL) {
        set_all(tree, lines == NULL ? NULL : lines + 4);
        mhi_text out = {0};
        if (resolve(tree, &out)) {
            check_round_trip(&out);
        }
        mhi_text_free(&out);
        mhi_tree_free(tree);
    }
    free(text);
    return 0;
}
