/* SPDX-License-Identifier: Apache-2.0 */
/* study_grids.c: from grids to conditions. */
#include "study_private.h"

#include "base/text.h"

#include <stdlib.h>
#include <string.h>

#define CONDITIONS_MAX 10000

/* One entry of `grids`: per factor the levels it takes. */
typedef struct grid {
    const mhi_node *node;
    const int32_t *levels[STUDY_FACTORS_MAX];
    int32_t n[STUDY_FACTORS_MAX];
    int32_t trials;
} grid;

static factor *find_factor(study *s, const char *name) {
    for (int32_t i = 0; i < s->n_factors; i++) {
        if (strcmp(s->factors[i].name, name) == 0) {
            return &s->factors[i];
        }
    }
    return NULL;
}

/* Keys of an entry are factors, and `own`. */
static mhe_status check_keys(study *s, const mhi_node *node, const char *where,
                             const char *const *own, int32_t n_own, mhe_error *err) {
    if (node->kind != MHI_MAPPING) {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, node, "%s: a mapping {factor: values}",
                           where);
    }
    const char *names[STUDY_FACTORS_MAX + 2];
    int32_t n = 0;
    for (int32_t i = 0; i < s->n_factors; i++) {
        names[n++] = s->factors[i].name;
    }
    for (int32_t i = 0; i < n_own; i++) {
        names[n++] = own[i];
    }
    for (const mhi_node *child = node->first; child != NULL; child = child->next) {
        int known = 0;
        for (int32_t i = 0; i < n; i++) {
            known |= strcmp(names[i], child->key) == 0;
        }
        if (!known) {
            char hint[256];
            return mhi_fail_at(err, MHE_E_CONFIG, s->tree, child, "%s: unknown factor '%s'%s",
                               where, child->key,
                               mhi_suggest(hint, sizeof hint, child->key, names, n));
        }
    }
    return MHE_OK;
}

/* A list of values, or a single one; where values are lists themselves, a list of scalars is one.
 */
static int is_single(const factor *f, const mhi_node *node) {
    return node->kind != MHI_SEQUENCE ||
           (f->n_keys > 1 && node->first != NULL && node->first->kind == MHI_SCALAR &&
            study_find_level(f, node->first->text) < 0);
}

static mhe_status read_levels(study *s, factor *f, const mhi_node *node, const int32_t **levels,
                              int32_t *n, mhe_error *err) {
    const int single = is_single(f, node);
    *n = single ? 1 : mhi_node_count(node);
    int32_t *found = MHI_TAKE(&s->arena, int32_t, *n);
    *levels = found;
    if (found == NULL) {
        return study_no_memory(err);
    }
    if (*n == 0) {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, node, "factor '%s': the list is empty",
                           f->name);
    }
    mhe_status status = MHE_OK;
    const mhi_node *value = single ? node : node->first;
    for (int32_t i = 0; i < *n && status == MHE_OK; i++, value = value->next) {
        status = study_take_level(s, f, value, &found[i], err);
    }
    return status;
}

static mhe_status all_levels(study *s, const factor *f, const mhi_node *where,
                             const int32_t **levels, int32_t *n, mhe_error *err) {
    if (f->open) {
        return mhi_fail_at(
            err, MHE_E_CONFIG, s->tree, where,
            "grids: factor '%s' has no 'values', so that every grid has to give them", f->name);
    }
    int32_t *all = MHI_TAKE(&s->arena, int32_t, f->n_levels);
    if (all == NULL) {
        return study_no_memory(err);
    }
    for (*n = 0; *n < f->n_levels; ++*n) {
        all[*n] = *n;
    }
    *levels = all;
    return MHE_OK;
}

static mhe_status read_trials(study *s, const mhi_node *node, grid *g, mhe_error *err) {
    const mhi_node *trials = node == NULL ? NULL : mhi_node_find(node, "trials");
    g->trials = s->keys.trials;
    if (trials == NULL) {
        return MHE_OK;
    }
    char *end = NULL;
    const long n = trials->kind == MHI_SCALAR ? strtol(trials->text, &end, 10) : 0;
    if (n < 1 || n > 1000000 || *end != '\0') {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, trials,
                           "grids: 'trials' is a whole number from 1 to 1000000");
    }
    g->trials = (int32_t)n;
    return MHE_OK;
}

