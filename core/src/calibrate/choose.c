/* SPDX-License-Identifier: Apache-2.0 */
#include "base/text.h"
#include "calibrate/calibrate.h"

#include <string.h>

static mhe_status unknown(const mhi_calibration *c, const mhi_plan_entry *e, const char *what,
                          const char *name, const char *const *names, int32_t n, mhe_error *err) {
    char hint[256];
    return mhi_fail_at(err, MHE_E_CONFIG, c->run->tree, e->node,
                       "calibrate.parameters: %s: the model has no %s '%s'%s",
                       mhi_plan_names[e->kind], what, name,
                       mhi_suggest(hint, sizeof hint, name, names, n));
}

static mhi_estimated *add(mhi_calibration *c, int32_t entry, int32_t subject, int32_t axis) {
    const mhi_plan_entry *e = &c->plan.entries[entry];
    mhi_estimated *p = &c->list[c->n++];
    const double unit = e->kind == MHI_OF_MARKER ? MHI_OFFSET_UNIT : 1;
    *p = (mhi_estimated){.kind = e->kind,
                         .subject = subject,
                         .axis = axis,
                         .entry = entry,
                         .unit = unit,
                         .mean = e->mean,
                         .prior_sd = e->sd,
                         .lower = e->lower,
                         .upper = e->upper,
                         .value = e->mean};
    const char *kind = mhi_plan_names[e->kind];
    if (axis >= 0) {
        (void)snprintf(p->name, sizeof p->name, "%s of %.100s, %c", kind,
                       c->model->markers[subject].name, "xyz"[axis]);
    } else if (e->together) {
        (void)snprintf(p->name, sizeof p->name, "%s of %.80s and %d more", kind,
                       c->model->muscles[subject].name,
                       (int)(e->muscles.n > 0 ? e->muscles.n : c->model->n_muscles) - 1);
    } else {
        (void)snprintf(p->name, sizeof p->name, "%s of %.100s", kind,
                       c->model->muscles[subject].name);
    }
    return p;
}

/* Which list of numbers a kind of a muscle has. */
static int32_t *list_of(const mhi_calibration *c, int32_t kind) {
    union {
        const int32_t *read;
        int32_t *write;
    } list = {.read = kind == MHI_OF_GAIN    ? c->setup.gain
                      : kind == MHI_OF_SHAPE ? c->setup.shape
                                             : c->setup.of_system + kind * c->model->n_muscles};
    return list.write;
}

static mhe_status choose_muscles(mhi_calibration *c, int32_t entry, const char *const *names,
                                 mhe_error *err) {
    const mhi_plan_entry *e = &c->plan.entries[entry];
    const int32_t n_m = c->model->n_muscles, n = e->muscles.n > 0 ? e->muscles.n : n_m;
    int32_t *list = list_of(c, e->kind), number = -1;
    for (int32_t i = 0; i < n; i++) {
        int32_t m = i;
        if (e->muscles.n > 0) {
            for (m = 0; m < n_m && strcmp(names[m], e->muscles.values[i]) != 0; m++) {
            }
        }
        if (m == n_m) {
            return unknown(c, e, "muscle", e->muscles.values[i], names, n_m, err);
        }
        if (list[m] >= 0) {
            return mhi_fail_at(err, MHE_E_CONFIG, c->run->tree, e->node,
                               "calibrate.parameters: %s of '%s' stands there twice",
                               mhi_plan_names[e->kind], names[m]);
        }
        if (number < 0 || !e->together) {
            number = c->n;
            (void)add(c, entry, m, -1);
        }
        list[m] = number;
    }
    return MHE_OK;
}

static mhe_status choose_markers(mhi_calibration *c, int32_t entry, int32_t *list,
                                 const char *const *names, mhe_error *err) {
    const mhi_plan_entry *e = &c->plan.entries[entry];
    const int32_t n_k = c->model->n_markers, n = e->markers.n > 0 ? e->markers.n : n_k;
    for (int32_t i = 0; i < n; i++) {
        int32_t k = i;
        if (e->markers.n > 0) {
            for (k = 0; k < n_k && strcmp(names[k], e->markers.values[i]) != 0; k++) {
            }
        }
        if (k == n_k) {
            return unknown(c, e, "marker", e->markers.values[i], names, n_k, err);
        }
        if (c->model->markers[k].body < 0 || list[k] >= 0) {
            if (e->markers.n == 0) {
                continue;
            }
            return mhi_fail_at(err, MHE_E_CONFIG, c->run->tree, e->node,
                               "calibrate.parameters: marker_offset: '%s' %s", names[k],
                               list[k] >= 0 ? "stands there twice" : "is fixed to the ground");
        }
        list[k] = c->n;
        for (int32_t axis = 0; axis < 3; axis++) {
            (void)add(c, entry, k, axis);
        }
    }
    return MHE_OK;
}

mhe_status mhi_calibration_choose(mhi_calibration *c, mhe_error *err) {
    const int32_t n_m = c->model->n_muscles, n_k = c->model->n_markers;
    const int32_t most = c->plan.n_entries * (n_m > 3 * n_k ? n_m : 3 * n_k);
    int32_t *numbers = MHI_TAKE(&c->arena, int32_t, 5 * n_m + n_k);
    const char **names = MHI_TAKE(&c->arena, const char *, n_m + n_k);
    c->list = MHI_TAKE(&c->arena, mhi_estimated, most);
    if (numbers == NULL || names == NULL || c->list == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < 5 * n_m + n_k; i++) {
        numbers[i] = -1;
    }
    for (int32_t i = 0; i < n_m + n_k; i++) {
        names[i] = i < n_m ? c->model->muscles[i].name : c->model->markers[i - n_m].name;
    }
    c->setup = (mhi_parameters_setup){.of_system = numbers,
                                      .gain = numbers + 3 * n_m,
                                      .shape = numbers + 4 * n_m,
                                      .marker = numbers + 5 * n_m};
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < c->plan.n_entries && status == MHE_OK; i++) {
        status = c->plan.entries[i].kind == MHI_OF_MARKER
                     ? choose_markers(c, i, numbers + 5 * n_m, names + n_m, err)
                     : choose_muscles(c, i, names, err);
    }
    mhi_parameter *list = MHI_TAKE(&c->arena, mhi_parameter, c->n);
    c->covariance = MHI_TAKE(&c->arena, double, c->n * c->n);
    if (status == MHE_OK && (list == NULL || c->covariance == NULL)) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < c->n && status == MHE_OK; i++) {
        const mhi_estimated *p = &c->list[i];
        list[i] = (mhi_parameter){p->mean / p->unit, p->mean / p->unit, p->prior_sd / p->unit,
                                  p->lower / p->unit, p->upper / p->unit};
    }
    c->setup.list = list;
    c->setup.n = c->n;
    return status;
}

double mhi_calibration_of(const mhi_calibration *c, int32_t kind, int32_t muscle) {
    const int32_t number = list_of(c, kind)[muscle];
    return number >= 0 ? c->list[number].value : kind == MHI_OF_SHAPE ? 0 : 1;
}

const mhi_estimated *mhi_calibration_find(const mhi_calibration *c, int32_t kind, int32_t subject,
                                          int32_t axis) {
    int32_t number = kind == MHI_OF_MARKER ? c->setup.marker[subject] : list_of(c, kind)[subject];
    number = kind == MHI_OF_MARKER && number >= 0 ? number + axis : number;
    return number < 0 ? NULL : &c->list[number];
}
