/* SPDX-License-Identifier: Apache-2.0 */
/* list.c: what --list-plugins prints. */
#include "plugin/registry.h"

#include <cjson/cJSON.h>
#include <stdlib.h>
#include <string.h>

static void list_json(mhi_registry *registry, mhi_text *out) {
    cJSON *root = cJSON_CreateObject();
    cJSON *plugins = cJSON_AddArrayToObject(root, "plugins");
    for (int32_t i = 0; i < mhi_registry_count(registry); i++) {
        const mhe_plugin *p = mhi_registry_at(registry, i);
        cJSON *item = cJSON_CreateObject();
        cJSON_AddStringToObject(item, "id", p->id);
        cJSON_AddStringToObject(item, "version", p->version);
        cJSON_AddStringToObject(item, "interface", p->iface);
        cJSON_AddStringToObject(item, "summary", p->summary);
        cJSON_AddStringToObject(item, "file", mhi_registry_file(registry, i));
        cJSON_AddItemToArray(plugins, item);
    }
    cJSON *refused = cJSON_AddArrayToObject(root, "refused");
    for (int32_t i = 0; i < mhi_registry_refused_count(registry); i++) {
        cJSON_AddItemToArray(refused, cJSON_CreateString(mhi_registry_refused(registry, i)));
    }
    char *text = cJSON_Print(root);
    if (text != NULL) {
        mhi_text_add(out, "%s\n", text);
    } else {
        out->failed = 1;
    }
    cJSON_free(text);
    cJSON_Delete(root);
}

static int widest(int width, const char *text) {
    int n = (int)strlen(text);
    return n > width ? n : width;
}

static void list_text(mhi_registry *registry, mhi_text *out) {
    const int32_t n = mhi_registry_count(registry);
    int id = 2, version = 7, iface = 9, summary = 7;
    for (int32_t i = 0; i < n; i++) {
        const mhe_plugin *p = mhi_registry_at(registry, i);
        id = widest(id, p->id);
        version = widest(version, p->version);
        iface = widest(iface, p->iface);
        summary = widest(summary, p->summary);
    }
    mhi_text_add(out, "%-*s  %-*s  %-*s  %-*s  %s\n", id, "ID", version, "VERSION", iface,
                 "INTERFACE", summary, "SUMMARY", "FILE");
    for (int32_t i = 0; i < n; i++) {
        const mhe_plugin *p = mhi_registry_at(registry, i);
        mhi_text_add(out, "%-*s  %-*s  %-*s  %-*s  %s\n", id, p->id, version, p->version, iface,
                     p->iface, summary, p->summary, mhi_registry_file(registry, i));
    }
}

static void list_markdown(mhi_registry *registry, mhi_text *out) {
    mhi_text_add(out, "| Id | Version | Interface | Summary |\n|---|---|---|---|\n");
    for (int32_t i = 0; i < mhi_registry_count(registry); i++) {
        const mhe_plugin *p = mhi_registry_at(registry, i);
        mhi_text_add(out, "| `%s` | %s | `%s` | %s |\n", p->id, p->version, p->iface, p->summary);
    }
}

void mhi_registry_list(mhi_registry *registry, int32_t format, mhi_text *out) {
    if (format == MHI_FORMAT_JSON) {
        list_json(registry, out);
        return;
    }
    if (format == MHI_FORMAT_MARKDOWN) {
        list_markdown(registry, out);
    } else {
        list_text(registry, out);
    }
    const int32_t n = mhi_registry_refused_count(registry);
    for (int32_t i = 0; i < n; i++) {
        mhi_text_add(out, "%s%s%s\n", i == 0 ? "\nRefused:\n" : "",
                     format == MHI_FORMAT_MARKDOWN ? "- " : "  ",
                     mhi_registry_refused(registry, i));
    }
}
