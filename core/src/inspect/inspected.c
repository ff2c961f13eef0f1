/* SPDX-License-Identifier: Apache-2.0 */
#include "inspect/inspected.h"

#include "config/defaults.h"
#include "config/options.h"
#include "io/model_file.h"
#include "plugin/instance.h"

#include <mhe/inspect.h>

#include <math.h>
#include <string.h>

/* The plugin that a config takes for a section where it names none, and a config of defaults and
 * one key set to one word. */
static mhe_status find(mhi_inspected *m, const char *section, const char *iface, const char *yaml,
                       const mhe_plugin **plugin, const void **config, mhe_error *err) {
    mhi_tree *tree = NULL;
    const char *id = NULL;
    mhe_status status = mhi_default_plugin(section, &m->arena, &id, err);
    if (status == MHE_OK && id == NULL) {
        status = mhe_fail(err, MHE_E_PLUGIN, "defaults.yaml names no plugin for '%s'", section);
    }
    if (status == MHE_OK) {
        status = mhi_registry_find(m->registry, id, iface, plugin, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    void *filled = mhi_arena_take(&m->arena, (*plugin)->config_size);
    if (filled == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    status = mhi_tree_parse(id, yaml, strlen(yaml), &tree, err);
    if (status == MHE_OK) {
        status = mhi_options_fill((*plugin)->options, (int32_t)(*plugin)->option_count, tree,
                                  mhi_tree_root(tree), NULL, 0, id, ".", &m->arena, filled, err);
    }
    mhi_tree_free(tree);
    *config = filled;
    return status;
}

mhe_status mhi_skeleton_open(const mhi_inspected *m, const mhe_description *description,
                             mhi_skeleton *skeleton, mhe_error *err) {
    *skeleton = (mhi_skeleton){.description = description, .ops = m->model->ops};
    mhe_status status =
        mhi_model_create(m->model, m->host, description, m->model_config, &skeleton->self, err);
    return status != MHE_OK
               ? status
               : skeleton->ops->context_create(skeleton->self, &skeleton->context, err);
}

void mhi_skeleton_close(mhi_skeleton *skeleton) {
    if (skeleton->context != NULL) {
        skeleton->ops->context_destroy(skeleton->context);
    }
    if (skeleton->self != NULL) {
        skeleton->ops->destroy(skeleton->self);
    }
    *skeleton = (mhi_skeleton){0};
}

/* Where the free coordinates stand among all of them. */
static mhe_status find_places(mhi_inspected *m, mhe_error *err) {
    m->place = MHI_TAKE(&m->arena, int32_t, m->file->n_coordinates);
    if (m->place == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0, k = 0; i < m->file->n_coordinates; i++, k++) { /* the same order */
        while (strcmp(m->all->coordinates[k].name, m->file->coordinates[i].name) != 0) {
            k++;
        }
        m->place[i] = k;
    }
    return MHE_OK;
}

static mhe_status open_muscles(mhi_inspected *m, mhe_error *err) {
    mhe_status status =
        find(m, "muscle", MHE_MUSCLE_IFACE, "{}", &m->muscle_plugin, &m->muscle_config, err);
    if (status != MHE_OK || m->all->n_muscles == 0) {
        return m->all->n_muscles == 0 ? MHE_OK : status;
    }
    m->layout.size = sizeof m->layout;
    status = mhi_muscle_create(m->muscle_plugin, m->host, m->all->muscles, m->all->n_muscles,
                               m->muscle_config, &m->muscles, &m->layout, err);
    m->muscle = m->muscle_plugin->ops;
    return status;
}

/* Of what was read. */
static mhe_status open_read(mhi_inspected *m, int32_t paths, mhe_error *err) {
    mhe_status status = find_places(m, err);
    if (status == MHE_OK) {
        status = mhi_registry_create(m->host, &m->registry, err);
    }
    if (status == MHE_OK) {
        status =
            find(m, "model", MHE_MODEL_IFACE, paths == MHE_PATHS_FITTED ? "{paths: fitted}" : "{}",
                 &m->model, &m->model_config, err);
    }
    if (status == MHE_OK) {
        status = mhi_skeleton_open(m, m->all, &m->skeleton, err);
    }
    return status != MHE_OK ? status : open_muscles(m, err);
}

/* What a plugin says of the model begins with the plugin: the file is put in front. */
static mhe_status open_named(mhi_inspected *m, const char *name, int32_t paths, mhe_error *err) {
    const mhe_status status = open_read(m, paths, err);
    if (status == MHE_OK || err == NULL || strncmp(err->text, name, strlen(name)) == 0) {
        return status;
    }
    const mhe_error why = *err;
    return mhe_fail(err, status, "%s: %s", name, why.text);
}

mhe_status mhi_inspected_open(mhi_inspected *m, const mhe_host *host, const char *file,
                              int32_t paths, mhe_error *err) {
    *m = (mhi_inspected){.host = mhi_host_or_silent(host)};
    mhe_status status = mhi_model_read(file, &m->file, err);
    if (status == MHE_OK) {
        status = mhi_model_read_unlocked(file, &m->all, err);
    }
    return status == MHE_OK ? open_named(m, file, paths, err) : status;
}

mhe_status mhi_inspected_parse(mhi_inspected *m, const mhe_host *host, const char *name,
                               const char *text, size_t length, int32_t paths, mhe_error *err) {
    *m = (mhi_inspected){.host = mhi_host_or_silent(host)};
    mhe_status status = mhi_osim_parse(name, text, length, &m->file, err);
    if (status == MHE_OK) {
        status = mhi_osim_parse_unlocked(name, text, length, &m->all, err);
    }
    return status == MHE_OK ? open_named(m, name, paths, err) : status;
}

void mhi_inspected_close(mhi_inspected *m) {
    if (m->muscles != NULL) {
        m->muscle->destroy(m->muscles);
    }
    mhi_skeleton_close(&m->skeleton);
    mhi_registry_free(m->registry);
    mhi_description_free(m->all);
    mhi_description_free(m->file);
    mhi_arena_free(&m->arena);
}

void mhi_json_number(cJSON *object, const char *name, double value) {
    if (isfinite(value)) {
        (void)cJSON_AddNumberToObject(object, name, value);
    } else {
        (void)cJSON_AddNullToObject(object, name);
    }
}

cJSON *mhi_json_numbers(const double *values, int32_t n) {
    cJSON *list = cJSON_CreateArray();
    for (int32_t i = 0; i < n; i++) {
        (void)cJSON_AddItemToArray(list, isfinite(values[i]) ? cJSON_CreateNumber(values[i])
                                                             : cJSON_CreateNull());
    }
    return list;
}
