/* SPDX-License-Identifier: Apache-2.0 */
/* study_factors.c: factors and their levels. */
#include "study_private.h"

#include "config/options.h"

#include <mhe/option.h>
#include <stdlib.h>
#include <string.h>

typedef struct factor_keys {
    const char *key;
    mhe_text_list keys;
} factor_keys;

static const mhe_option factor_options[] = {
    MHE_OPT_TEXT(factor_keys, key, 0, NULL, "What it sets."),
    MHE_OPT_TEXTS(factor_keys, keys, 0, "What it sets, several at once."),
};

static int32_t find_label(const factor *f, const char *label) {
    for (int32_t i = 0; i < f->n_levels; i++) {
        if (strcmp(f->levels[i].label, label) == 0) {
            return i;
        }
    }
    return -1;
}

int32_t study_find_level(const factor *f, const char *label) {
    return find_label(f, label);
}

/* Labels stand in tables, in file names and on axes. */
static mhe_status check_label(const study *s, const mhi_node *node, const char *what,
                              const char *label, mhe_error *err) {
    const size_t plain = strcspn(label, ",;\"'\\ \t\r\n");
    if (label[plain] == '\0' && plain > 0 && plain <= 60) {
        return MHE_OK;
    }
    return mhi_fail_at(err, MHE_E_CONFIG, s->tree, node,
                       "%s: '%.80s' cannot be a label: 1 to 60 characters without blanks, commas "
                       "and quotes; give 'values' as {label: value}",
                       what, label);
}

/* "7", "7/3" */
static const char *label_of(study *s, const mhi_node *value) {
    if (value->kind == MHI_SCALAR) {
        return mhi_arena_text(&s->arena, value->text);
    }
    mhi_text text = {0};
    if (value->kind == MHI_SEQUENCE) {
        for (const mhi_node *part = value->first; part != NULL; part = part->next) {
            mhi_text_add(&text, "%s%s", part == value->first ? "" : "/",
                         part->kind == MHI_SCALAR ? part->text : "...");
        }
    }
    const char *label = mhi_arena_text(&s->arena, text.data != NULL ? text.data : "{}");
    mhi_text_free(&text);
    return label;
}

static mhe_status check_value(const study *s, const factor *f, const mhi_node *value,
                              mhe_error *err) {
    if (f->n_keys > 1 && (value->kind != MHI_SEQUENCE || mhi_node_count(value) != f->n_keys)) {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, value,
                           "factors: '%s': every value is a list of %d, one per key", f->name,
                           (int)f->n_keys);
    }
    return MHE_OK;
}

