/* SPDX-License-Identifier: Apache-2.0 */
#include "config/defaults.h"

#include "config/run.h"
#include "plugin/place.h"

#include <string.h>
#include <unistd.h>

/* The first of the places where there is such a file; NULL: none. */
static mhe_status find_file(mhi_arena *arena, const char **path, mhe_error *err) {
    mhi_places places;
    *path = NULL;
    mhe_status status = mhi_places_of_data(arena, "defaults.yaml", &places, err);
    for (int32_t i = 0; i < places.n && status == MHE_OK && *path == NULL; i++) {
        *path = access(places.path[i], F_OK) == 0 ? places.path[i] : NULL;
    }
    return status;
}

/* An id, or a list of them. */
static int32_t names_plugins(const mhi_node *node, int32_t list) {
    if (!list || node->kind != MHI_SEQUENCE) {
        return node->kind == MHI_SCALAR && !mhi_node_is_null(node);
    }
    for (const mhi_node *entry = node->first; entry != NULL; entry = entry->next) {
        if (entry->kind != MHI_SCALAR || mhi_node_is_null(entry)) {
            return 0;
        }
    }
    return 1;
}

/* Only sections with a plugin, each with the id alone; of forces a list; and what reads
 * data.external_loads. */
static mhe_status check(const mhi_tree *tree, mhe_error *err) {
    int32_t n = 0;
    const mhi_section *sections = mhi_run_sections(&n);
    const mhi_node *root = mhi_tree_root(tree);
    for (const mhi_node *node = root->kind == MHI_MAPPING ? root->first : root; node != NULL;
         node = node->next) {
        const int32_t forces = node->key != NULL && strcmp(node->key, "forces") == 0;
        int32_t known = node->key != NULL && strcmp(node->key, "external_loads") == 0;
        for (int32_t i = 0; i < n && node->key != NULL; i++) {
            known |= sections[i].iface != NULL && sections[i].offset != 0 &&
                     strcmp(sections[i].name, node->key) == 0;
        }
        if (!known || !names_plugins(node, forces)) {
            return mhi_fail_at(err, MHE_E_CONFIG, tree, node,
                               "defaults are lines like 'solver: ID', one a section that names one "
                               "plugin");
        }
    }
    return MHE_OK;
}

mhe_status mhi_default_plugins(const char *name, mhi_arena *arena, const char ***ids, int32_t *n,
                               mhe_error *err) {
    const char *path = NULL;
    mhi_tree *tree = NULL;
    *ids = NULL;
    *n = 0;
    mhe_status status = find_file(arena, &path, err);
    if (status != MHE_OK || path == NULL) {
        return status;
    }
    status = mhi_tree_read(path, &tree, err);
    if (status == MHE_OK) {
        status = check(tree, err);
    }
    const mhi_node *node = status == MHE_OK ? mhi_node_find(mhi_tree_root(tree), name) : NULL;
    const int32_t list = node != NULL && node->kind == MHI_SEQUENCE;
    *n = node == NULL ? 0 : list ? mhi_node_count(node) : 1;
    *ids = MHI_TAKE(arena, const char *, *n);
    if (*ids == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    node = list ? node->first : node;
    for (int32_t i = 0; i < *n && status == MHE_OK; i++, node = node->next) {
        (*ids)[i] = mhi_arena_text(arena, node->text);
        status = (*ids)[i] == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    mhi_tree_free(tree);
    return status;
}

mhe_status mhi_default_plugin(const char *section, mhi_arena *arena, const char **id,
                              mhe_error *err) {
    const char **ids = NULL;
    int32_t n = 0;
    const mhe_status status = mhi_default_plugins(section, arena, &ids, &n, err);
    *id = status == MHE_OK && n > 0 ? ids[0] : NULL;
    return status;
}
