/* SPDX-License-Identifier: Apache-2.0 */
/* run.c: from a configuration file to a checked description of the run. */
#include "config/run.h"

#include "config/defaults.h"
#include "config/options.h"
#include "config/options_value.h"
#include "config/run_sections.h"

#include <mhe/model.h>
#include <stdlib.h>
#include <string.h>

/* What of the file is read; other sections belong to another program. */
enum { SCOPE_ALL, SCOPE_MODEL, SCOPE_STEPS };

struct reader {
    mhi_run *run;
    mhi_registry *registry;
    mhe_error *err;
    int32_t scope; /* SCOPE_* */
};

static mhe_status no_memory(const struct reader *r) {
    return mhe_fail(r->err, MHE_E_MEMORY, "out of memory");
}

/* Of a name "data.transform", the mapping within that section. */
static mhi_node *section_node(const mhi_run *run, const char *name) {
    const char *dot = strchr(name, '.');
    if (dot == NULL) {
        return mhi_node_find(mhi_tree_root(run->tree), name);
    }
    char outer[32];
    (void)snprintf(outer, sizeof outer, "%.*s", (int)(dot - name), name);
    const mhi_node *around = mhi_node_find(mhi_tree_root(run->tree), outer);
    return around == NULL ? NULL : mhi_node_find(around, dot + 1);
}

/* ---- sections without a plugin ---- */

/* The folder number i of plugin_path. One given by the caller (--set) is the user's own word; one
 * that stands in a file may be anybody's. */
static mhe_status add_plugin_folder(const struct reader *r, const char *folder, int32_t i) {
    const mhi_node *list = section_node(r->run, "plugin_path"), *node = list->first;
    for (; i > 0 && node != NULL; i--) {
        node = node->next;
    }
    node = node == NULL ? list : node; /* a single folder need be no list */
    if (node->line > 0 && !mhi_registry_trusts_files(r->registry)) {
        return mhi_fail_at(r->err, MHE_E_CONFIG, r->run->tree, node,
                           "plugin_path: '%s' holds code that would run. Where you trust it, give "
                           "mhe-run --trust, or name the folder in MHE_PLUGIN_PATH",
                           folder);
    }
    mhe_error why = {0};
    const mhe_status status = mhi_registry_add_folder(r->registry, folder, &why);
    return status == MHE_OK ? MHE_OK
                            : mhi_fail_at(r->err, status, r->run->tree, list, "%s", why.text);
}

static mhe_status read_top(const struct reader *r) {
    mhi_run *run = r->run;
    int32_t n = 0, n_top = 0;
    const mhi_section *sections = mhi_run_sections(&n);
    const mhe_option *options = mhi_run_section("", &n_top);
    const char **names = MHI_TAKE(&run->arena, const char *, n + 1);
    if (names == NULL) {
        return no_memory(r);
    }
    int32_t n_names = 0;
    names[n_names++] = "calibrate";   /* mhe-calibrate's own (calibrate/plan.h) */
    for (int32_t i = 1; i < n; i++) { /* 0 is the top level itself */
        const int costs = strcmp(sections[i].name, "costs") == 0;
        if (strchr(sections[i].name, '.') == NULL) {
            names[n_names++] = costs && r->scope == SCOPE_STEPS ? "steps" : sections[i].name;
        }
    }
    mhi_top_section top = {0};
    mhe_status status = mhi_options_fill(options, n_top, run->tree, mhi_tree_root(run->tree), names,
                                         n_names, NULL, run->dir, &run->arena, &top, r->err);
    if (status != MHE_OK) {
        return status;
    }
    run->formulation = top.formulation;
    const char **folders = MHI_TAKE(&run->arena, const char *, top.plugin_path.n);
    if (folders == NULL) {
        return no_memory(r);
    }
    run->plugin_path = (mhe_text_list){.values = folders, .n = top.plugin_path.n};
    for (int32_t i = 0; i < top.plugin_path.n && status == MHE_OK; i++) {
        folders[i] = mhi_path_absolute(run->dir, top.plugin_path.values[i], &run->arena);
        if (folders[i] == NULL) {
            return no_memory(r);
        }
        status = add_plugin_folder(r, folders[i], i);
    }
    return status;
}

static mhe_status read_plain_sections(const struct reader *r) {
    mhi_run *run = r->run;
    int32_t n = 0;
    const mhi_section *s = mhi_run_sections(&n);
    mhe_status status = MHE_OK;
    mhi_run_flatten_rotate(run);
    status = mhi_run_flatten_weights(run, r->err);
    for (const mhi_section *end = s + n; s < end && status == MHE_OK; s++) {
        if (s->iface == NULL && s->offset != 0) {
            static const char *const lists[] = {"channels", "transform"}; /* within a section */
            const int32_t has_list =
                s->offset == offsetof(mhi_run, emg) || s->offset == offsetof(mhi_run, data);
            const char *const *list = lists + (s->offset == offsetof(mhi_run, data));
            status = mhi_options_fill(s->options, s->n_options, run->tree,
                                      section_node(run, s->name), list, has_list, s->name, run->dir,
                                      &run->arena, (unsigned char *)run + s->offset, r->err);
        }
    }
    status = status == MHE_OK ? mhi_run_check_transform(run, r->err) : status;
    return status == MHE_OK ? mhi_run_read_channels(run, r->err) : status;
}