static mhe_status read_grid(study *s, const mhi_node *node, grid *g, mhe_error *err) {
    static const char *const own[] = {"set", "trials"};
    *g = (grid){.node = node == NULL ? mhi_tree_root(s->tree) : node};
    mhe_status status = node == NULL ? MHE_OK : check_keys(s, node, "grids", own, 2, err);
    status = status == MHE_OK ? read_trials(s, node, g, err) : status;
    for (int32_t i = 0; i < s->n_factors && status == MHE_OK; i++) {
        factor *f = &s->factors[i];
        const mhi_node *values = node == NULL ? NULL : mhi_node_find(node, f->name);
        status = values == NULL ? all_levels(s, f, g->node, &g->levels[i], &g->n[i], err)
                                : read_levels(s, f, values, &g->levels[i], &g->n[i], err);
    }
    return status;
}

/* ---- assignments ---- */

typedef struct assignments {
    assignment *list;
    int32_t n;
} assignments;

static mhe_status assign(study *s, assignments *a, const char *key, const mhi_node *value,
                         const char *what, const char *label, mhe_error *err) {
    mhi_text text = {0};
    mhi_text_add(&text, "%s=", key);
    if (strcmp(key, "reference") == 0 && value->kind == MHI_SCALAR) {
        mhi_text_add(&text, "%s", value->text);
    } else {
        mhi_node_write(value, &text);
    }
    a->list[a->n++] =
        (assignment){mhi_arena_text(&s->arena, text.failed ? "" : text.data), what, label, value};
    mhi_text_free(&text);
    return a->list[a->n - 1].text == NULL ? study_no_memory(err) : MHE_OK;
}

static mhe_status assign_map(study *s, assignments *a, const mhi_node *map, mhe_error *err) {
    if (map != NULL && map->kind != MHI_MAPPING) {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, map, "set: a mapping {path.to.key: value}");
    }
    mhe_status status = MHE_OK;
    for (const mhi_node *n = map == NULL ? NULL : map->first; n != NULL && status == MHE_OK;
         n = n->next) {
        status = assign(s, a, n->key, n, "set", n->key, err);
    }
    return status;
}

/* All that a condition sets: for all, for its grid, for its levels. */
static mhe_status assign_all(study *s, const grid *g, condition *c, mhe_error *err) {
    const mhi_node *common = mhi_node_find(mhi_tree_root(s->tree), "set");
    const mhi_node *own = g->node == mhi_tree_root(s->tree) ? NULL : mhi_node_find(g->node, "set");
    int32_t n =
        (common == NULL ? 0 : mhi_node_count(common)) + (own == NULL ? 0 : mhi_node_count(own));
    for (int32_t i = 0; i < s->n_factors; i++) {
        n += s->factors[i].n_keys;
    }
    assignments a = {MHI_TAKE(&s->arena, assignment, n), 0};
    if (a.list == NULL) {
        return study_no_memory(err);
    }
    mhe_status status = assign_map(s, &a, common, err);
    status = status == MHE_OK ? assign_map(s, &a, own, err) : status;
    for (int32_t i = 0; i < s->n_factors && status == MHE_OK; i++) {
        const factor *f = &s->factors[i];
        const level *l = &f->levels[c->level[i]];
        const mhi_node *value = f->n_keys > 1 ? l->value->first : l->value;
        for (int32_t k = 0; k < f->n_keys && status == MHE_OK; k++) {
            status = assign(s, &a, f->keys[k], value, f->name, l->label, err);
            value = value->next;
        }
    }
    c->set = a.list;
    c->n_set = a.n;
    return status;
}

/* ---- crossing ---- */

static int64_t grid_size(const study *s, const grid *g) {
    int64_t n = 1;
    for (int32_t i = 0; i < s->n_factors && n <= CONDITIONS_MAX; i++) {
        n *= g->n[i];
    }
    return n;
}

