/* SPDX-License-Identifier: Apache-2.0 */
/* options_value.c: one YAML value becomes one field. Every message says where, which option, what
 * is wrong and what would be right. */
#include "config/options_value.h"

#include "config/options_table.h"
#include "config/yaml_scalar.h"

#include <float.h>

#include <math.h>
#include <string.h>

/* ---- messages ---- */

mhe_status mhi_filler_refuse(const mhi_filler *f, const mhi_node *node, const char *format, ...) {
    char text[512];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    const char *what = f->what == NULL ? "" : f->what;
    return mhi_fail_at(f->err, MHE_E_CONFIG, f->tree, node, "%s%s%s", what,
                       *what == '\0' ? "" : ": ", text);
}

mhe_status mhi_filler_no_memory(const mhi_filler *f) {
    return mhe_fail(f->err, MHE_E_MEMORY, "out of memory");
}

#define SHOWN 64
/* A node as a message shows it: its text, cut short, or what kind of thing it is. */
static const char *shown(const mhi_node *node, char out[SHOWN]) {
    if (node->kind != MHI_SCALAR) {
        return node->kind == MHI_SEQUENCE ? "a list" : "a mapping";
    }
    if (mhi_node_is_null(node)) {
        return "without a value";
    }
    const char *quote = node->quoted ? "\"" : "'";
    int cut = 40;
    while (cut > 0 && strlen(node->text) > 40 && ((unsigned char)node->text[cut] & 0xc0) == 0x80) {
        cut--; /* not inside a UTF-8 character */
    }
    (void)snprintf(out, SHOWN, "%s%.*s%s%s", quote, cut, node->text,
                   strlen(node->text) > 40 ? "..." : "", quote);
    return out;
}

/* "a number (rad)": what an option of this type wants. */
static const char *wanted(const mhe_option *option, char out[SHOWN]) {
    static const char *const names[] = {
        [MHE_TYPE_REAL] = "a number",
        [MHE_TYPE_INT] = "an integer",
        [MHE_TYPE_BOOL] = "true or false",
        [MHE_TYPE_TEXT] = "a text",
        [MHE_TYPE_ENUM] = "a text",
        [MHE_TYPE_PATH] = "a path",
        [MHE_TYPE_REAL_LIST] = "a list of numbers",
        [MHE_TYPE_TEXT_LIST] = "a list of texts",
        [MHE_TYPE_TEXT_MAP] = "a mapping of texts",
    };
    int unit = option->unit != NULL && strcmp(option->unit, "1") != 0;
    (void)snprintf(out, SHOWN, "%s%s%.30s%s", names[option->type], unit ? " (" : "",
                   unit ? option->unit : "", unit ? ")" : "");
    return out;
}

static int is_number_type(const mhe_option *option) {
    return option->type == MHE_TYPE_REAL || option->type == MHE_TYPE_INT ||
           option->type == MHE_TYPE_REAL_LIST;
}

/* What to do about the commonest mistakes. */
static const char *remedy(const mhe_option *option, const mhi_node *node) {
    double value = 0;
    if (node->kind != MHI_SCALAR || mhi_node_is_null(node)) {
        return "";
    }
    if (node->quoted && (is_number_type(option) || option->type == MHE_TYPE_BOOL)) {
        return "; leave out the quotes";
    }
    if (option->type == MHE_TYPE_REAL_LIST && mhi_yaml_number(node->text, &value)) {
        return "; put it in brackets";
    }
    if (is_number_type(option) && strpbrk(node->text, " ,") != NULL) {
        return "; write the number alone, without a unit, with a decimal point";
    }
    return "";
}

static mhe_status wrong_type(const mhi_filler *f, const mhe_option *option, const mhi_node *node) {
    char is[SHOWN], want[SHOWN];
    return mhi_filler_refuse(f, node, "'%s' must be %s, not %s%s", option->key,
                             wanted(option, want), shown(node, is), remedy(option, node));
}

/* ---- scalars ---- */

static mhe_status check_range(const mhi_filler *f, const mhe_option *option, const mhi_node *node,
                              double value) {
    char low[MHI_YAML_REAL_SIZE], high[MHI_YAML_REAL_SIZE], is[SHOWN];
    if (value >= option->min && value <= option->max) {
        return MHE_OK;
    }
    shown(node, is);
    if (isinf(value)) {
        return mhi_filler_refuse(f, node, "'%s' must be finite, not %s", option->key, is);
    }
    mhi_yaml_real(option->min, low);
    mhi_yaml_real(option->max, high);
    double largest = option->type == MHE_TYPE_INT ? INT32_MAX : DBL_MAX;
    if (option->max >= largest) {
        return mhi_filler_refuse(f, node, "'%s' must be at least %s, not %s", option->key, low, is);
    }
    if (option->min <= -largest) {
        return mhi_filler_refuse(f, node, "'%s' must be at most %s, not %s", option->key, high, is);
    }
    return mhi_filler_refuse(f, node, "'%s' must lie in %s .. %s, not %s", option->key, low, high,
                             is);
}

