/* SPDX-License-Identifier: Apache-2.0 */
/* run.c: from a configuration file to a checked description of the run. */
#include "config/options.h"
#include "config/options_value.h"
#include "config/run_reader.h"
#include "config/run_sections.h"

#include <mhe/model.h>
#include <stdlib.h>
#include <string.h>

/* ---- sections without a plugin ---- */

/* The folder number i of plugin_path. One given by the caller (--set) is the user's own word; one
 * that stands in a file may be anybody's. */
static mhe_status add_plugin_folder(const mhi_reader *r, const char *folder, int32_t i) {
    const mhi_node *list = mhi_reader_section(r->run, "plugin_path"), *node = list->first;
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

static mhe_status read_top(const mhi_reader *r) {
    mhi_run *run = r->run;
    int32_t n = 0, n_top = 0;
    const mhi_section *sections = mhi_run_sections(&n);
    const mhe_option *options = mhi_run_section("", &n_top);
    const char **names = MHI_TAKE(&run->arena, const char *, n + 1);
    if (names == NULL) {
        return mhi_reader_no_memory(r);
    }
    int32_t n_names = 0;
    names[n_names++] = "calibrate";   /* mhe-calibrate's own (calibrate/plan.h) */
    for (int32_t i = 1; i < n; i++) { /* 0 is the top level itself */
        const int costs = strcmp(sections[i].name, "costs") == 0;
        if (strchr(sections[i].name, '.') == NULL) {
            names[n_names++] = costs && r->scope == MHI_SCOPE_STEPS ? "steps" : sections[i].name;
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
        return mhi_reader_no_memory(r);
    }
    run->plugin_path = (mhe_text_list){.values = folders, .n = top.plugin_path.n};
    for (int32_t i = 0; i < top.plugin_path.n && status == MHE_OK; i++) {
        folders[i] = mhi_path_absolute(run->dir, top.plugin_path.values[i], &run->arena);
        if (folders[i] == NULL) {
            return mhi_reader_no_memory(r);
        }
        status = add_plugin_folder(r, folders[i], i);
    }
    return status;
}

static mhe_status read_plain_sections(const mhi_reader *r) {
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
            status = mhi_options_fill(
                s->options, s->n_options, run->tree, mhi_reader_section(run, s->name), list,
                has_list, s->name, run->dir, &run->arena, (unsigned char *)run + s->offset, r->err);
        }
    }
    status = status == MHE_OK ? mhi_run_check_transform(run, r->err) : status;
    return status == MHE_OK ? mhi_run_read_channels(run, r->err) : status;
}

/* ---- what no single key can tell ---- */

static mhe_status read_node(const mhi_reader *r) {
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
        return mhi_fail_at(r->err, MHE_E_CONFIG, r->run->tree, mhi_reader_section(r->run, "output"),
                           "output.node: '%s' is no node of the window: first, last, or 0 to %d",
                           o->node_name, (int)window);
    }
    return MHE_OK;
}

static mhe_status check_run(const mhi_reader *r) {
    mhi_run *run = r->run;
    const mhi_bounds_section *b = &run->bounds;
    if (run->initial.q.n > 0 && run->initial.qdot.n > 0 &&
        run->initial.q.n != run->initial.qdot.n) {
        return mhi_fail_at(r->err, MHE_E_CONFIG, run->tree, mhi_reader_section(run, "initial"),
                           "initial: 'q' has %d values and 'qdot' %d", (int)run->initial.q.n,
                           (int)run->initial.qdot.n);
    }
    int activation = b->activation_min > b->activation_max;
    if (activation || b->excitation_min > b->excitation_max) {
        const char *name = activation ? "activation" : "excitation";
        return mhi_fail_at(r->err, MHE_E_CONFIG, run->tree, mhi_reader_section(run, "bounds"),
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
    const mhi_reader reader = {run, registry, err, scope};
    if (run == NULL) {
        return mhi_reader_no_memory(&reader);
    }
    mhe_status status = mhi_run_read_tree(run, text, path, set, n_set, err);
    if (scope == MHI_SCOPE_MODEL) {
        status = status == MHE_OK ? mhi_read_plugin_sections(&reader, MHE_MODEL_IFACE) : status;
    } else {
        status = status == MHE_OK ? read_top(&reader) : status;
        status = status == MHE_OK ? read_plain_sections(&reader) : status;
        status = status == MHE_OK ? mhi_read_plugin_sections(&reader, NULL) : status;
        status = status == MHE_OK ? check_run(&reader) : status;
    }
    if (run->arena.failed) { /* whatever else was found wrong may have come of it */
        status = mhi_reader_no_memory(&reader);
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
    return read_run(NULL, path, set, n_set, registry, MHI_SCOPE_ALL, run, err);
}

mhe_status mhi_run_parse(const mhi_run_text *text, const char *name, const char *const *set,
                         int32_t n_set, mhi_registry *registry, mhi_run **run, mhe_error *err) {
    return read_run(text, name, set, n_set, registry, MHI_SCOPE_ALL, run, err);
}

mhe_status mhi_run_read_model(const char *path, const char *const *set, int32_t n_set,
                              mhi_registry *registry, mhi_run **run, mhe_error *err) {
    return read_run(NULL, path, set, n_set, registry, MHI_SCOPE_MODEL, run, err);
}

mhe_status mhi_run_read_base(const char *path, const char *const *set, int32_t n_set,
                             mhi_registry *registry, mhi_run **run, mhe_error *err) {
    return read_run(NULL, path, set, n_set, registry, MHI_SCOPE_STEPS, run, err);
}

mhe_status mhi_run_read_costs(mhi_run *run, mhi_registry *registry, const mhi_node *owner,
                              mhi_use **costs, int32_t *n, mhe_error *err) {
    const mhi_reader reader = {run, registry, err, MHI_SCOPE_STEPS};
    return mhi_read_costs(&reader, owner, mhi_node_find(owner, "costs"), costs, n);
}

mhe_status mhi_run_read_loads(mhi_run *run, mhi_registry *registry, const char *file,
                              const mhi_node *key, mhi_use *use, mhe_error *err) {
    const mhi_reader reader = {run, registry, err, MHI_SCOPE_ALL};
    return mhi_read_loads(&reader, file, key, use);
}

void mhi_run_free(mhi_run *run) {
    if (run != NULL) {
        mhi_tree_free(run->tree);
        mhi_arena_free(&run->arena);
        free(run);
    }
}
