/* SPDX-License-Identifier: Apache-2.0 */
/* run_tree.c: the file of a run, its name and folder, and the assignments from the command line. */
#include "config/run_sections.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

/* "solver: ID" is short for "solver: {plugin: ID}". */
static mhe_status expand_short_forms(mhi_run *run, mhe_error *err) {
    int32_t n = 0;
    const mhi_section *sections = mhi_run_sections(&n);
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < n && status == MHE_OK; i++) {
        mhi_node *node = mhi_node_find(mhi_tree_root(run->tree), sections[i].name);
        if (node == NULL || sections[i].iface == NULL) {
            continue;
        }
        if (strcmp(sections[i].iface, MHE_COST_IFACE) != 0) {
            status = mhi_node_expand(run->tree, node, "plugin", err);
            continue;
        }
        for (mhi_node *cost = node->kind == MHI_SEQUENCE ? node->first : NULL;
             cost != NULL && status == MHE_OK; cost = cost->next) {
            status = mhi_node_expand(run->tree, cost, "plugin", err);
        }
    }
    return status;
}

/* The folder is made absolute, so that a resolved configuration holds wherever it is read. */
static mhe_status name_run(mhi_run *run, const char *path, mhe_error *err) {
    const char *slash = strrchr(path, '/');
    const char *base = slash == NULL ? path : slash + 1;
    const char *dot = strrchr(base, '.');
    size_t n_folder = slash == NULL ? 0 : slash == path ? 1 : (size_t)(slash - path);
    run->path = mhi_arena_text(&run->arena, path);
    run->name = mhi_arena_text_n(&run->arena, base,
                                 dot == NULL || dot == base ? strlen(base) : (size_t)(dot - base));
    if (path[0] == '/') {
        run->dir = mhi_arena_text_n(&run->arena, path, n_folder);
    } else {
        char here[4096];
        if (getcwd(here, sizeof here) == NULL) {
            return mhe_fail(err, MHE_E_INPUT, "the working directory is not known: %s",
                            strerror(errno));
        }
        run->dir = n_folder == 0
                       ? mhi_arena_text(&run->arena, here)
                       : mhi_arena_format(&run->arena, "%s/%.*s", here, (int)n_folder, path);
    }
    return run->path == NULL || run->name == NULL || run->dir == NULL ? no_memory(err) : MHE_OK;
}

mhe_status mhi_run_read_tree(mhi_run *run, const char *path, const char *const *set, int32_t n_set,
                             mhe_error *err) {
    mhe_status status = mhi_tree_read(path, &run->tree, err);
    if (status == MHE_OK) {
        status = name_run(run, path, err);
    }
    if (status == MHE_OK && mhi_tree_root(run->tree)->kind != MHI_MAPPING) {
        status = mhi_fail_at(err, MHE_E_CONFIG, run->tree, mhi_tree_root(run->tree),
                             "a configuration is a mapping of sections (model, costs, ...)");
    }
    if (status == MHE_OK) {
        status = expand_short_forms(run, err);
    }
    for (int32_t i = 0; i < n_set && status == MHE_OK; i++) {
        status = mhi_tree_set(run->tree, set[i], err);
        if (status == MHE_OK) {
            status = expand_short_forms(run, err);
        }
    }
    return status;
}
