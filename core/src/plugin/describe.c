/* SPDX-License-Identifier: Apache-2.0 */
/* describe.c: what --describe ID prints, all of it from the plugin's tables. */
#include "plugin/describe_options.h"
#include "plugin/guard.h"
#include "plugin/registry.h"

#include <string.h>

/* Optional interfaces by id that a plugin may be asked for. */
static const char *const extension_ids[] = {"mhe.cost.hessian/1", "mhe.model.jacobian/1"};
#define EXTENSIONS ((int)(sizeof extension_ids / sizeof extension_ids[0]))

typedef struct extension_call {
    const mhe_plugin *plugin;
    const char *id;
    int answered;
} extension_call;

static mhe_status ask_extension(void *data) {
    extension_call *c = data;
    c->answered = c->plugin->extension(c->id) != NULL;
    return MHE_OK;
}

static int has_extension(const mhe_plugin *plugin, const char *id) {
    extension_call c = {plugin, id, 0};
    return plugin->extension != NULL && mhi_guard(ask_extension, &c, NULL) == MHE_OK && c.answered;
}

static void describe_text(const mhe_plugin *p, const char *file, mhi_text *out) {
    mhi_text_add(out, "%s %s\n%s\n\n", p->id, p->version, p->summary);
    if (p->reference != NULL) {
        mhi_text_add(out, "Reference: %s\n", p->reference);
    }
    mhi_text_add(out, "Interface: %s\nFile:      %s\n", p->iface, file);
    for (int i = 0; i < EXTENSIONS; i++) {
        if (has_extension(p, extension_ids[i])) {
            mhi_text_add(out, "Extension: %s\n", extension_ids[i]);
        }
    }
    mhi_text_add(out, p->option_count > 0 ? "\nOptions:\n" : "\nNo options.\n");
    mhi_options_text(p->options, (int32_t)p->option_count, out);
}

/* ---- markdown: nothing that differs between machines, READMEs embed it ---- */

static void describe_markdown(const mhe_plugin *p, mhi_text *out) {
    mhi_text_add(out, "`%s` (`%s`): %s\n", p->id, p->iface, p->summary);
    if (p->reference != NULL) {
        mhi_text_add(out, "\nReference: %s\n", p->reference);
    }
    for (int i = 0; i < EXTENSIONS; i++) {
        if (has_extension(p, extension_ids[i])) {
            mhi_text_add(out, "\nExtension: `%s`\n", extension_ids[i]);
        }
    }
    if (p->option_count == 0) {
        mhi_text_add(out, "\nNo options.\n");
        return;
    }
    mhi_text_add(out, "\n");
    mhi_options_markdown(p->options, (int32_t)p->option_count, out);
}

/* ---- JSON ---- */

static void describe_json(const mhe_plugin *p, const char *file, mhi_text *out) {
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "id", p->id);
    cJSON_AddStringToObject(root, "version", p->version);
    cJSON_AddStringToObject(root, "interface", p->iface);
    cJSON_AddStringToObject(root, "summary", p->summary);
    cJSON_AddItemToObject(root, "reference",
                          p->reference != NULL ? cJSON_CreateString(p->reference)
                                               : cJSON_CreateNull());
    cJSON_AddStringToObject(root, "file", file);
    cJSON *extensions = cJSON_AddArrayToObject(root, "extensions");
    for (int i = 0; i < EXTENSIONS; i++) {
        if (has_extension(p, extension_ids[i])) {
            cJSON_AddItemToArray(extensions, cJSON_CreateString(extension_ids[i]));
        }
    }
    cJSON_AddItemToObject(root, "options", mhi_options_json(p->options, (int32_t)p->option_count));
    mhi_print_json(root, out);
}

mhe_status mhi_registry_describe(mhi_registry *registry, const char *id, int32_t format,
                                 mhi_text *out, mhe_error *err) {
    const mhe_plugin *p = NULL;
    mhe_status status = mhi_registry_find(registry, id, NULL, &p, err);
    if (status != MHE_OK) {
        return status;
    }
    const char *file = "";
    for (int32_t i = 0; i < mhi_registry_count(registry); i++) {
        if (mhi_registry_at(registry, i) == p) {
            file = mhi_registry_file(registry, i);
        }
    }
    if (format == MHI_FORMAT_JSON) {
        describe_json(p, file, out);
    } else if (format == MHI_FORMAT_MARKDOWN) {
        describe_markdown(p, out);
    } else {
        describe_text(p, file, out);
    }
    return out->failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}