static mhe_status cross(study *s, const grid *g, mhe_error *err) {
    const int64_t n = grid_size(s, g);
    mhe_status status = MHE_OK;
    for (int64_t number = 0; number < n && status == MHE_OK; number++) {
        condition *c = &s->conditions[s->n_conditions];
        int32_t *levels = MHI_TAKE(&s->arena, int32_t, s->n_factors);
        if (levels == NULL) {
            return study_no_memory(err);
        }
        int64_t rest = number;
        for (int32_t i = s->n_factors; i-- > 0; rest /= g->n[i]) {
            levels[i] = g->levels[i][rest % g->n[i]];
        }
        *c = (condition){.level = levels, .trials = g->trials, .node = g->node};
        s->n_conditions++;
        status = assign_all(s, g, c, err);
    }
    return status;
}

/* ---- conditions whose forces are kept ---- */

static void mark_kept(study *s, const grid *kept) {
    for (int32_t k = 0; k < s->n_conditions; k++) {
        int32_t all = 1;
        for (int32_t i = 0; i < s->n_factors; i++) {
            int32_t found = kept->n[i] == 0; /* not named: any */
            for (int32_t j = 0; j < kept->n[i]; j++) {
                found |= kept->levels[i][j] == s->conditions[k].level[i];
            }
            all &= found;
        }
        s->conditions[k].keep_forces |= all;
    }
}

static mhe_status read_kept(study *s, mhe_error *err) {
    const mhi_node *list = mhi_node_find(mhi_tree_root(s->tree), "keep_forces");
    mhe_status status = MHE_OK;
    if (list != NULL && list->kind != MHI_SEQUENCE) {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, list,
                           "keep_forces: a list of mappings {factor: values}");
    }
    for (const mhi_node *node = list == NULL ? NULL : list->first; node != NULL;
         node = node->next) {
        grid kept = {.node = node};
        status = check_keys(s, node, "keep_forces", NULL, 0, err);
        for (const mhi_node *child = node->first; child != NULL && status == MHE_OK;
             child = child->next) {
            factor *f = find_factor(s, child->key);
            const ptrdiff_t i = f - s->factors;
            status = read_levels(s, f, child, &kept.levels[i], &kept.n[i], err);
        }
        if (status != MHE_OK) {
            return status;
        }
        mark_kept(s, &kept);
    }
    return MHE_OK;
}

mhe_status study_read_grids(study *s, mhe_error *err) {
    const mhi_node *list = mhi_node_find(mhi_tree_root(s->tree), "grids");
    if (list != NULL && (list->kind != MHI_SEQUENCE || list->first == NULL)) {
        return mhi_fail_at(err, MHE_E_CONFIG, s->tree, list,
                           "grids: a list of mappings {factor: values}");
    }
    const int32_t n = list == NULL ? 1 : mhi_node_count(list);
    const mhi_node *node = list == NULL ? NULL : list->first;
    grid *grids = MHI_TAKE(&s->arena, grid, n);
    int64_t size = 0;
    mhe_status status = grids == NULL ? study_no_memory(err) : MHE_OK;
    for (int32_t i = 0; i < n && status == MHE_OK; i++) {
        status = read_grid(s, node, &grids[i], err);
        node = node == NULL ? NULL : node->next;
        size += status == MHE_OK ? grid_size(s, &grids[i]) : 0;
    }
    if (status == MHE_OK && size > CONDITIONS_MAX) {
        status = mhi_fail_at(err, MHE_E_CONFIG, s->tree, list, "grids: more than %d conditions",
                             CONDITIONS_MAX);
    }
    s->conditions = status == MHE_OK ? MHI_TAKE(&s->arena, condition, size) : NULL;
    if (status == MHE_OK && s->conditions == NULL) {
        status = study_no_memory(err);
    }
    for (int32_t i = 0; i < n && status == MHE_OK; i++) {
        status = cross(s, &grids[i], err);
    }
    for (int32_t i = 0; i < s->n_factors; i++) {
        s->factors[i].open = 0; /* from here on its levels are known */
    }
    return status == MHE_OK ? read_kept(s, err) : status;
}
