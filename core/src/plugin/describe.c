/* SPDX-License-Identifier: Apache-2.0 */
/* describe.c: what --describe ID prints, all of it from the plugin's tables. */
#include "config/options_table.h"
#include "plugin/guard.h"
#include "plugin/registry.h"

#include <cjson/cJSON.h>
#include <math.h>
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

static const char *type_name(uint32_t type) {
    static const char *const names[] = {
        "?",    "real", "int",          "bool",         "text",
        "enum", "path", "list of real", "list of text", "map of text"};
    return type < sizeof names / sizeof names[0] ? names[type] : names[0];
}

static int is_number(const mhe_option *o) {
    return o->type == MHE_TYPE_REAL || o->type == MHE_TYPE_INT;
}

static int has_range(const mhe_option *o) {
    return (is_number(o) || o->type == MHE_TYPE_REAL_LIST) &&
           (o->min > -INFINITY || o->max < INFINITY);
}

/* The default as it would stand in YAML; "" where there is none. */
static const char *default_text(const mhe_option *o, char *out, size_t size) {
    out[0] = '\0';
    if ((o->flags & MHE_OPT_REQUIRED) != 0) {
        (void)snprintf(out, size, "required");
    } else if (is_number(o)) {
        (void)snprintf(out, size, "%.10g", o->real_default);
    } else if (o->type == MHE_TYPE_BOOL) {
        (void)snprintf(out, size, "%s", o->real_default != 0 ? "true" : "false");
    } else if (o->text_default != NULL) {
        (void)snprintf(out, size, "%s", o->text_default);
    }
    return out;
}

/* "0 .. 1", "at least 0", or the choices; "" where anything goes. */
static const char *range_text(const mhe_option *o, char *out, size_t size) {
    out[0] = '\0';
    if (o->type == MHE_TYPE_ENUM && o->choices != NULL) {
        size_t used = 0, n = 0;
        const char *choice = NULL;
        for (int32_t i = 0; (choice = mhi_choice_at(o->choices, i, &n)) != NULL; i++) {
            int more =
                snprintf(out + used, size - used, "%s%.*s", i == 0 ? "" : ", ", (int)n, choice);
            used += more > 0 && (size_t)more < size - used ? (size_t)more : 0;
        }
    } else if (has_range(o) && o->min > -INFINITY && o->max < INFINITY) {
        (void)snprintf(out, size, "%.10g .. %.10g", o->min, o->max);
    } else if (has_range(o)) {
        const int low = o->min > -INFINITY;
        (void)snprintf(out, size, "at %s %.10g", low ? "least" : "most", low ? o->min : o->max);
    }
    return out;
}

/* ---- text ---- */

static void option_text(const mhe_option *o, mhi_text *out) {
    char buffer[256];
    mhi_text_add(out, "  %s: %s", o->key, type_name(o->type));
    if (o->unit != NULL) {
        mhi_text_add(out, " [%s]", o->unit);
    }
    if (default_text(o, buffer, sizeof buffer)[0] != '\0') {
        const int required = (o->flags & MHE_OPT_REQUIRED) != 0;
        mhi_text_add(out, "%s%s", required ? ", " : ", default ", buffer);
    }
    if (range_text(o, buffer, sizeof buffer)[0] != '\0') {
        mhi_text_add(out, "%s%s", o->type == MHE_TYPE_ENUM ? "; one of " : "; ", buffer);
    }
    if ((o->flags & MHE_OPT_DEPRECATED) != 0) {
        mhi_text_add(out, "; deprecated%s%s", o->replaced_by != NULL ? ", use " : "",
                     o->replaced_by != NULL ? o->replaced_by : "");
    }
    mhi_text_add(out, "%s\n      %s\n", (o->flags & MHE_OPT_ADVANCED) != 0 ? "; advanced" : "",
                 o->help != NULL ? o->help : "");
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
    for (uint32_t i = 0; i < p->option_count; i++) {
        option_text(&p->options[i], out);
    }
}

/* ---- markdown: nothing that differs between machines, READMEs embed it ---- */

/* A table cell: '|' would end it. */
static void add_cell(mhi_text *out, const char *text) {
    mhi_text_add(out, " ");
    for (; text != NULL && *text != '\0'; text++) {
        mhi_text_add(out, *text == '|' ? "\\%c" : "%c", *text);
    }
    mhi_text_add(out, " |");
}

