/* SPDX-License-Identifier: Apache-2.0 */
/* run_plugins.c: the sections of a configuration that name plugins. */
#include "config/defaults.h"
#include "config/options.h"
#include "config/run_reader.h"
#include "config/run_sections.h"

#include <mhe/force.h>
#include <mhe/model.h>
#include <string.h>

mhe_status mhi_reader_no_memory(const mhi_reader *r) {
    return mhe_fail(r->err, MHE_E_MEMORY, "out of memory");
}

mhi_node *mhi_reader_section(const mhi_run *run, const char *name) {
    const char *dot = strchr(name, '.');
    if (dot == NULL) {
        return mhi_node_find(mhi_tree_root(run->tree), name);
    }
    char outer[32];
    (void)snprintf(outer, sizeof outer, "%.*s", (int)(dot - name), name);
    const mhi_node *around = mhi_node_find(mhi_tree_root(run->tree), outer);
    return around == NULL ? NULL : mhi_node_find(around, dot + 1);
}

static mhe_status find_plugin(const mhi_reader *r, const mhi_section *section, const mhi_node *node,
                              mhi_use *use) {
    const mhi_node *entry = mhi_node_find(node, "plugin");
    const char *id = NULL;
    if (entry == NULL && section->offset != 0) {
        mhe_status status = mhi_default_plugin(section->name, &r->run->arena, &id, r->err);
        if (status != MHE_OK) {
            return status;
        }
    }
    if (entry != NULL && entry->kind == MHI_SCALAR && !mhi_node_is_null(entry)) {
        id = entry->text;
    } else if (entry != NULL || id == NULL) {
        return mhi_fail_at(r->err, MHE_E_CONFIG, r->run->tree, entry != NULL ? entry : node,
                           "%s: the id of a plugin is missing: {plugin: ID, ...}%s", section->name,
                           entry == NULL && section->offset != 0
                               ? " (defaults.yaml, which names one, was not found or does not)"
                               : "");
    }
    mhe_error why = {0};
    mhe_status status = mhi_registry_find(r->registry, id, section->iface, &use->plugin, &why);
    return status == MHE_OK
               ? MHE_OK
               : mhi_fail_at(r->err, status, r->run->tree, entry != NULL ? entry : node, "%s: %s",
                             section->name, why.text);
}

static const char **keys_of(const mhi_reader *r, const mhe_option *options, int32_t n) {
    const char **keys = MHI_TAKE(&r->run->arena, const char *, n);
    for (int32_t i = 0; i < n && keys != NULL; i++) {
        keys[i] = options[i].key;
    }
    return keys;
}

/* The plugin's keys and the core's share one mapping. */
static mhe_status check_shared_keys(const mhi_reader *r, const mhi_section *section,
                                    const mhi_node *node, const mhe_plugin *plugin) {
    for (uint32_t i = 0; i < plugin->option_count; i++) {
        for (int32_t k = 0; k < section->n_options; k++) {
            if (strcmp(plugin->options[i].key, section->options[k].key) == 0) {
                return mhi_fail_at(r->err, MHE_E_PLUGIN, r->run->tree, node,
                                   "%s: the plugin's option '%s' has the name of a key of every "
                                   "'%s' section",
                                   plugin->id, plugin->options[i].key, section->name);
            }
        }
    }
    return MHE_OK;
}

static mhe_status read_use(const mhi_reader *r, const mhi_section *section, const mhi_node *node,
                           mhi_use *use, mhi_use_section *own) {
    mhi_run *run = r->run;
    if (node != NULL && node->kind != MHI_MAPPING) {
        return mhi_fail_at(r->err, MHE_E_CONFIG, run->tree, node,
                           "%s: must be the id of a plugin or a mapping {plugin: ID, ...}",
                           section->name);
    }
    mhe_status status = find_plugin(r, section, node, use);
    if (status != MHE_OK) {
        return status;
    }
    const mhe_plugin *plugin = use->plugin;
    int32_t n = (int32_t)plugin->option_count;
    const char **core_keys = keys_of(r, section->options, section->n_options);
    const char **plugin_keys = keys_of(r, plugin->options, n);
    void *config = mhi_arena_take(&run->arena, plugin->config_size);
    if (core_keys == NULL || plugin_keys == NULL || config == NULL) {
        return mhi_reader_no_memory(r);
    }
    use->node = node;
    use->config = config;
    status = check_shared_keys(r, section, node, plugin);
    if (status == MHE_OK) {
        status =
            mhi_options_fill(plugin->options, n, run->tree, node, core_keys, section->n_options,
                             plugin->id, run->dir, &run->arena, config, r->err);
    }
    if (status == MHE_OK) {
        status =
            mhi_options_fill(section->options, section->n_options, run->tree, node, plugin_keys, n,
                             section->name, run->dir, &run->arena, own, r->err);
    }
    use->weight = own->weight;
    use->sigma = own->sigma;
    use->huber = own->huber;
    use->delay = own->delay;
    return status;
}

