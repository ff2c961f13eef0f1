/* SPDX-License-Identifier: Apache-2.0 */
/* tree_write.c: a node as YAML on one line. */
#include "config/tree.h"
#include "config/yaml_scalar.h"

#include <string.h>

/* Plain text that has no meaning for YAML, inside of brackets neither, stays as it is: a number. */
static void write_scalar(const mhi_node *node, mhi_text *out) {
    const char *text = node->text;
    if (mhi_node_is_null(node)) {
        mhi_text_add(out, "null");
    } else if (!node->quoted && text[strcspn(text, ",[]{}:#&*!|>'\"%@`\\ \t\n")] == '\0') {
        mhi_text_add(out, "%s", text);
    } else {
        mhi_yaml_text(text, out);
    }
}

void mhi_node_write(const mhi_node *node, mhi_text *out) {
    if (node->kind == MHI_SCALAR) {
        write_scalar(node, out);
        return;
    }
    const int mapping = node->kind == MHI_MAPPING;
    mhi_text_add(out, mapping ? "{" : "[");
    for (const mhi_node *child = node->first; child != NULL; child = child->next) {
        if (child != node->first) {
            mhi_text_add(out, ", ");
        }
        if (mapping) {
            mhi_yaml_text(child->key, out);
            mhi_text_add(out, ": ");
        }
        mhi_node_write(child, out);
    }
    mhi_text_add(out, mapping ? "}" : "]");
}
