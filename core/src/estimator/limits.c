/* SPDX-License-Identifier: Apache-2.0 */
/* limits.c: the residual torque that each coordinate may have. */
#include "base/number.h"
#include "estimator/estimator_private.h"

#include <string.h>

/* Number of the coordinate `name`; -1 and an error at the bounds section where there is none. */
static int32_t find_coordinate(const mhe_estimator *e, const char *key, const char *name,
                               mhe_error *err) {
    const char *const *names = mhi_ocp_problem(e->ocp)->coordinate_names;
    char hint[256];
    for (int32_t i = 0; i < e->n_q; i++) {
        if (strcmp(names[i], name) == 0) {
            return i;
        }
    }
    (void)mhi_fail_at(err, MHE_E_CONFIG, e->run->tree,
                      mhi_node_find(mhi_tree_root(e->run->tree), "bounds"),
                      "bounds.%s: the model has no coordinate '%s'%s", key, name,
                      mhi_suggest(hint, sizeof hint, name, names, e->n_q));
    return -1;
}

static mhe_status read_limit(const mhe_estimator *e, const char *name, const char *text,
                             double *limit, mhe_error *err) {
    const mhi_c_locale saved = mhi_c_locale_begin();
    const int32_t known = mhi_number((mhi_cell){text, strlen(text)}, limit);
    mhi_c_locale_end(saved);
    if (known && *limit >= 0) {
        return MHE_OK;
    }
    return mhi_fail_at(
        err, MHE_E_CONFIG, e->run->tree, mhi_node_find(mhi_tree_root(e->run->tree), "bounds"),
        "bounds.residual_torque_limits: '%s' of '%s' is not a number of at least 0", text, name);
}

mhe_status mhi_estimator_limits(mhe_estimator *e, mhe_error *err) {
    const mhi_bounds_section *b = &e->run->bounds;
    const mhe_text_list *at = &b->residual_torque_at;
    for (int32_t i = 0; i < e->n_q; i++) {
        e->torque_max[i] = at->n == 0 ? b->residual_torque_max : 0;
    }
    for (int32_t k = 0; k < at->n; k++) {
        const int32_t i = find_coordinate(e, "residual_torque_at", at->values[k], err);
        if (i < 0) {
            return MHE_E_CONFIG;
        }
        e->torque_max[i] = b->residual_torque_max;
    }
    for (int32_t k = 0; k < b->residual_torque_limits.n; k++) {
        const char *name = b->residual_torque_limits.keys[k];
        const int32_t i = find_coordinate(e, "residual_torque_limits", name, err);
        if (i < 0) {
            return MHE_E_CONFIG;
        }
        mhe_status status =
            read_limit(e, name, b->residual_torque_limits.values[k], &e->torque_max[i], err);
        if (status != MHE_OK) {
            return status;
        }
    }
    return MHE_OK;
}
