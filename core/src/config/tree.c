/* SPDX-License-Identifier: Apache-2.0 */
/* tree.c: reading a configuration file, changing it from the command line, pointing into it. */
#include "config/tree.h"

#include "base/arena.h"
#include "config/tree_yaml.h"
#include "config/yaml_scalar.h"
#include "io/slurp.h"

#include <stdlib.h>
#include <string.h>

#define MAX_BYTES ((size_t)1 << 20) /* of a file; far above any real configuration */

struct mhi_tree {
    mhi_arena arena;
    const char *path;
    mhi_node *root;
};

/* ---- reading ---- */

mhe_status mhi_tree_parse(const char *name, const char *text, size_t length, mhi_tree **out,
                          mhe_error *err) {
    *out = NULL;
    mhi_tree *tree = calloc(1, sizeof *tree);
    if (tree == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
    }
    mhe_status status = mhi_yaml_parse(name, text, length, 1, &tree->arena, &tree->root, err);
    if (status == MHE_OK) {
        tree->path = mhi_arena_text(&tree->arena, name);
        if (tree->root == NULL) {
            tree->root = MHI_TAKE(&tree->arena, mhi_node, 1);
            if (tree->root != NULL) {
                *tree->root = (mhi_node){.kind = MHI_MAPPING, .line = 1};
            }
        }
        if (tree->path == NULL || tree->root == NULL) {
            status = mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
        }
    }
    if (status != MHE_OK) {
        mhi_tree_free(tree);
        return status;
    }
    *out = tree;
    return MHE_OK;
}

mhe_status mhi_tree_read(const char *path, mhi_tree **tree, mhe_error *err) {
    char *text = NULL;
    size_t length = 0;
    *tree = NULL;
    mhe_status status = mhi_slurp(path, &text, &length, err);
    if (status == MHE_OK) {
        status = length > MAX_BYTES
                     ? mhe_fail(err, MHE_E_INPUT, "%s: larger than %zu bytes: not a configuration",
                                path, MAX_BYTES)
                     : mhi_tree_parse(path, text, length, tree, err);
    }
    free(text);
    return status;
}

void mhi_tree_free(mhi_tree *tree) {
    if (tree != NULL) {
        mhi_arena_free(&tree->arena);
        free(tree);
    }
}

/* ---- looking ---- */

mhi_node *mhi_tree_root(const mhi_tree *tree) {
    return tree->root;
}

const char *mhi_tree_path(const mhi_tree *tree) {
    return tree->path;
}

mhi_node *mhi_node_find(const mhi_node *mapping, const char *key) {
    if (mapping == NULL || mapping->kind != MHI_MAPPING) {
        return NULL;
    }
    mhi_node *child = mapping->first;
    while (child != NULL && strcmp(child->key, key) != 0) {
        child = child->next;
    }
    return child;
}

int32_t mhi_node_count(const mhi_node *node) {
    int32_t n = 0;
    for (const mhi_node *child = node->first; child != NULL; child = child->next) {
        n++;
    }
    return n;
}

int32_t mhi_node_is_null(const mhi_node *node) {
    static const char *const spellings[] = {"", "~", "null", "Null", "NULL"};
    if (node->kind != MHI_SCALAR || node->quoted) {
        return 0;
    }
    for (size_t i = 0; i < sizeof spellings / sizeof spellings[0]; i++) {
        if (strcmp(node->text, spellings[i]) == 0) {
            return 1;
        }
    }
    return 0;
}

/* ---- changing ---- */

static void make_mapping(mhi_node *node) {
    node->kind = MHI_MAPPING;
    node->text = NULL;
    node->quoted = 0;
}

mhe_status mhi_node_expand(mhi_tree *tree, mhi_node *node, const char *key, mhe_error *err) {
    if (node->kind != MHI_SCALAR) {
        return MHE_OK;
    }
    if (!mhi_node_is_null(node)) {
        mhi_node *child = MHI_TAKE(&tree->arena, mhi_node, 1);
        const char *name = mhi_arena_text(&tree->arena, key);
        if (child == NULL || name == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", tree->path);
        }
        *child = *node;
        child->key = name;
        child->next = NULL;
        node->first = child;
    }
    make_mapping(node);
    return MHE_OK;
}

struct assignment {
    const char *whole;           /* for messages */
    char *steps[MHI_TREE_DEPTH]; /* of the path, cut at the dots */
    int n_steps;
    mhi_node *value;
};

MHE_PRINTF(3, 4)
static mhe_status refuse(mhe_error *err, const struct assignment *set, const char *format, ...) {
    char text[256];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return mhi_fail_at(err, MHE_E_CONFIG, NULL, NULL, "--set %.200s: %s", set->whole, text);
}