static mhe_status read_real(const mhi_filler *f, const mhe_option *option, const mhi_node *node,
                            double *out) {
    if (node->kind != MHI_SCALAR || node->quoted || !mhi_yaml_number(node->text, out)) {
        return wrong_type(f, option, node);
    }
    return check_range(f, option, node, *out);
}

static mhe_status read_int(const mhi_filler *f, const mhe_option *option, const mhi_node *node,
                           int32_t *out) {
    double value = 0;
    if (node->kind != MHI_SCALAR || node->quoted || !mhi_yaml_number(node->text, &value) ||
        value != floor(value)) { /* 1e3 and 7.0 are integers */
        return wrong_type(f, option, node);
    }
    if (value < INT32_MIN || value > INT32_MAX) {
        return mhi_filler_refuse(f, node, "'%s' must fit into 32 bits", option->key);
    }
    *out = (int32_t)value;
    return check_range(f, option, node, value);
}

static mhe_status read_bool(const mhi_filler *f, const mhe_option *option, const mhi_node *node,
                            int32_t *out) {
    static const char *const spellings[][3] = {
        {"false", "False", "FALSE"}, {"true", "True", "TRUE"}, {"no", "No", "NO"},
        {"yes", "Yes", "YES"},       {"off", "Off", "OFF"},    {"on", "On", "ON"},
    };
    if (node->kind == MHI_SCALAR && !node->quoted) {
        for (size_t i = 0; i < sizeof spellings / sizeof spellings[0] * 3; i++) {
            if (strcmp(node->text, spellings[i / 3][i % 3]) == 0) {
                *out = (int32_t)(i / 3 % 2);
                return MHE_OK;
            }
        }
    }
    return wrong_type(f, option, node);
}

/* Text of a scalar, plain or quoted; numbers are text too. */
static mhe_status read_text(const mhi_filler *f, const mhe_option *option, const mhi_node *node,
                            const char **out) {
    if (node->kind != MHI_SCALAR || mhi_node_is_null(node)) {
        return wrong_type(f, option, node);
    }
    *out = mhi_arena_text(f->arena, node->text);
    return *out == NULL ? mhi_filler_no_memory(f) : MHE_OK;
}

static mhe_status read_enum(const mhi_filler *f, const mhe_option *option, const mhi_node *node,
                            int32_t *out) {
    const char *text = NULL;
    mhe_status status = read_text(f, option, node, &text);
    if (status != MHE_OK) {
        return status;
    }
    *out = mhi_choice_find(option->choices, text);
    if (*out >= 0) {
        return MHE_OK;
    }
    const char *names[MHI_MAX_NAMES], *choice = NULL;
    size_t length = 0;
    int32_t n = 0;
    while (n < MHI_MAX_NAMES && (choice = mhi_choice_at(option->choices, n, &length)) != NULL) {
        names[n] = mhi_arena_text_n(f->arena, choice, length);
        if (names[n++] == NULL) {
            return mhi_filler_no_memory(f);
        }
    }
    char hint[256], is[SHOWN];
    return mhi_filler_refuse(f, node, "'%s' cannot be %s%s", option->key, shown(node, is),
                             mhi_suggest(hint, sizeof hint, text, names, n));
}

const char *mhi_path_absolute(const char *dir, const char *path, mhi_arena *arena) {
    if (path[0] == '/' || dir == NULL) {
        return mhi_arena_text(arena, path);
    }
    while (strncmp(path, "./", 2) == 0 && path[2] != '\0') {
        path += 2;
    }
    size_t n = strlen(dir);
    return mhi_arena_format(arena, "%s%s%s", dir, n > 0 && dir[n - 1] == '/' ? "" : "/", path);
}

static mhe_status read_path(const mhi_filler *f, const mhe_option *option, const mhi_node *node,
                            const char **out) {
    if (node->kind != MHI_SCALAR || node->text[0] == '\0') {
        return wrong_type(f, option, node);
    }
    *out = mhi_path_absolute(f->dir, node->text, f->arena);
    return *out == NULL ? mhi_filler_no_memory(f) : MHE_OK;
}

/* ---- lists ---- */