/* ---- sections with a plugin ---- */

static mhe_status find_plugin(const struct reader *r, const mhi_section *section,
                              const mhi_node *node, mhi_use *use) {
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
                           "%s: the id of a plugin is missing: {plugin: ID, ...}", section->name);
    }
    mhe_error why = {0};
    mhe_status status = mhi_registry_find(r->registry, id, section->iface, &use->plugin, &why);
    return status == MHE_OK
               ? MHE_OK
               : mhi_fail_at(r->err, status, r->run->tree, entry != NULL ? entry : node, "%s: %s",
                             section->name, why.text);
}

static const char **keys_of(const struct reader *r, const mhe_option *options, int32_t n) {
    const char **keys = MHI_TAKE(&r->run->arena, const char *, n);
    for (int32_t i = 0; i < n && keys != NULL; i++) {
        keys[i] = options[i].key;
    }
    return keys;
}

/* The plugin's keys and the core's share one mapping. */
static mhe_status check_shared_keys(const struct reader *r, const mhi_section *section,
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

static mhe_status read_use(const struct reader *r, const mhi_section *section, const mhi_node *node,
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
        return no_memory(r);
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
static mhe_status read_list(const struct reader *r, const mhi_section *section,
                            const mhi_node *owner, const mhi_node *list, mhi_use_list *out) {
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
        return no_memory(r);
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

static mhe_status read_costs(const struct reader *r, const mhi_node *owner, const mhi_node *list,
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
static mhe_status read_other_force(const struct reader *r, const mhi_section *section,
                                   const char *id, const char *file, const mhi_node *node,
                                   mhi_use *use) {
    mhi_run *run = r->run;
    const mhe_plugin *plugin = NULL;
    mhe_error why = {0};
    mhe_status status = mhi_registry_find(r->registry, id, section->iface, &plugin, &why);
    if (status != MHE_OK) {
        return mhi_fail_at(r->err, status, run->tree, node, "%s: %s", section->name, why.text);
    }
    void *config = mhi_arena_take(&run->arena, plugin->config_size);
    if (config == NULL) {
        return no_memory(r);
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

/* The list, or where there is none what acts by default as far as it is installed; then
 * data.external_loads. */
static mhe_status read_forces(const struct reader *r, const mhi_section *section,
                              const mhi_node *list) {
    mhi_run *run = r->run;
    const char **ids = NULL;
    int32_t n = 0;
    mhe_status status = read_list(r, section, NULL, list, &run->forces);
    if (status == MHE_OK && list == NULL) {
        status = mhi_default_plugins("forces", &run->arena, &ids, &n, r->err);
        run->forces.uses = MHI_TAKE(&run->arena, mhi_use, n);
        if (run->forces.uses == NULL) {
            return no_memory(r);
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
    const mhi_node *data = section_node(run, "data");
    const mhi_node *key = data == NULL ? NULL : mhi_node_find(data, "external_loads");
    status = mhi_default_plugins("external_loads", &run->arena, &ids, &n, r->err);
    if (status == MHE_OK && n == 0) {
        return mhi_fail_at(r->err, MHE_E_CONFIG, run->tree, key,
                           "data.external_loads: defaults.yaml names no plugin that reads it");
    }
    return status != MHE_OK ? status
                            : read_other_force(r, section, ids[0], run->data.external_loads, key,
                                               &run->external_loads);
}

static mhe_status read_plugin_section(const struct reader *r, const mhi_section *s) {
    mhi_run *run = r->run;
    const mhi_node *node = section_node(run, s->name);
    if (strcmp(s->iface, MHE_COST_IFACE) == 0) {
        return r->scope == SCOPE_STEPS ? MHE_OK
                                       : read_costs(r, NULL, node, &run->costs, &run->n_costs);
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
                                              .locked_at = own.locked_at};
    }
    return status;
}

/* All sections that name a plugin, or the one with this interface. */
static mhe_status read_plugin_sections(const struct reader *r, const char *iface) {
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

/* ---- what no single key can tell ---- */

static mhe_status read_node(const struct reader *r) {
    mhi_output_section *o = &r->run->output;
    const int32_t window = r->run->horizon.window;
    char *end = NULL;
    const long k = strtol(o->node_name, &end, 10);
    if (strcmp(o->node_name, "auto") == 0 || strcmp(o->node_name, "first") == 0) {
        o->node = 0;
    } else if (strcmp(o->node_name, "last") == 0) {
        o->node = window;
    } else if (end != o->node_name && *end == '\0' && k >= 0 && k <= window) {
        o->node = (int32_t)k;
    } else {
        return mhi_fail_at(r->err, MHE_E_CONFIG, r->run->tree, section_node(r->run, "output"),
                           "output.node: '%s' is no node of the window: first, last, or 0 to %d",
                           o->node_name, (int)window);
    }
    return MHE_OK;
}

static mhe_status check_run(const struct reader *r) {
    mhi_run *run = r->run;
    const mhi_bounds_section *b = &run->bounds;
    if (run->initial.q.n > 0 && run->initial.qdot.n > 0 &&
        run->initial.q.n != run->initial.qdot.n) {
        return mhi_fail_at(r->err, MHE_E_CONFIG, run->tree, section_node(run, "initial"),
                           "initial: 'q' has %d values and 'qdot' %d", (int)run->initial.q.n,
                           (int)run->initial.qdot.n);
    }
    int activation = b->activation_min > b->activation_max;
    if (activation || b->excitation_min > b->excitation_max) {
        const char *name = activation ? "activation" : "excitation";
        return mhi_fail_at(r->err, MHE_E_CONFIG, run->tree, section_node(run, "bounds"),
                           "bounds: '%s_min' is above '%s_max'", name, name);
    }
    const int by_activation = run->formulation == MHE_FORMULATION_ACTIVATION;
    if (run->data.emg_delay < 0) {
        run->data.emg_delay = by_activation && run->emg.n_channels == 0 ? 2 : 0;
    }
    for (int32_t i = 0; i < run->n_costs && run->emg.sample == MHI_EMG_SAMPLE_BY_COST; i++) {
        if (run->costs[i].plugin->flags & MHE_FLAG_MEAN_TARGETS) {
            run->emg.sample = MHI_EMG_SAMPLE_MEAN;
        }
    }
    if (run->emg.sample == MHI_EMG_SAMPLE_BY_COST) {
        run->emg.sample = MHI_EMG_SAMPLE_NODE;
    }
    if (run->emg.delay < 0) {
        run->emg.delay = by_activation ? 0.02 : 0;
    }
    const mhe_status status = mhi_run_check_formats(run, r->err);
    return status == MHE_OK ? read_node(r) : status;
}

/* The tree, then all sections or those of a scope. */
static mhe_status read_run(const mhi_run_text *text, const char *path, const char *const *set,
                           int32_t n_set, mhi_registry *registry, int32_t scope, mhi_run **out,
                           mhe_error *err) {
    *out = NULL;
    mhi_run *run = calloc(1, sizeof *run);
    const struct reader reader = {run, registry, err, scope};
    if (run == NULL) {
        return no_memory(&reader);
    }
    mhe_status status = mhi_run_read_tree(run, text, path, set, n_set, err);
    if (scope == SCOPE_MODEL) {
        status = status == MHE_OK ? read_plugin_sections(&reader, MHE_MODEL_IFACE) : status;
    } else {
        status = status == MHE_OK ? read_top(&reader) : status;
        status = status == MHE_OK ? read_plain_sections(&reader) : status;
        status = status == MHE_OK ? read_plugin_sections(&reader, NULL) : status;
        status = status == MHE_OK ? check_run(&reader) : status;
    }
    if (run->arena.failed) { /* whatever else was found wrong may have come of it */
        status = no_memory(&reader);
    }
    if (status != MHE_OK) {
        mhi_run_free(run);
        return status;
    }
    *out = run;
    return MHE_OK;
}

mhe_status mhi_run_read(const char *path, const char *const *set, int32_t n_set,
                        mhi_registry *registry, mhi_run **run, mhe_error *err) {
    return read_run(NULL, path, set, n_set, registry, SCOPE_ALL, run, err);
}

mhe_status mhi_run_parse(const mhi_run_text *text, const char *name, const char *const *set,
                         int32_t n_set, mhi_registry *registry, mhi_run **run, mhe_error *err) {
    return read_run(text, name, set, n_set, registry, SCOPE_ALL, run, err);
}

mhe_status mhi_run_read_model(const char *path, const char *const *set, int32_t n_set,
                              mhi_registry *registry, mhi_run **run, mhe_error *err) {
    return read_run(NULL, path, set, n_set, registry, SCOPE_MODEL, run, err);
}

mhe_status mhi_run_read_base(const char *path, const char *const *set, int32_t n_set,
                             mhi_registry *registry, mhi_run **run, mhe_error *err) {
    return read_run(NULL, path, set, n_set, registry, SCOPE_STEPS, run, err);
}

mhe_status mhi_run_read_costs(mhi_run *run, mhi_registry *registry, const mhi_node *owner,
                              mhi_use **costs, int32_t *n, mhe_error *err) {
    const struct reader reader = {run, registry, err, SCOPE_STEPS};
    return read_costs(&reader, owner, mhi_node_find(owner, "costs"), costs, n);
}

void mhi_run_free(mhi_run *run) {
    if (run != NULL) {
        mhi_tree_free(run->tree);
        mhi_arena_free(&run->arena);
        free(run);
    }
}
