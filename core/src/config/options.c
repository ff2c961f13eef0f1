/* SPDX-License-Identifier: Apache-2.0 */
/* options.c: fills a config struct from a YAML mapping. */
#include "config/options.h"

#include "config/options_table.h"
#include "config/options_value.h"

#include <string.h>

struct table {
    const mhe_option *options;
    int32_t n_options;
    const char *const *common;
    int32_t n_common;
};

static int is_common(const struct table *table, const char *key) {
    for (int32_t i = 0; i < table->n_common; i++) {
        if (strcmp(table->common[i], key) == 0) {
            return 1;
        }
    }
    return 0;
}

static mhe_status unknown_key(const mhi_filler *f, const struct table *table,
                              const mhi_node *child) {
    const char *names[MHI_MAX_NAMES];
    int32_t n = 0;
    for (int32_t i = 0; i < table->n_options && n < MHI_MAX_NAMES; i++) {
        if (!(table->options[i].flags & MHE_OPT_DEPRECATED)) {
            names[n++] = table->options[i].key;
        }
    }
    for (int32_t i = 0; i < table->n_common && n < MHI_MAX_NAMES; i++) {
        names[n++] = table->common[i];
    }
    char hint[256];
    return mhi_filler_refuse(f, child, "unknown key '%.60s'%s", child->key,
                             mhi_suggest(hint, sizeof hint, child->key, names, n));
}

/* One entry of the mapping; a deprecated key speaks for its successor. */
static mhe_status read_entry(const mhi_filler *f, const struct table *table,
                             const mhi_node *mapping, const mhi_node *child) {
    const mhe_option *option = mhi_option_find(table->options, table->n_options, child->key);
    if (option == NULL) {
        return is_common(table, child->key) ? MHE_OK : unknown_key(f, table, child);
    }
    if (!(option->flags & MHE_OPT_DEPRECATED)) {
        return mhi_filler_read(f, option, child);
    }
    const char *successor = option->replaced_by;
    for (const mhi_node *other = mapping->first; other != NULL; other = other->next) {
        const mhe_option *o = mhi_option_find(table->options, table->n_options, other->key);
        if (o == NULL || other == child) {
            continue;
        }
        if (strcmp((o->flags & MHE_OPT_DEPRECATED) ? o->replaced_by : o->key, successor) == 0) {
            return mhi_filler_refuse(f, child, "'%s' is an old name of '%s', which is set too",
                                     child->key, successor);
        }
    }
    return mhi_filler_read(f, mhi_option_find(table->options, table->n_options, successor), child);
}

static int is_given(const struct table *table, const mhi_node *mapping, const char *key) {
    if (mhi_node_find(mapping, key) != NULL) {
        return 1;
    }
    for (int32_t i = 0; i < table->n_options; i++) {
        const mhe_option *option = &table->options[i];
        if ((option->flags & MHE_OPT_DEPRECATED) && strcmp(option->replaced_by, key) == 0 &&
            mhi_node_find(mapping, option->key) != NULL) {
            return 1;
        }
    }
    return 0;
}

mhe_status mhi_options_fill(const mhe_option *options, int32_t n_options, const mhi_tree *tree,
                            const mhi_node *mapping, const char *const *common, int32_t n_common,
                            const char *what, const char *dir, mhi_arena *arena, void *config,
                            mhe_error *err) {
    const struct table table = {options, n_options, common, n_common};
    const mhi_filler filler = {tree, what, dir, arena, config, err};
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < n_options && status == MHE_OK; i++) {
        if (!(options[i].flags & (MHE_OPT_REQUIRED | MHE_OPT_DEPRECATED))) {
            status = mhi_filler_default(&filler, &options[i]);
        }
    }
    int absent = mapping == NULL || mhi_node_is_null(mapping);
    if (status == MHE_OK && !absent && mapping->kind != MHI_MAPPING) {
        status = mhi_filler_refuse(&filler, mapping, "must be a mapping like {key: value}, not %s",
                                   mapping->kind == MHI_SEQUENCE ? "a list" : "a single value");
    }
    const mhi_node *child = absent || status != MHE_OK ? NULL : mapping->first;
    for (; child != NULL && status == MHE_OK; child = child->next) {
        status = read_entry(&filler, &table, mapping, child);
    }
    for (int32_t i = 0; i < n_options && status == MHE_OK; i++) {
        if ((options[i].flags & MHE_OPT_REQUIRED) && !is_given(&table, mapping, options[i].key)) {
            status = mhi_filler_refuse(&filler, mapping, "the key '%s' is missing: %s",
                                       options[i].key, options[i].help);
        }
    }
    return status;
}