static mhe_status cut_path(struct assignment *set, char *path, mhe_error *err) {
    for (char *step = path; step != NULL;) {
        char *dot = strchr(step, '.');
        if (dot != NULL) {
            *dot = '\0';
        }
        if (*step == '\0') {
            return refuse(err, set, "the path has an empty step");
        }
        if (strlen(step) > MHI_TREE_KEY || !mhi_yaml_is_utf8(step)) {
            return refuse(err, set, "the path has a step that is not UTF-8 or over %d bytes long",
                          MHI_TREE_KEY);
        }
        if (set->n_steps == MHI_TREE_DEPTH) {
            return refuse(err, set, "the path has more than %d steps", MHI_TREE_DEPTH);
        }
        set->steps[set->n_steps++] = step;
        step = dot == NULL ? NULL : dot + 1;
    }
    return MHE_OK;
}

/* Where the child that `step` names hangs or, if there is none, is to be hung. */
static mhe_status find_link(const struct assignment *set, mhi_node *node, const char *step,
                            mhi_node ***link, mhe_error *err) {
    *link = &node->first;
    if (node->kind == MHI_MAPPING) {
        while (**link != NULL && strcmp((**link)->key, step) != 0) {
            *link = &(**link)->next;
        }
        return MHE_OK;
    }
    if (node->kind == MHI_SCALAR) {
        return refuse(err, set, "there is nothing below the value '%.60s': '%.60s' has no place",
                      node->text, step);
    }
    int32_t n = mhi_node_count(node);
    int digits = step[strspn(step, "0123456789")] == '\0' && strlen(step) < 9;
    if (!digits || strtol(step, NULL, 10) > n) {
        return refuse(err, set, "'%.60s' is no entry of a list of %d (0 is the first, %d appends)",
                      step, (int)n, (int)n);
    }
    for (long i = strtol(step, NULL, 10); i > 0; i--) {
        *link = &(**link)->next;
    }
    return MHE_OK;
}

static mhe_status hang(mhi_tree *tree, const struct assignment *set, mhe_error *err) {
    mhi_node *node = tree->root;
    mhi_node **link = NULL;
    for (int i = 0;; i++) {
        if (mhi_node_is_null(node)) {
            make_mapping(node);
        }
        mhe_status status = find_link(set, node, set->steps[i], &link, err);
        if (status != MHE_OK) {
            return status;
        }
        int last = i == set->n_steps - 1;
        mhi_node *child = last            ? set->value
                          : *link != NULL ? *link
                                          : MHI_TAKE(&tree->arena, mhi_node, 1);
        if (child == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "--set: out of memory");
        }
        if (child != *link) {
            child->kind = last ? child->kind : MHI_MAPPING;
            child->key = node->kind == MHI_MAPPING ? set->steps[i] : NULL;
            child->next = *link == NULL ? NULL : (*link)->next;
            *link = child;
        }
        if (last) {
            return MHE_OK;
        }
        node = child;
    }
}

mhe_status mhi_tree_set(mhi_tree *tree, const char *assignment, mhe_error *err) {
    struct assignment set = {.whole = assignment};
    const char *equals = strchr(assignment, '=');
    if (equals == NULL || equals == assignment) {
        return refuse(err, &set, "not of the form path.to.key=value");
    }
    char *path = mhi_arena_text_n(&tree->arena, assignment, (size_t)(equals - assignment));
    char *name = mhi_arena_format(&tree->arena, "--set %.200s", assignment);
    if (path == NULL || name == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "--set: out of memory");
    }
    mhe_status status = cut_path(&set, path, err);
    if (status != MHE_OK) {
        return status;
    }
    status = mhi_yaml_parse(name, equals + 1, strlen(equals + 1), 0, &tree->arena, &set.value, err);
    if (status != MHE_OK) {
        return status;
    }
    if (set.value == NULL) { /* "path=": no value */
        set.value = MHI_TAKE(&tree->arena, mhi_node, 1);
        if (set.value == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "--set: out of memory");
        }
        set.value->text = "";
    }
    return hang(tree, &set, err);
}

/* ---- pointing ---- */

mhe_status mhi_fail_at(mhe_error *err, mhe_status code, const mhi_tree *tree, const mhi_node *node,
                       const char *format, ...) {
    char text[MHE_ERROR_TEXT];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    for (char *c = text; *c != '\0'; c++) {
        if ((unsigned char)*c < ' ' || *c == 127) {
            *c = '?';
        }
    }
    if (tree == NULL) {
        return mhe_fail(err, code, "%s", text);
    }
    if (node == NULL) {
        return mhe_fail(err, code, "%s: %s", tree->path, text);
    }
    if (node->line == 0) {
        return mhe_fail(err, code, "--set: %s", text);
    }
    return mhe_fail(err, code, "%s:%d: %s", tree->path, (int)node->line, text);
}