/* The plugins of a list (NULL: there is none). `owner` stands for it in messages where it is
 * missing. */
static mhe_status read_list(const mhi_reader *r, const mhi_section *section, const mhi_node *owner,
                            const mhi_node *list, mhi_use_list *out) {
    *out = (mhi_use_list){NULL, 0};
    if (list == NULL && section->list == 1) {
        return MHE_OK;
    }
    if (list == NULL || list->kind != MHI_SEQUENCE || (list->first == NULL && section->list == 2)) {
        return mhi_fail_at(r->err, MHE_E_CONFIG, r->run->tree, list != NULL ? list : owner,
                           "%s: a list%s is needed, like [{plugin: ID}]", section->name,
                           section->list == 2 ? " with at least one entry" : "");
    }
    out->n = mhi_node_count(list);
    mhi_use *use = out->uses = MHI_TAKE(&r->run->arena, mhi_use, out->n);
    if (use == NULL) {
        return mhi_reader_no_memory(r);
    }
    mhe_status status = MHE_OK;
    for (mhi_node *node = list->first; node != NULL && status == MHE_OK; node = node->next) {
        mhi_use_section own = {0};
        status = mhi_node_expand(r->run->tree, node, "plugin", r->err);
        if (status == MHE_OK) {
            status = read_use(r, section, node, use++, &own);
        }
    }
    return status;
}

mhe_status mhi_read_costs(const mhi_reader *r, const mhi_node *owner, const mhi_node *list,
                          mhi_use **uses, int32_t *n_uses) {
    int32_t n = 0;
    const mhi_section *section = mhi_run_sections(&n);
    while (section->iface == NULL || strcmp(section->iface, MHE_COST_IFACE) != 0) {
        section++;
    }
    mhi_use_list found;
    const mhe_status status = read_list(r, section, owner, list, &found);
    *uses = found.uses;
    *n_uses = found.n;
    return status;
}

/* A plugin's own keys where data.FILE stands for it: the file, and what data.transform says of the
 * frame that it is in. */
static void fill_file(const mhi_run *run, const mhe_plugin *plugin, const char *file,
                      void *config) {
    const mhi_transform_section *t = &run->transform;
    const double scale = t->scale == 0 ? 1 : t->scale; /* of a run without that section */
    const mhe_real_list turn = {.values = t->turn, .n = t->scale == 0 ? 0 : 9};
    for (uint32_t i = 0; i < plugin->option_count; i++) {
        const mhe_option *o = &plugin->options[i];
        char *field = (char *)config + o->offset;
        if (strcmp(o->key, "file") == 0 && o->type == MHE_TYPE_PATH) {
            memcpy(field, &file, sizeof file);
        } else if (strcmp(o->key, "turn") == 0 && o->type == MHE_TYPE_REAL_LIST) {
            memcpy(field, &turn, sizeof turn);
        } else if (strcmp(o->key, "shift") == 0 && o->type == MHE_TYPE_REAL_LIST) {
            memcpy(field, &t->shift, sizeof t->shift);
        } else if (strcmp(o->key, "scale") == 0 && o->type == MHE_TYPE_REAL) {
            memcpy(field, &scale, sizeof scale);
        }
    }
}

/* A use that no list of the file holds: with its defaults, and `file` for its key of that name. */
static mhe_status read_other_force(const mhi_reader *r, const mhi_section *section, const char *id,
                                   const char *file, const mhi_node *node, mhi_use *use) {
    mhi_run *run = r->run;
    const mhe_plugin *plugin = NULL;
    mhe_error why = {0};
    mhe_status status = mhi_registry_find(r->registry, id, section->iface, &plugin, &why);
    if (status != MHE_OK) {
        return mhi_fail_at(r->err, status, run->tree, node, "%s: %s", section->name, why.text);
    }
    void *config = mhi_arena_take(&run->arena, plugin->config_size);
    if (config == NULL) {
        return mhi_reader_no_memory(r);
    }
    if (file != NULL) {
        fill_file(run, plugin, file, config);
    }
    if (file == NULL) {
        status = mhi_options_fill(plugin->options, (int32_t)plugin->option_count, run->tree, NULL,
                                  NULL, 0, plugin->id, run->dir, &run->arena, config, r->err);
    }
    *use = (mhi_use){.plugin = plugin, .config = config, .node = node};
    return status;
}

