/* SPDX-License-Identifier: Apache-2.0 */
/* tree.h: a YAML file as a tree whose every node knows its line. */
#ifndef MHI_TREE_H
#define MHI_TREE_H

#include "base/text.h"

#include <mhe/abi.h>

#define MHI_SCALAR 0
#define MHI_SEQUENCE 1
#define MHI_MAPPING 2

typedef struct mhi_node {
    int32_t kind;           /* MHI_SCALAR ... */
    int32_t line;           /* 1-based, of the key in a mapping; 0: set on the command line */
    int32_t quoted;         /* scalar in quotes: always text */
    const char *key;        /* in a mapping; else NULL */
    const char *text;       /* scalar; else NULL */
    struct mhi_node *first; /* children in the file's order */
    struct mhi_node *next;
} mhi_node;

typedef struct mhi_tree mhi_tree; /* owns all nodes and texts */

/* Reads a file, or a text that is called `name` in messages. MHE_E_INPUT: unreadable, not YAML,
 * duplicate key, aliases that would grow without end; the message starts with "file:line: ". [cold]
 */
mhe_status mhi_tree_read(const char *path, mhi_tree **tree, mhe_error *err);
mhe_status mhi_tree_parse(const char *name, const char *text, size_t length, mhi_tree **tree,
                          mhe_error *err);
void mhi_tree_free(mhi_tree *tree);

mhi_node *mhi_tree_root(const mhi_tree *tree);   /* never NULL: an empty file is an empty mapping */
const char *mhi_tree_path(const mhi_tree *tree); /* for messages */
/* "--set a.b.2.c=value": replaces or adds; the value is parsed as YAML; list entries by number from
 * 0, the number behind the last one appends. MHE_E_CONFIG: no such place, or not "path=value";
 * MHE_E_INPUT: the value is not YAML. The tree is then as it was. [cold] */
mhe_status mhi_tree_set(mhi_tree *tree, const char *assignment, mhe_error *err);

mhi_node *mhi_node_find(const mhi_node *mapping, const char *key); /* NULL if absent */
int32_t mhi_node_count(const mhi_node *node);                      /* number of children */
/* 1 for a key without a value, ~ and null (not in quotes). */
int32_t mhi_node_is_null(const mhi_node *node);
/* Appends the node on one line, without its key: YAML that reads back the same. */
void mhi_node_write(const mhi_node *node, mhi_text *out);
/* Turns a scalar `text` into the mapping {key: text}, and an absent value into an empty mapping;
 * MHE_E_MEMORY. Anything else stays as it is. */
mhe_status mhi_node_expand(mhi_tree *tree, mhi_node *node, const char *key, mhe_error *err);

/* Fails with "file:line: " ("--set: ", "file: " where `node` is NULL, nothing where `tree` is NULL)
 * in front of the message; control characters in it become '?'. */
MHE_PRINTF(5, 6)
mhe_status mhi_fail_at(mhe_error *err, mhe_status code, const mhi_tree *tree, const mhi_node *node,
                       const char *format, ...);

#endif
