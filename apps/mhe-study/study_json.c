/* SPDX-License-Identifier: Apache-2.0 */
#include "study_json.h"

#include "config/yaml_scalar.h"
#include "io/slurp.h"

#include <cJSON.h>
#include <mhe/version.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A node as JSON: numbers and truth values where they are not in quotes. */
static cJSON *from_node(const mhi_node *node) {
    double number = 0;
    if (node->kind == MHI_SCALAR) {
        if (mhi_node_is_null(node)) {
            return cJSON_CreateNull();
        }
        if (!node->quoted &&
            (strcmp(node->text, "true") == 0 || strcmp(node->text, "false") == 0)) {
            return cJSON_CreateBool(node->text[0] == 't');
        }
        return !node->quoted && mhi_yaml_number(node->text, &number)
                   ? cJSON_CreateNumber(number)
                   : cJSON_CreateString(node->text);
    }
    cJSON *result = node->kind == MHI_MAPPING ? cJSON_CreateObject() : cJSON_CreateArray();
    for (const mhi_node *child = node->first; child != NULL; child = child->next) {
        if (node->kind == MHI_MAPPING) {
            cJSON_AddItemToObject(result, child->key, from_node(child));
        } else {
            cJSON_AddItemToArray(result, from_node(child));
        }
    }
    return result;
}

/* The processor's name; empty where /proc does not tell. */
static void processor(char *out, size_t size) {
    char line[256];
    FILE *file = fopen("/proc/cpuinfo", "r");
    out[0] = '\0';
    while (file != NULL && out[0] == '\0' && fgets(line, sizeof line, file) != NULL) {
        const char *colon = strncmp(line, "model name", 10) == 0 ? strchr(line, ':') : NULL;
        if (colon != NULL) {
            (void)snprintf(out, size, "%.*s", (int)strcspn(colon + 2, "\n"), colon + 2);
        }
    }
    if (file != NULL) {
        (void)fclose(file);
    }
}

static void add_factors(cJSON *root, const study *s) {
    cJSON *list = cJSON_AddArrayToObject(root, "factors");
    for (int32_t i = 0; i < s->n_factors; i++) {
        const factor *f = &s->factors[i];
        cJSON *entry = cJSON_CreateObject();
        cJSON_AddItemToArray(list, entry);
        cJSON_AddStringToObject(entry, "name", f->name);
        cJSON *levels = cJSON_AddArrayToObject(entry, "levels");
        for (int32_t k = 0; k < f->n_levels; k++) {
            cJSON_AddItemToArray(levels, cJSON_CreateString(f->levels[k].label));
        }
    }
}

static void add_conditions(cJSON *root, const study *s) {
    cJSON *list = cJSON_AddArrayToObject(root, "conditions");
    for (int32_t i = 0; i < s->n_conditions; i++) {
        const condition *c = &s->conditions[i];
        cJSON *entry = cJSON_CreateObject(), *labels = cJSON_CreateObject();
        cJSON_AddItemToArray(list, entry);
        cJSON_AddItemToObject(entry, "labels", labels);
        for (int32_t k = 0; k < s->n_factors; k++) {
            cJSON_AddStringToObject(labels, s->factors[k].name, study_label(s, c, k));
        }
        cJSON_AddNumberToObject(entry, "trials", c->trials);
        cJSON_AddStringToObject(entry, "reference", c->reference == NULL ? "" : c->reference);
        cJSON_AddStringToObject(entry, "motion", c->motion_path == NULL ? "" : c->motion_path);
        cJSON_AddBoolToObject(entry, "forces", c->keep_forces);
        cJSON_AddNumberToObject(entry, "emg_level", c->noise.emg.level);
    }
}

mhe_status study_json(const study *s, mhi_text *out, mhe_error *err) {
    char cpu[200], file[4096];
    const char *slash = strrchr(s->path, '/');
    (void)snprintf(file, sizeof file, "%s/%s", s->dir, slash == NULL ? s->path : slash + 1);
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "name", s->name);
    cJSON_AddStringToObject(root, "file", file);
    cJSON *set = cJSON_AddArrayToObject(root, "set");
    for (int32_t i = 0; i < s->n_override; i++) {
        cJSON_AddItemToArray(set, cJSON_CreateString(s->override[i]));
    }
    cJSON_AddStringToObject(root, "version", MHE_VERSION);
    processor(cpu, sizeof cpu);
    cJSON_AddStringToObject(root, "processor", cpu);
    cJSON_AddNumberToObject(root, "seed", s->keys.seed);
    cJSON_AddStringToObject(root, "measure",
                            s->keys.measure == MEASURE_TIMING ? "timing" : "errors");
    cJSON_AddNumberToObject(root, "exclude_below", s->keys.exclude_below);
    cJSON_AddNumberToObject(root, "n_trials", s->n_trials);
    add_factors(root, s);
    const mhi_node *report = mhi_node_find(mhi_tree_root(s->tree), "report");
    cJSON_AddItemToObject(root, "report",
                          report == NULL ? cJSON_CreateObject() : from_node(report));
    add_conditions(root, s);
    char *text = cJSON_Print(root);
    cJSON_Delete(root);
    if (text == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhi_text_add(out, "%s\n", text);
    cJSON_free(text);
    return MHE_OK;
}

mhe_status study_json_origin(const char *dir, mhi_arena *arena, const char **file,
                             const char ***set, int32_t *n_set, mhe_error *err) {
    const char *path = mhi_arena_format(arena, "%s/study.json", dir);
    char *text = NULL;
    size_t length = 0;
    mhe_status status = path == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                     : mhi_slurp(path, &text, &length, err);
    cJSON *root = status == MHE_OK ? cJSON_Parse(text) : NULL;
    const cJSON *name = cJSON_GetObjectItem(root, "file");
    const cJSON *list = cJSON_GetObjectItem(root, "set");
    if (status == MHE_OK && (!cJSON_IsString(name) || !cJSON_IsArray(list))) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: this is not the study.json of a study", path);
    }
    if (status == MHE_OK) {
        const cJSON *entry = NULL;
        *n_set = 0;
        *file = mhi_arena_text(arena, name->valuestring);
        *set = MHI_TAKE(arena, const char *, cJSON_GetArraySize(list));
        cJSON_ArrayForEach(entry, list) {
            if (*set != NULL && cJSON_IsString(entry)) {
                (*set)[(*n_set)++] = mhi_arena_text(arena, entry->valuestring);
            }
        }
        status =
            *file == NULL || *set == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    cJSON_Delete(root);
    free(text);
    return status;
}