mhe_status mhi_read_loads(const mhi_reader *r, const char *file, const mhi_node *key,
                          mhi_use *use) {
    const char **ids = NULL;
    int32_t n = 0;
    const mhi_section *section = mhi_run_sections(&n);
    while (section->iface == NULL || strcmp(section->iface, MHE_FORCE_IFACE) != 0) {
        section++;
    }
    const mhe_status status =
        mhi_default_plugins("external_loads", &r->run->arena, &ids, &n, r->err);
    return status != MHE_OK ? status
           : n == 0
               ? mhi_fail_at(r->err, MHE_E_CONFIG, r->run->tree, key,
                             "external_loads: defaults.yaml names no plugin that reads such files")
               : read_other_force(r, section, ids[0], file, key, use);
}

/* The list, or where there is none what acts by default as far as it is installed; then
 * data.external_loads. */
static mhe_status read_forces(const mhi_reader *r, const mhi_section *section,
                              const mhi_node *list) {
    mhi_run *run = r->run;
    const char **ids = NULL;
    int32_t n = 0;
    mhe_status status = read_list(r, section, NULL, list, &run->forces);
    if (status == MHE_OK && list == NULL) {
        status = mhi_default_plugins("forces", &run->arena, &ids, &n, r->err);
        run->forces.uses = MHI_TAKE(&run->arena, mhi_use, n);
        if (run->forces.uses == NULL) {
            return mhi_reader_no_memory(r);
        }
    }
    for (int32_t i = 0; i < n && status == MHE_OK; i++) {
        const mhe_plugin *plugin = NULL;
        mhe_error why = {0};
        const mhe_status found =
            mhi_registry_find(r->registry, ids[i], section->iface, &plugin, &why);
        if (found == MHE_E_MEMORY ||
            (found != MHE_OK && mhi_registry_refused_count(r->registry) > 0)) {
            /* it may be one of the files that could not be loaded: no model without its forces */
            status = mhe_fail(r->err, found, "%s: forces: %s", run->path, why.text);
        } else if (found == MHE_OK) {
            status = read_other_force(r, section, ids[i], NULL, NULL,
                                      &run->forces.uses[run->forces.n++]);
        }
    }
    if (status != MHE_OK || run->data.external_loads == NULL) {
        return status;
    }
    const mhi_node *data = mhi_reader_section(run, "data");
    const mhi_node *key = data == NULL ? NULL : mhi_node_find(data, "external_loads");
    return mhi_read_loads(r, run->data.external_loads, key, &run->external_loads);
}

static mhe_status read_plugin_section(const mhi_reader *r, const mhi_section *s) {
    mhi_run *run = r->run;
    const mhi_node *node = mhi_reader_section(run, s->name);
    if (strcmp(s->iface, MHE_COST_IFACE) == 0) {
        return r->scope == MHI_SCOPE_STEPS
                   ? MHE_OK
                   : mhi_read_costs(r, NULL, node, &run->costs, &run->n_costs);
    }
    void *part = (unsigned char *)run + s->offset;
    if (part == &run->forces) {
        return read_forces(r, s, node);
    }
    if (s->list) {
        return read_list(r, s, NULL, node, part);
    }
    mhi_use_section own = {0};
    mhi_use *use = part;
    mhe_status status = read_use(r, s, node, use, &own);
    if (use == &run->model) {
        run->model_file = (mhi_model_section){.file = own.file,
                                              .unsupported = own.unsupported,
                                              .locked = own.locked,
                                              .locked_at = own.locked_at,
                                              .motion = own.motion};
    }
    return status;
}

mhe_status mhi_read_plugin_sections(const mhi_reader *r, const char *iface) {
    int32_t n = 0;
    const mhi_section *s = mhi_run_sections(&n);
    mhe_status status = MHE_OK;
    for (const mhi_section *end = s + n; s < end && status == MHE_OK; s++) {
        if (s->iface != NULL && (iface == NULL || strcmp(s->iface, iface) == 0)) {
            status = read_plugin_section(r, s);
        }
    }
    return status;
}
