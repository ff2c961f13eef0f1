/* SPDX-License-Identifier: Apache-2.0 */
/* options_table.c: is an option table itself sound? A plugin with a wrong table is refused at load,
 * so that filling never meets one. */
#include "config/options_table.h"

#include "config/options.h"

#include <math.h>
#include <string.h>

#define KNOWN_FLAGS (MHE_OPT_REQUIRED | MHE_OPT_ADVANCED | MHE_OPT_DEPRECATED)

const mhe_option *mhi_option_find(const mhe_option *options, int32_t n_options, const char *key) {
    for (int32_t i = 0; i < n_options; i++) {
        if (strcmp(options[i].key, key) == 0) {
            return &options[i];
        }
    }
    return NULL;
}

const char *mhi_choice_at(const char *choices, int32_t i, size_t *length) {
    for (; i > 0; i--) {
        choices = strchr(choices, '|');
        if (choices == NULL) {
            return NULL;
        }
        choices++;
    }
    *length = strcspn(choices, "|");
    return choices;
}

int32_t mhi_choice_find(const char *choices, const char *text) {
    size_t length = 0;
    const char *choice = NULL;
    for (int32_t i = 0; (choice = mhi_choice_at(choices, i, &length)) != NULL; i++) {
        if (strlen(text) == length && strncmp(choice, text, length) == 0) {
            return i;
        }
    }
    return -1;
}

size_t mhi_option_field_size(uint32_t type) {
    switch (type) {
    case MHE_TYPE_REAL:
        return sizeof(double);
    case MHE_TYPE_INT:
    case MHE_TYPE_BOOL:
    case MHE_TYPE_ENUM:
        return sizeof(int32_t);
    case MHE_TYPE_TEXT:
    case MHE_TYPE_PATH:
        return sizeof(const char *);
    case MHE_TYPE_REAL_LIST:
        return sizeof(mhe_real_list);
    case MHE_TYPE_TEXT_LIST:
        return sizeof(mhe_text_list);
    case MHE_TYPE_TEXT_MAP:
        return sizeof(mhe_text_map);
    default:
        return 0;
    }
}

static int well_formed_key(const char *key) {
    if (*key < 'a' || *key > 'z') {
        return 0;
    }
    return key[strspn(key, "abcdefghijklmnopqrstuvwxyz0123456789_")] == '\0';
}

static const char *check_key(const mhe_option *options, int32_t i) {
    const mhe_option *option = &options[i];
    if (!well_formed_key(option->key)) {
        return "the key is not made of lower-case letters, digits and '_'";
    }
    if (mhi_option_find(options, i, option->key) != NULL) {
        return "the key occurs twice";
    }
    if (option->help == NULL || option->help[0] == '\0') {
        return "there is no help text";
    }
    return NULL;
}

static const char *check_field(const mhe_option *options, int32_t i, uint32_t config_size) {
    const mhe_option *option = &options[i];
    size_t size = mhi_option_field_size(option->type);
    size_t alignment = size == sizeof(int32_t) ? sizeof(int32_t) : sizeof(void *);
    if (option->offset > config_size || size > config_size - option->offset) {
        return "the field lies outside the config struct";
    }
    if (option->offset % alignment != 0) {
        return "the field is not aligned";
    }
    for (int32_t k = 0; k < i; k++) {
        const mhe_option *other = &options[k];
        /* A deprecated key fills its successor's field, so its own is free to be anything. */
        if (!(option->flags & MHE_OPT_DEPRECATED) && !(other->flags & MHE_OPT_DEPRECATED) &&
            option->offset < other->offset + mhi_option_field_size(other->type) &&
            other->offset < option->offset + size) {
            return "the field overlaps that of another option";
        }
    }
    return NULL;
}

