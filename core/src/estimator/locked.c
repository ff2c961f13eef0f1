/* SPDX-License-Identifier: Apache-2.0 */
/* locked.c: the coordinates that model.locked and model.locked_at take out of the estimate. */
#include "base/number.h"
#include "estimator/estimator_private.h"
#include "io/model_file.h"

#include <stdlib.h>
#include <string.h>

static const mhi_node *model_node(const mhi_run *run) {
    return mhi_node_find(mhi_tree_root(run->tree), "model");
}

/* Number of the coordinate `name`; -1 and an error at the model section where there is none. */
static int32_t find(const mhi_run *run, const mhe_description *d, const char **names,
                    const char *key, const char *name, mhe_error *err) {
    char hint[256];
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        if (strcmp(d->coordinates[i].name, name) == 0) {
            return i;
        }
        names[i] = d->coordinates[i].name;
    }
    (void)mhi_fail_at(err, MHE_E_CONFIG, run->tree, model_node(run),
                      "model.%s: the model has no free coordinate '%s'%s", key, name,
                      mhi_suggest(hint, sizeof hint, name, names, d->n_coordinates));
    return -1;
}

/* A value that the coordinate can stand at. */
static mhe_status read_value(const mhi_run *run, const mhe_coordinate *c, const char *text,
                             double *value, mhe_error *err) {
    const mhi_c_locale saved = mhi_c_locale_begin();
    const int32_t known = mhi_number((mhi_cell){text, strlen(text)}, value);
    mhi_c_locale_end(saved);
    if (!known) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, model_node(run),
                           "model.locked_at: '%s' of '%s' is not a number", text, c->name);
    }
    if (*value < c->lower || *value > c->upper) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, model_node(run),
                           "model.locked_at: %g of '%s' is outside of its range, %g to %g", *value,
                           c->name, c->lower, c->upper);
    }
    return MHE_OK;
}

/* Values at [n_coordinates] of the locked ones, NaN of the others; `names` is room for as many. */
static mhe_status read_all(const mhi_run *run, const mhe_description *d, const char **names,
                           double *at, mhe_error *err) {
    const mhe_text_list *locked = &run->model_file.locked;
    const mhe_text_map *valued = &run->model_file.locked_at;
    int32_t n_free = 0;
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        at[i] = NAN;
    }
    for (int32_t k = 0; k < locked->n; k++) {
        const int32_t i = find(run, d, names, "locked", locked->values[k], err);
        if (i < 0) {
            return MHE_E_CONFIG;
        }
        at[i] = d->coordinates[i].value;
    }
    for (int32_t k = 0; k < valued->n && status == MHE_OK; k++) {
        const int32_t i = find(run, d, names, "locked_at", valued->keys[k], err);
        status = i < 0 ? MHE_E_CONFIG
                       : read_value(run, &d->coordinates[i], valued->values[k], &at[i], err);
    }
    for (int32_t i = 0; i < d->n_coordinates; i++) {
        n_free += isnan(at[i]);
    }
    if (status == MHE_OK && n_free == 0) {
        status = mhi_fail_at(err, MHE_E_CONFIG, run->tree, model_node(run),
                             "model.locked: no coordinate is left to move");
    }
    return status;
}

mhe_status mhi_estimator_lock(const mhi_run *run, mhe_description *d, mhe_error *err) {
    if (run->model_file.locked.n + run->model_file.locked_at.n == 0) {
        return MHE_OK;
    }
    const size_t n = (size_t)d->n_coordinates + 1;
    double *at = malloc(n * sizeof *at);
    const char **names = calloc(n, sizeof *names);
    mhe_status status = at == NULL || names == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                                    : read_all(run, d, names, at, err);
    if (status == MHE_OK) {
        status = mhi_description_lock(d, at, err);
    }
    free(at);
    free(names);
    return status;
}