static mhe_status add_level(study *s, factor *f, const char *label, const mhi_node *value,
                            mhe_error *err) {
    mhe_status status =
        label == NULL ? study_no_memory(err) : check_label(s, value, f->name, label, err);
    if (status == MHE_OK && find_label(f, label) >= 0) {
        status = mhi_fail_at(err, MHE_E_CONFIG, s->tree, value,
                             "factors: '%s' has the value '%s' twice", f->name, label);
    }
    if (status == MHE_OK && f->n_keys > 0) {
        status = check_value(s, f, value, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    if (f->n_levels == f->capacity) {
        const int32_t capacity = f->capacity == 0 ? 8 : 2 * f->capacity;
        level *grown = realloc(f->levels, sizeof *grown * (size_t)capacity);
        if (grown == NULL) {
            return study_no_memory(err);
        }
        f->levels = grown;
        f->capacity = capacity;
    }
    f->levels[f->n_levels++] = (level){label, value};
    return MHE_OK;
}

static mhe_status read_values(study *s, factor *f, const mhi_node *values, mhe_error *err) {
    if (values->kind == MHI_SCALAR || values->first == NULL) {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, values,
                           "factors: '%s': 'values' is a list, or a mapping {label: value}",
                           f->name);
    }
    mhe_status status = MHE_OK;
    for (const mhi_node *value = values->first; value != NULL && status == MHE_OK;
         value = value->next) {
        const char *label = values->kind == MHI_MAPPING ? value->key : label_of(s, value);
        status = add_level(s, f, label, value, err);
    }
    return status;
}

static mhe_status read_factor(study *s, const mhi_node *node, factor *f, mhe_error *err) {
    static const char *const others[] = {"values"};
    factor_keys keys = {0};
    *f = (factor){.name = node->key, .node = node};
    mhe_status status = check_label(s, node, "factors", node->key, err);
    if (status == MHE_OK && node->kind != MHI_MAPPING) {
        status =
            mhi_fail_at(err, MHE_E_CONFIG, s->tree, node,
                        "factors: '%s' is a mapping {key: path.to.key, values: [...]}", f->name);
    }
    if (status == MHE_OK) {
        status = mhi_options_fill(factor_options, 2, s->tree, node, others, 1, f->name, s->dir,
                                  &s->arena, &keys, err);
    }
    if (status == MHE_OK && keys.key != NULL && *keys.key != '\0' && keys.keys.n > 0) {
        status = mhi_fail_at(err, MHE_E_CONFIG, s->tree, node,
                             "factors: '%s' has both 'key' and 'keys'", f->name);
    }
    if (status != MHE_OK) {
        return status;
    }
    const int one = keys.key != NULL && *keys.key != '\0';
    f->n_keys = one ? 1 : keys.keys.n;
    f->keys = MHI_TAKE(&s->arena, const char *, f->n_keys);
    if (f->keys == NULL) {
        return study_no_memory(err);
    }
    for (int32_t i = 0; i < f->n_keys; i++) {
        f->keys[i] = one ? keys.key : keys.keys.values[i];
    }
    const mhi_node *values = mhi_node_find(node, "values");
    f->open = values == NULL;
    return f->open ? MHE_OK : read_values(s, f, values, err);
}

/* Names that a column or a key of a grid has already. */
static mhe_status check_name(const study *s, const factor *f, mhe_error *err) {
    static const char *const taken[] = {"set",        "trials",  "trial",      "seed",
                                        "status",     "counted", "reason",     "solves",
                                        "converged",  "q_deg",   "qdot_rad_s", "activation",
                                        "excitation", "force_n", "marker_mm"};
    for (size_t i = 0; i < sizeof taken / sizeof taken[0]; i++) {
        if (strcmp(f->name, taken[i]) == 0) {
            return mhi_fail_at(err, MHE_E_CONFIG, s->tree, f->node,
                               "factors: '%s' is a column of the results already", f->name);
        }
    }
    return MHE_OK;
}

mhe_status study_read_factors(study *s, mhe_error *err) {
    const mhi_node *node = mhi_node_find(mhi_tree_root(s->tree), "factors");
    if (node == NULL || node->kind != MHI_MAPPING || node->first == NULL) {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, node != NULL ? node : mhi_tree_root(s->tree),
                           "factors: a mapping with at least one factor is needed, like {window: "
                           "{key: horizon.window, values: [5, 7]}}");
    }
    const int32_t n = mhi_node_count(node);
    if (n > STUDY_FACTORS_MAX) {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, node, "factors: %d are more than %d", (int)n,
                           STUDY_FACTORS_MAX);
    }
    s->factors = MHI_TAKE(&s->arena, factor, n);
    if (s->factors == NULL) {
        return study_no_memory(err);
    }
    mhe_status status = MHE_OK;
    for (const mhi_node *child = node->first; child != NULL && status == MHE_OK;
         child = child->next) {
        factor *f = &s->factors[s->n_factors++];
        status = read_factor(s, child, f, err);
        status = status == MHE_OK ? check_name(s, f, err) : status;
    }
    return status;
}

mhe_status study_take_level(study *s, factor *f, const mhi_node *value, int32_t *found,
                            mhe_error *err) {
    const char *label = label_of(s, value);
    *found = label == NULL ? -1 : find_label(f, label);
    if (*found >= 0) {
        return MHE_OK;
    }
    if (f->open) {
        *found = f->n_levels;
        return add_level(s, f, label, value, err);
    }
    const char *names[64];
    char hint[256];
    int32_t n = 0;
    for (; n < f->n_levels && n < 64; n++) {
        names[n] = f->levels[n].label;
    }
    return mhi_fail_at(err, MHE_E_CONFIG, s->tree, value, "factor '%s' has no value '%.80s'%s",
                       f->name, label == NULL ? "" : label,
                       mhi_suggest(hint, sizeof hint, label == NULL ? "" : label, names, n));
}