static const char *check_number(const mhe_option *option) {
    int list = option->type == MHE_TYPE_REAL_LIST;
    if (option->unit == NULL || option->unit[0] == '\0') {
        return "there is no unit (\"1\" means dimensionless)";
    }
    if (!(option->min <= option->max)) { /* NaN too */
        return "min is not below max";
    }
    if (list || (option->flags & (MHE_OPT_REQUIRED | MHE_OPT_DEPRECATED))) {
        return NULL; /* no default */
    }
    if (!(option->real_default >= option->min && option->real_default <= option->max)) {
        return "the default is out of range";
    }
    if (option->type == MHE_TYPE_INT &&
        (option->real_default < INT32_MIN || option->real_default > INT32_MAX ||
         option->real_default != floor(option->real_default))) {
        return "the default is not a 32-bit integer";
    }
    return NULL;
}

static const char *check_choices(const mhe_option *option) {
    if (option->choices == NULL) {
        return "an enum needs choices";
    }
    size_t length = 0, other_length = 0;
    const char *choice = NULL;
    for (int32_t i = 0; (choice = mhi_choice_at(option->choices, i, &length)) != NULL; i++) {
        if (length == 0) {
            return "a choice is empty";
        }
        for (int32_t k = 0; k < i; k++) {
            const char *other = mhi_choice_at(option->choices, k, &other_length);
            if (other_length == length && strncmp(choice, other, length) == 0) {
                return "a choice occurs twice";
            }
        }
    }
    if (!(option->flags & (MHE_OPT_REQUIRED | MHE_OPT_DEPRECATED)) &&
        (option->text_default == NULL ||
         mhi_choice_find(option->choices, option->text_default) < 0)) {
        return "the default is none of the choices";
    }
    return NULL;
}

static const char *check_type(const mhe_option *option) {
    switch (option->type) {
    case MHE_TYPE_REAL:
    case MHE_TYPE_INT:
    case MHE_TYPE_REAL_LIST:
        return check_number(option);
    case MHE_TYPE_BOOL:
        return option->real_default == 0 || option->real_default == 1
                   ? NULL
                   : "the default is neither 0 nor 1";
    case MHE_TYPE_ENUM:
        return check_choices(option);
    default:
        return NULL;
    }
}

static const char *check_flags(const mhe_option *options, int32_t n_options, int32_t i) {
    const mhe_option *option = &options[i];
    if (option->flags & ~KNOWN_FLAGS) {
        return "there are unknown flags";
    }
    if (!(option->flags & MHE_OPT_DEPRECATED)) {
        return option->replaced_by == NULL ? NULL : "replaced_by is for deprecated options alone";
    }
    if (option->flags & MHE_OPT_REQUIRED) {
        return "a deprecated option cannot be required";
    }
    const mhe_option *successor = option->replaced_by == NULL
                                      ? NULL
                                      : mhi_option_find(options, n_options, option->replaced_by);
    if (successor == NULL || (successor->flags & MHE_OPT_DEPRECATED)) {
        return "replaced_by names no current option";
    }
    return successor->type == option->type ? NULL : "replaced_by names an option of another type";
}

mhe_status mhi_options_check(const mhe_option *options, int32_t n_options, uint32_t config_size,
                             mhe_error *err) {
    if (n_options < 0 || (n_options > 0 && options == NULL)) {
        return mhe_fail(err, MHE_E_PLUGIN, "the option table is missing");
    }
    for (int32_t i = 0; i < n_options; i++) { /* first, so that look-ups by key are safe */
        if (options[i].key == NULL) {
            return mhe_fail(err, MHE_E_PLUGIN, "option %d has no key", (int)i);
        }
    }
    for (int32_t i = 0; i < n_options; i++) {
        const char *fault = check_key(options, i);
        if (fault == NULL && mhi_option_field_size(options[i].type) == 0) {
            fault = "the type is unknown";
        }
        fault = fault != NULL ? fault : check_field(options, i, config_size);
        fault = fault != NULL ? fault : check_type(&options[i]);
        fault = fault != NULL ? fault : check_flags(options, n_options, i);
        if (fault != NULL) {
            return mhe_fail(err, MHE_E_PLUGIN, "option '%s': %s", options[i].key, fault);
        }
    }
    return MHE_OK;
}