static void option_markdown(const mhe_option *o, mhi_text *out) {
    char buffer[256];
    mhi_text_add(out, "| `%s` |", o->key);
    add_cell(out, type_name(o->type));
    add_cell(out, o->unit);
    add_cell(out, default_text(o, buffer, sizeof buffer));
    add_cell(out, range_text(o, buffer, sizeof buffer));
    mhi_text help = {0};
    mhi_text_add(&help, "%s", o->help != NULL ? o->help : "");
    if ((o->flags & MHE_OPT_DEPRECATED) != 0) {
        mhi_text_add(&help, " Deprecated%s%s.", o->replaced_by != NULL ? ": use " : "",
                     o->replaced_by != NULL ? o->replaced_by : "");
    }
    add_cell(out, help.data);
    out->failed |= help.failed;
    mhi_text_free(&help);
    mhi_text_add(out, "\n");
}

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
    mhi_text_add(out, "\n| Key | Type | Unit | Default | Range | Meaning |\n"
                      "|---|---|---|---|---|---|\n");
    for (uint32_t i = 0; i < p->option_count; i++) {
        option_markdown(&p->options[i], out);
    }
}

/* ---- JSON ---- */

static cJSON *text_or_null(const char *text) {
    return text != NULL ? cJSON_CreateString(text) : cJSON_CreateNull();
}

static cJSON *default_json(const mhe_option *o) {
    if ((o->flags & MHE_OPT_REQUIRED) != 0) {
        return cJSON_CreateNull();
    }
    if (o->type == MHE_TYPE_BOOL) {
        return cJSON_CreateBool(o->real_default != 0);
    }
    return is_number(o) ? cJSON_CreateNumber(o->real_default) : text_or_null(o->text_default);
}

static cJSON *choices_json(const char *choices) {
    cJSON *list = cJSON_CreateArray();
    size_t n = 0;
    const char *choice = NULL;
    for (int32_t i = 0; (choice = mhi_choice_at(choices, i, &n)) != NULL; i++) {
        char one[128];
        (void)snprintf(one, sizeof one, "%.*s", (int)n, choice);
        cJSON_AddItemToArray(list, cJSON_CreateString(one));
    }
    return list;
}

static cJSON *option_json(const mhe_option *o) {
    cJSON *item = cJSON_CreateObject();
    cJSON_AddStringToObject(item, "key", o->key);
    cJSON_AddStringToObject(item, "type", type_name(o->type));
    cJSON_AddItemToObject(item, "unit", text_or_null(o->unit));
    cJSON_AddItemToObject(item, "default", default_json(o));
    if (has_range(o)) { /* JSON has no infinity: an open end is null */
        cJSON_AddNumberToObject(item, "min", o->min);
        cJSON_AddNumberToObject(item, "max", o->max);
    }
    if (o->type == MHE_TYPE_ENUM && o->choices != NULL) {
        cJSON_AddItemToObject(item, "choices", choices_json(o->choices));
    }
    cJSON_AddBoolToObject(item, "required", (o->flags & MHE_OPT_REQUIRED) != 0);
    cJSON_AddBoolToObject(item, "advanced", (o->flags & MHE_OPT_ADVANCED) != 0);
    cJSON_AddBoolToObject(item, "deprecated", (o->flags & MHE_OPT_DEPRECATED) != 0);
    if (o->replaced_by != NULL) {
        cJSON_AddStringToObject(item, "replaced_by", o->replaced_by);
    }
    cJSON_AddItemToObject(item, "help", text_or_null(o->help));
    return item;
}

static void describe_json(const mhe_plugin *p, const char *file, mhi_text *out) {
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "id", p->id);
    cJSON_AddStringToObject(root, "version", p->version);
    cJSON_AddStringToObject(root, "interface", p->iface);
    cJSON_AddStringToObject(root, "summary", p->summary);
    cJSON_AddItemToObject(root, "reference", text_or_null(p->reference));
    cJSON_AddStringToObject(root, "file", file);
    cJSON *extensions = cJSON_AddArrayToObject(root, "extensions");
    for (int i = 0; i < EXTENSIONS; i++) {
        if (has_extension(p, extension_ids[i])) {
            cJSON_AddItemToArray(extensions, cJSON_CreateString(extension_ids[i]));
        }
    }
    cJSON *options = cJSON_AddArrayToObject(root, "options");
    for (uint32_t i = 0; i < p->option_count; i++) {
        cJSON_AddItemToArray(options, option_json(&p->options[i]));
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
