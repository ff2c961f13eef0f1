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
        if (!sections[i].list) {
            status = mhi_node_expand(run->tree, node, "plugin", err);
            continue;
        }
        for (mhi_node *entry = node->kind == MHI_SEQUENCE ? node->first : NULL;
             entry != NULL && status == MHE_OK; entry = entry->next) {
            status = mhi_node_expand(run->tree, entry, "plugin", err);
        }
    }
    return status;
}

/* `folder` from the working directory, which is ours where `folder` is empty. */
static mhe_status set_folder(mhi_run *run, const char *folder, size_t length, mhe_error *err) {
    char here[4096];
    if (length > 0 && folder[0] == '/') {
        run->dir = mhi_arena_text_n(&run->arena, folder, length);
    } else if (getcwd(here, sizeof here) == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "the working directory is not known: %s",
                        strerror(errno));
    } else {
        run->dir = length == 0
                       ? mhi_arena_text(&run->arena, here)
                       : mhi_arena_format(&run->arena, "%s/%.*s", here, (int)length, folder);
    }
    return run->dir == NULL ? no_memory(err) : MHE_OK;
}

/* The folder is made absolute, so that a resolved configuration holds wherever it is read. */
static mhe_status name_run(mhi_run *run, const mhi_run_text *text, const char *path,
                           mhe_error *err) {
    const char *slash = strrchr(path, '/');
    const char *base = slash == NULL ? path : slash + 1;
    const char *dot = strrchr(base, '.');
    const size_t n_base = dot == NULL || dot == base ? strlen(base) : (size_t)(dot - base);
    run->path = mhi_arena_text(&run->arena, path);
    run->name = mhi_arena_text_n(&run->arena, base, n_base);
    if (run->path == NULL || run->name == NULL) {
        return no_memory(err);
    }
    if (text != NULL) {
        const char *folder = text->folder == NULL ? "" : text->folder;
        return set_folder(run, folder, strlen(folder), err);
    }
    const size_t n_folder = slash == NULL ? 0 : slash == path ? 1 : (size_t)(slash - path);
    return set_folder(run, path, n_folder, err);
}

mhe_status mhi_run_read_tree(mhi_run *run, const mhi_run_text *text, const char *path,
                             const char *const *set, int32_t n_set, mhe_error *err) {
    mhe_status status = text == NULL
                            ? mhi_tree_read(path, &run->tree, err)
                            : mhi_tree_parse(path, text->text, text->length, &run->tree, err);
    if (status == MHE_OK) {
        status = name_run(run, text, path, err);
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

/* The scalar below `node` that names the file `path` [n]; NULL: none does. */
static const mhi_node *find_path(const mhi_run *run, const mhi_node *node, const char *path,
                                 size_t n) {
    if (node->kind == MHI_SCALAR) {
        const char *text = node->text == NULL ? "" : node->text;
        while (strncmp(text, "./", 2) == 0) {
            text += 2;
        }
        const size_t length = strlen(text), below = strlen(run->dir);
        if (text[0] == '/') {
            return length == n && strncmp(text, path, n) == 0 ? node : NULL;
        }
        return length > 0 && n == below + 1 + length && strncmp(path, run->dir, below) == 0 &&
                       path[below] == '/' && strncmp(path + below + 1, text, length) == 0
                   ? node
                   : NULL;
    }
    const mhi_node *found = NULL;
    for (const mhi_node *i = node->first; i != NULL && found == NULL; i = i->next) {
        found = find_path(run, i, path, n);
    }
    return found;
}

mhe_status mhi_run_locate_file(const mhi_run *run, mhe_status status, mhe_error *err) {
    static const char *const ends[] = {": cannot be opened", ": is a folder"};
    for (size_t i = 0; i < 2 && status < 0 && err != NULL && run->tree != NULL; i++) {
        const char *end = strstr(err->text, ends[i]);
        const mhi_node *node = end == NULL ? NULL
                                           : find_path(run, mhi_tree_root(run->tree), err->text,
                                                       (size_t)(end - err->text));
        if (node != NULL) {
            const mhe_error why = *err;
            return mhi_fail_at(err, status, run->tree, node, "%s", why.text);
        }
    }
    return status;
}