static mhe_status read_reals(const mhi_filler *f, const mhe_option *option, const mhi_node *node,
                             mhe_real_list *out) {
    if (node->kind != MHI_SEQUENCE) {
        return wrong_type(f, option, node);
    }
    int32_t n = mhi_node_count(node);
    double *values = MHI_TAKE(f->arena, double, n);
    if (values == NULL) {
        return mhi_filler_no_memory(f);
    }
    *out = (mhe_real_list){.values = values, .n = n};
    for (const mhi_node *item = node->first; item != NULL; item = item->next) {
        mhe_status status = read_real(f, option, item, values++);
        if (status != MHE_OK) {
            return status;
        }
    }
    return MHE_OK;
}

static mhe_status read_texts(const mhi_filler *f, const mhe_option *option, const mhi_node *node,
                             mhe_text_list *out) {
    if (node->kind == MHI_MAPPING) {
        return wrong_type(f, option, node);
    }
    /* one text is a list of one */
    const mhi_node *item = node->kind == MHI_SCALAR ? node : node->first;
    int32_t n = node->kind == MHI_SCALAR ? 1 : mhi_node_count(node);
    const char **values = MHI_TAKE(f->arena, const char *, n);
    if (values == NULL) {
        return mhi_filler_no_memory(f);
    }
    *out = (mhe_text_list){.values = values, .n = n};
    for (int32_t i = 0; i < n; i++, item = item->next) {
        mhe_status status = read_text(f, option, item, &values[i]);
        if (status != MHE_OK) {
            return status;
        }
    }
    return MHE_OK;
}

static mhe_status read_map(const mhi_filler *f, const mhe_option *option, const mhi_node *node,
                           mhe_text_map *out) {
    if (node->kind != MHI_MAPPING) {
        return wrong_type(f, option, node);
    }
    int32_t n = mhi_node_count(node), i = 0;
    const char **keys = MHI_TAKE(f->arena, const char *, n);
    const char **values = MHI_TAKE(f->arena, const char *, n);
    if (keys == NULL || values == NULL) {
        return mhi_filler_no_memory(f);
    }
    *out = (mhe_text_map){.keys = keys, .values = values, .n = n};
    for (const mhi_node *item = node->first; item != NULL; item = item->next, i++) {
        keys[i] = mhi_arena_text(f->arena, item->key);
        mhe_status status = read_text(f, option, item, &values[i]);
        if (status != MHE_OK || keys[i] == NULL) {
            return status != MHE_OK ? status : mhi_filler_no_memory(f);
        }
    }
    return MHE_OK;
}

/* ---- any type ---- */

mhe_status mhi_filler_read(const mhi_filler *f, const mhe_option *option, const mhi_node *node) {
    void *field = (unsigned char *)f->config + option->offset;
    /* "nothing" is a value for what can be empty, and only there */
    if (mhi_node_is_null(node) && !(option->flags & MHE_OPT_REQUIRED) &&
        (option->type == MHE_TYPE_PATH || option->type >= MHE_TYPE_REAL_LIST)) {
        memset(field, 0, mhi_option_field_size(option->type));
        return MHE_OK;
    }
    switch (option->type) {
    case MHE_TYPE_REAL:
        return read_real(f, option, node, field);
    case MHE_TYPE_INT:
        return read_int(f, option, node, field);
    case MHE_TYPE_BOOL:
        return read_bool(f, option, node, field);
    case MHE_TYPE_ENUM:
        return read_enum(f, option, node, field);
    case MHE_TYPE_TEXT:
        return read_text(f, option, node, field);
    case MHE_TYPE_PATH:
        return read_path(f, option, node, field);
    case MHE_TYPE_REAL_LIST:
        return read_reals(f, option, node, field);
    case MHE_TYPE_TEXT_LIST:
        return read_texts(f, option, node, field);
    default:
        return read_map(f, option, node, field);
    }
}

mhe_status mhi_filler_default(const mhi_filler *f, const mhe_option *option) {
    void *field = (unsigned char *)f->config + option->offset;
    switch (option->type) {
    case MHE_TYPE_REAL:
        *(double *)field = option->real_default;
        break;
    case MHE_TYPE_INT:
    case MHE_TYPE_BOOL:
        *(int32_t *)field = (int32_t)option->real_default;
        break;
    case MHE_TYPE_ENUM:
        *(int32_t *)field = mhi_choice_find(option->choices, option->text_default);
        break;
    case MHE_TYPE_TEXT:
        *(const char **)field = option->text_default == NULL ? "" : option->text_default;
        break;
    case MHE_TYPE_PATH:
        *(const char **)field = option->text_default == NULL
                                    ? NULL
                                    : mhi_path_absolute(f->dir, option->text_default, f->arena);
        return option->text_default != NULL && *(const char **)field == NULL
                   ? mhi_filler_no_memory(f)
                   : MHE_OK;
    default: /* lists and maps are empty, as the zeroed struct has them */
        break;
    }
    return MHE_OK;
}
