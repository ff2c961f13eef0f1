/* SPDX-License-Identifier: Apache-2.0 */
#include "variants.h"

#include <string.h>

#define WINDOW "horizon.window="

/* One --vary: the assignments "key=value" that it stands for. */
typedef struct axis {
    const char *set[VARIANTS_MAX];
    int32_t n;
} axis;

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

/* End of the value that begins here: a comma outside of brackets, or the end of the text. */
static const char *end_of_value(const char *text) {
    int32_t depth = 0;
    for (; *text != '\0' && (*text != ',' || depth > 0); text++) {
        depth += *text == '[' || *text == '{';
        depth -= *text == ']' || *text == '}';
    }
    return text;
}

static mhe_status read_axis(const char *text, mhi_arena *arena, axis *result, mhe_error *err) {
    const char *equals = strchr(text, '=');
    if (equals == NULL || equals == text || equals[1] == '\0') {
        return mhe_fail(err, MHE_E_ARGUMENT, "--vary %s: wanted is path.to.key=v1,v2,...", text);
    }
    const int key = (int)(equals - text);
    for (const char *value = equals + 1;;) {
        const char *end = end_of_value(value);
        if (end == value) {
            return mhe_fail(err, MHE_E_ARGUMENT, "--vary %s: a value is empty", text);
        }
        if (result->n == VARIANTS_MAX) {
            return mhe_fail(err, MHE_E_ARGUMENT, "--vary %.*s: more than %d values", key, text,
                            VARIANTS_MAX);
        }
        const char *set =
            mhi_arena_format(arena, "%.*s=%.*s", key, text, (int)(end - value), value);
        if (set == NULL) {
            return no_memory(err);
        }
        result->set[result->n++] = set;
        if (*end == '\0') {
            return MHE_OK;
        }
        value = end + 1;
    }
}

/* The assignments, one blank between; without the window where it is not `wanted`. */
static const char *name_of(mhi_arena *arena, const char *const *set, int32_t n, int windows) {
    const char *name = "";
    for (int32_t i = 0; i < n && name != NULL; i++) {
        if (windows || strncmp(set[i], WINDOW, strlen(WINDOW)) != 0) {
            name = mhi_arena_format(arena, "%s%s%s", name, *name == '\0' ? "" : " ", set[i]);
        }
    }
    return name != NULL && *name == '\0' ? "as given" : name;
}

static void find_group(variants *v, variant *new) {
    for (const variant *old = v->list; old < new; old++) {
        if (strcmp(old->group_name, new->group_name) == 0) {
            new->group = old->group;
            return;
        }
    }
    new->group = v->n_groups++;
    new->opens_group = 1;
}

/* The variant whose assignments stand at set[n_set ...] behind those of all. */
static mhe_status add_variant(const char *config, const char *const *set, int32_t n_set,
                              int32_t n_vary, mhi_registry *registry, variants *v, mhe_error *err) {
    variant *new = &v->list[v->n];
    new->name = name_of(&v->arena, set + n_set, n_vary, 1);
    new->group_name = name_of(&v->arena, set + n_set, n_vary, 0);
    if (new->name == NULL || new->group_name == NULL) {
        return no_memory(err);
    }
    mhe_status status = mhi_run_read(config, set, n_set + n_vary, registry, &new->run, err);
    if (status == MHE_OK) {
        find_group(v, new);
        v->n++;
    }
    return status;
}

mhe_status variants_read(const char *config, const char *const *set, int32_t n_set,
                         const char *const *vary, int32_t n_vary, mhi_registry *registry,
                         variants *v, mhe_error *err) {
    *v = (variants){0};
    axis *axes = MHI_TAKE(&v->arena, axis, n_vary);
    const char **all = MHI_TAKE(&v->arena, const char *, n_set + n_vary);
    if (axes == NULL || all == NULL) {
        return no_memory(err);
    }
    for (int32_t i = 0; i < n_set; i++) {
        all[i] = set[i];
    }
    int32_t n = 1;
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < n_vary && status == MHE_OK; i++) {
        status = read_axis(vary[i], &v->arena, &axes[i], err);
        n *= axes[i].n;
        if (n > VARIANTS_MAX) {
            return mhe_fail(err, MHE_E_ARGUMENT, "--vary: more than %d variants", VARIANTS_MAX);
        }
    }
    for (int32_t k = 0; k < n && status == MHE_OK; k++) {
        for (int32_t i = n_vary, rest = k; i-- > 0; rest /= axes[i].n) {
            all[n_set + i] = axes[i].set[rest % axes[i].n];
        }
        status = add_variant(config, all, n_set, n_vary, registry, v, err);
    }
    return status;
}

void variants_free(variants *v) {
    for (int32_t i = 0; i < v->n; i++) {
        mhi_run_free(v->list[i].run);
    }
    mhi_arena_free(&v->arena);
}
