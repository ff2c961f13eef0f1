/* SPDX-License-Identifier: Apache-2.0 */
/* tree_yaml.h: from YAML text to nodes; the only place that knows libyaml. */
#ifndef MHI_TREE_YAML_H
#define MHI_TREE_YAML_H

#include "base/arena.h"
#include "config/tree.h"

#define MHI_TREE_DEPTH 64 /* deepest nesting */
#define MHI_TREE_KEY 160  /* longest key in bytes: six times that must stay below libyaml's 1024 */

/* Parses one document [length], UTF-8 or what io/decode.h makes it of. Nodes and their texts live
 * in `arena`; without any content *root becomes NULL. Messages start with "name:line: ". With
 * `numbered` 0 (a text from the command line) nodes have line 0 and messages start with "name: ".
 * MHE_E_INPUT: not YAML; a duplicate key; tags, merge keys, keys that are not plain text; too deep
 * or too large. [cold] */
mhe_status mhi_yaml_parse(const char *name, const char *text, size_t length, int32_t numbered,
                          mhi_arena *arena, mhi_node **root, mhe_error *err);

#endif
