/* SPDX-License-Identifier: Apache-2.0 */
/* options_write.c: a filled config as YAML that reads back the same. */
#include "config/options.h"
#include "config/options_table.h"
#include "config/yaml_scalar.h"

static void write_real(double value, mhi_text *out) {
    char number[MHI_YAML_REAL_SIZE];
    mhi_text_add(out, "%s", mhi_yaml_real(value, number));
}

static void write_value(const mhe_option *option, const void *field, mhi_text *out) {
    switch (option->type) {
    case MHE_TYPE_REAL:
        write_real(*(const double *)field, out);
        break;
    case MHE_TYPE_INT:
        mhi_text_add(out, "%d", (int)*(const int32_t *)field);
        break;
    case MHE_TYPE_BOOL:
        mhi_text_add(out, "%s", *(const int32_t *)field ? "true" : "false");
        break;
    case MHE_TYPE_ENUM: {
        size_t length = 0;
        const char *choice = mhi_choice_at(option->choices, *(const int32_t *)field, &length);
        mhi_yaml_text_n(choice, length, out);
        break;
    }
    case MHE_TYPE_TEXT:
    case MHE_TYPE_PATH:
        mhi_yaml_text(*(const char *const *)field, out);
        break;
    case MHE_TYPE_REAL_LIST: {
        const mhe_real_list *list = field;
        mhi_text_add(out, "[");
        for (int32_t i = 0; i < list->n; i++) {
            mhi_text_add(out, "%s", i > 0 ? ", " : "");
            write_real(list->values[i], out);
        }
        mhi_text_add(out, "]");
        break;
    }
    case MHE_TYPE_TEXT_LIST: {
        const mhe_text_list *list = field;
        mhi_text_add(out, "[");
        for (int32_t i = 0; i < list->n; i++) {
            mhi_text_add(out, "%s", i > 0 ? ", " : "");
            mhi_yaml_text(list->values[i], out);
        }
        mhi_text_add(out, "]");
        break;
    }
    default: {
        const mhe_text_map *map = field;
        mhi_text_add(out, "{");
        for (int32_t i = 0; i < map->n; i++) {
            mhi_text_add(out, "%s", i > 0 ? ", " : "");
            mhi_yaml_text(map->keys[i], out);
            mhi_text_add(out, ": ");
            mhi_yaml_text(map->values[i], out);
        }
        mhi_text_add(out, "}");
    }
    }
}

void mhi_options_write(const mhe_option *options, int32_t n_options, const void *config,
                       int32_t indent, mhi_text *out) {
    for (int32_t i = 0; i < n_options; i++) {
        if (!(options[i].flags & MHE_OPT_DEPRECATED)) { /* its successor holds the value */
            mhi_text_add(out, "%*s%s: ", (int)indent, "", options[i].key);
            write_value(&options[i], (const unsigned char *)config + options[i].offset, out);
            mhi_text_add(out, "\n");
        }
    }
}
