/* SPDX-License-Identifier: Apache-2.0 */
/* describe_options.c: an option table as text, as a markdown table, as JSON. */
#include "plugin/describe_options.h"

#include "config/options_table.h"

#include <float.h>

static const char *type_name(uint32_t type) {
    static const char *const names[] = {
        "?",    "real", "int",          "bool",         "text",
        "enum", "path", "list of real", "list of text", "map of text"};
    return type < sizeof names / sizeof names[0] ? names[type] : names[0];
}

static int is_number(const mhe_option *o) {
    return o->type == MHE_TYPE_REAL || o->type == MHE_TYPE_INT;
}

/* A bound that says no more than the field's own type is none. */
static int has_low(const mhe_option *o) {
    return o->min > (o->type == MHE_TYPE_INT ? (double)INT32_MIN : -DBL_MAX);
}

static int has_high(const mhe_option *o) {
    return o->max < (o->type == MHE_TYPE_INT ? (double)INT32_MAX : DBL_MAX);
}

static int has_range(const mhe_option *o) {
    return (is_number(o) || o->type == MHE_TYPE_REAL_LIST) && (has_low(o) || has_high(o));
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
    } else if (has_range(o) && has_low(o) && has_high(o)) {
        (void)snprintf(out, size, "%.10g .. %.10g", o->min, o->max);
    } else if (has_range(o)) {
        const int low = has_low(o);
        (void)snprintf(out, size, "at %s %.10g", low ? "least" : "most", low ? o->min : o->max);
    }
    return out;
}

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

void mhi_options_text(const mhe_option *options, int32_t n, mhi_text *out) {
    for (int32_t i = 0; i < n; i++) {
        option_text(&options[i], out);
    }
}

void mhi_options_markdown(const mhe_option *options, int32_t n, mhi_text *out) {
    mhi_text_add(out, "| Key | Type | Unit | Default | Range | Meaning |\n"
                      "|---|---|---|---|---|---|\n");
    for (int32_t i = 0; i < n; i++) {
        option_markdown(&options[i], out);
    }
}

cJSON *mhi_options_json(const mhe_option *options, int32_t n) {
    cJSON *list = cJSON_CreateArray();
    for (int32_t i = 0; i < n; i++) {
        cJSON_AddItemToArray(list, option_json(&options[i]));
    }
    return list;
}

void mhi_print_json(cJSON *root, mhi_text *out) {
    char *text = cJSON_Print(root);
    if (text != NULL) {
        mhi_text_add(out, "%s\n", text);
    } else {
        out->failed = 1;
    }
    cJSON_free(text);
    cJSON_Delete(root);
}
