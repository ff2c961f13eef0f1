/* SPDX-License-Identifier: Apache-2.0 */
/* bounds.c: the general bounds of a run, with the residual torque that each coordinate may have. */
#include "model/bounds.h"

#include "base/number.h"

#include <string.h>

/* Number of the coordinate `name`; -1 and an error at the bounds section where there is none. */
static int32_t find_coordinate(const mhi_run *run, const mhe_description *d, const char *key,
                               const char *name, mhe_error *err) {
    char hint[256];
    mhi_arena arena = {0};
    const char **names = MHI_TAKE(&arena, const char *, d->n_coordinates);
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        if (strcmp(d->coordinates[i].name, name) == 0) {
            mhi_arena_free(&arena);
            return i;
        }
        if (names != NULL) {
            names[i] = d->coordinates[i].name;
        }
    }
    (void)mhi_fail_at(
        err, MHE_E_CONFIG, run->tree, mhi_node_find(mhi_tree_root(run->tree), "bounds"),
        "bounds.%s: the model has no coordinate '%s'%s", key, name,
        mhi_suggest(hint, sizeof hint, name, names, names != NULL ? d->n_coordinates : 0));
    mhi_arena_free(&arena);
    return -1;
}

static mhe_status read_limit(const mhi_run *run, const char *name, const char *text, double *limit,
                             mhe_error *err) {
    const mhi_c_locale saved = mhi_c_locale_begin();
    const int32_t known = mhi_number((mhi_cell){text, strlen(text)}, limit);
    mhi_c_locale_end(saved);
    if (known && *limit >= 0) {
        return MHE_OK;
    }
    return mhi_fail_at(
        err, MHE_E_CONFIG, run->tree, mhi_node_find(mhi_tree_root(run->tree), "bounds"),
        "bounds.residual_torque_limits: '%s' of '%s' is not a number of at least 0", text, name);
}

static mhe_status read_torques(const mhi_run *run, const mhe_description *d, double *torque_max,
                               mhe_error *err) {
    const mhi_bounds_section *b = &run->bounds;
    const mhe_text_list *at = &b->residual_torque_at;
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        torque_max[i] = at->n == 0 ? b->residual_torque_max : 0;
    }
    for (int32_t k = 0; k < at->n; k++) {
        const int32_t i = find_coordinate(run, d, "residual_torque_at", at->values[k], err);
        if (i < 0) {
            return MHE_E_CONFIG;
        }
        torque_max[i] = b->residual_torque_max;
    }
    for (int32_t k = 0; k < b->residual_torque_limits.n; k++) {
        const char *name = b->residual_torque_limits.keys[k];
        const int32_t i = find_coordinate(run, d, "residual_torque_limits", name, err);
        if (i < 0) {
            return MHE_E_CONFIG;
        }
        mhe_status status =
            read_limit(run, name, b->residual_torque_limits.values[k], &torque_max[i], err);
        if (status != MHE_OK) {
            return status;
        }
    }
    return MHE_OK;
}

mhe_status mhi_bounds_read(const mhi_run *run, const mhe_description *d, mhi_arena *arena,
                           mhi_bounds *bounds, mhe_error *err) {
    const mhi_bounds_section *b = &run->bounds;
    double *torque_max = MHI_TAKE(arena, double, d->n_coordinates);
    *bounds = (mhi_bounds){.velocity_max = b->velocity_max,
                           .activation_min = b->activation_min,
                           .activation_max = b->activation_max,
                           .excitation_min = b->excitation_min,
                           .excitation_max = b->excitation_max,
                           .torque_max = torque_max};
    return torque_max == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                              : read_torques(run, d, torque_max, err);
}
