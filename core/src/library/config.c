/* SPDX-License-Identifier: Apache-2.0 */
#include "library/config.h"

#include "base/need.h"
#include "config/yaml_scalar.h"
#include "estimator/create.h"
#include "io/model_file.h"
#include "plugin/loader.h"

#include <stdlib.h>
#include <string.h>

static mhe_status open_config(const mhi_run_text *text, const char *path, const char *const *set,
                              int32_t n_set, uint32_t flags, const mhe_host *host, mhe_config **out,
                              mhe_error *err) {
    mhe_config *c = calloc(1, sizeof *c);
    if (c == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    c->host = mhi_host_or_silent(host);
    mhe_status status = mhi_registry_create(c->host, &c->registry, err);
    if (status == MHE_OK) {
        mhi_registry_trust_files(c->registry, (flags & MHE_CONFIG_TRUST) != 0);
        status = mhi_run_parse(text, path, set, n_set, c->registry, &c->run, err);
    }
    if (status != MHE_OK) {
        mhe_config_close(c);
        return status;
    }
    *out = c;
    return MHE_OK;
}

static mhe_status check_set(const char *function, const char *const *set, int32_t n_set,
                            mhe_error *err) {
    for (int32_t i = 0; i < n_set; i++) {
        if (set == NULL || set[i] == NULL) {
            return mhe_fail(err, MHE_E_ARGUMENT, "%s: assignment %d of 'set' is NULL", function,
                            (int)i);
        }
    }
    return MHE_OK;
}

mhe_status mhe_config_read(const char *path, const char *const *set, int32_t n_set, uint32_t flags,
                           const mhe_host *host, mhe_config **config, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"path", path}, {"config", config});
    if (status == MHE_OK) {
        *config = NULL;
        status = check_set(__func__, set, n_set, err);
    }
    return status == MHE_OK ? open_config(NULL, path, set, n_set, flags, host, config, err)
                            : status;
}

mhe_status mhe_config_parse(const char *name, const char *text, uint64_t length, const char *folder,
                            const char *const *set, int32_t n_set, uint32_t flags,
                            const mhe_host *host, mhe_config **config, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"name", name}, {"text", text}, {"config", config});
    if (status == MHE_OK) {
        *config = NULL;
        status = check_set(__func__, set, n_set, err);
    }
    const mhi_run_text source = {.text = text, .length = length, .folder = folder};
    return status == MHE_OK ? open_config(&source, name, set, n_set, flags, host, config, err)
                            : status;
}

void mhe_config_close(mhe_config *c) {
    if (c != NULL) {
        mhi_tree_free(c->resolved);
        mhi_description_free(c->model);
        mhi_run_free(c->run);
        mhi_registry_free(c->registry);
        free(c);
    }
}

const char *mhe_config_name(const mhe_config *c) {
    return c == NULL ? NULL : c->run->name;
}

int32_t mhe_config_plugin(const mhe_config *c, int32_t i, const char **id, const char **file) {
    if (c == NULL || i < 0 || id == NULL || file == NULL) {
        return 0;
    }
    const mhi_run *run = c->run;
    const mhi_use *const parts[] = {&run->model, &run->muscle, &run->integrator, &run->solver};
    const int32_t n_parts = (int32_t)(sizeof parts / sizeof parts[0]);
    for (int32_t k = 0; k < n_parts + run->n_costs; k++) {
        const mhe_plugin *p = (k < n_parts ? parts[k] : &run->costs[k - n_parts])->plugin;
        int32_t before = 0;
        for (int32_t j = n_parts; j < k && !before; j++) {
            before = run->costs[j - n_parts].plugin == p;
        }
        if (!before && i-- == 0) {
            *id = p->id;
            return mhi_plugin_library(p, file, NULL) == MHE_OK;
        }
    }
    return 0;
}

const char *mhe_config_dropped(const mhe_config *c, int32_t i) {
    return c == NULL || c->model == NULL || i < 0 || i >= c->model->n_unsupported
               ? NULL
               : c->model->unsupported[i];
}

mhe_status mhi_config_model(mhe_config *c, const mhe_description **model, mhe_error *err) {
    mhe_status status = MHE_OK;
    if (c->model == NULL) {
        status = mhi_estimator_read_model(c->run, c->host, &c->model, err);
        if (status != MHE_OK) {
            mhi_description_free(c->model);
            c->model = NULL;
        }
    }
    *model = c->model;
    return status;
}

mhe_status mhe_config_write(mhe_config *c, char **text, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"config", c}, {"text", text});
    if (status != MHE_OK) {
        return status;
    }
    mhi_text out = {0};
    *text = NULL;
    mhi_run_write(c->run, &out);
    return mhi_text_give(&out, text, err);
}

/* The entry of a mapping, or of a list by its number. */
static const mhi_node *entry(const mhi_node *node, const char *key) {
    if (node->kind != MHI_SEQUENCE) {
        return node->kind == MHI_MAPPING ? mhi_node_find(node, key) : NULL;
    }
    char *end = NULL;
    const long at = strtol(key, &end, 10);
    const mhi_node *found = end == key || *end != '\0' || at < 0 ? NULL : node->first;
    for (long i = 0; i < at && found != NULL; i++) {
        found = found->next;
    }
    return found;
}

static mhe_status find(mhe_config *c, const char *key, const mhi_node **found, mhe_error *err) {
    mhe_status status = MHE_OK;
    if (c->resolved == NULL) {
        mhi_text all = {0};
        mhi_run_write(c->run, &all);
        status = all.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                            : mhi_tree_parse("config", all.data, all.length, &c->resolved, err);
        mhi_text_free(&all);
    }
    char *path = status == MHE_OK ? strdup(key) : NULL;
    if (path == NULL) {
        return status == MHE_OK ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : status;
    }
    const mhi_node *node = mhi_tree_root(c->resolved);
    char *rest = NULL;
    for (char *part = strtok_r(path, ".", &rest); part != NULL && node != NULL;
         part = strtok_r(NULL, ".", &rest)) {
        node = entry(node, part);
    }
    free(path);
    *found = node;
    return node != NULL ? MHE_OK
                        : mhe_fail(err, MHE_E_CONFIG, "the configuration has no key '%s'", key);
}

mhe_status mhe_config_get(mhe_config *c, const char *key, char **text, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"config", c}, {"key", key}, {"text", text});
    const mhi_node *node = NULL;
    if (status == MHE_OK) {
        *text = NULL;
        status = find(c, key, &node, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    mhi_text out = {0};
    if (node->kind == MHI_SCALAR) {
        mhi_text_add(&out, "%s", mhi_node_is_null(node) ? "" : node->text);
    } else {
        mhi_node_write(node, &out);
    }
    return mhi_text_give(&out, text, err);
}

mhe_status mhe_config_get_real(mhe_config *c, const char *key, double *value, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"config", c}, {"key", key}, {"value", value});
    const mhi_node *node = NULL;
    if (status == MHE_OK) {
        status = find(c, key, &node, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    const char *text = node->kind == MHI_SCALAR && !node->quoted ? node->text : "";
    if (strcmp(text, "true") == 0 || strcmp(text, "false") == 0) {
        *value = text[0] == 't';
        return MHE_OK;
    }
    return mhi_yaml_number(text, value)
               ? MHE_OK
               : mhe_fail(err, MHE_E_CONFIG, "'%s' of the configuration is no number", key);
}
