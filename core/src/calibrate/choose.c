/* SPDX-License-Identifier: Apache-2.0 */
#include "base/text.h"
#include "calibrate/calibrate.h"
#include "model/anatomy.h"

#include <math.h>
#include <string.h>

static mhe_status unknown(const mhi_calibration *c, const mhi_plan_entry *e, const char *what,
                          const char *name, const char *const *names, int32_t n, mhe_error *err) {
    char hint[256];
    return mhi_fail_at(err, MHE_E_CONFIG, c->run->tree, e->node,
                       "calibrate.parameters: %s: the model has no %s '%s'%s",
                       mhi_plan_names[e->kind], what, name,
                       mhi_suggest(hint, sizeof hint, name, names, n));
}

/* How many muscles, markers or bodies an entry means. */
static int32_t n_subjects(const mhi_calibration *c, const mhi_plan_entry *e) {
    int32_t n = 0;
    switch (e->kind) {
    case MHI_OF_MARKER:
        return e->markers.n > 0 ? e->markers.n : c->model->n_markers;
    case MHI_OF_MASS:
        for (int32_t b = 0; b < c->model->n_bodies; b++) {
            n += c->model->bodies[b].mass > 0;
        }
        return e->bodies.n > 0 ? e->bodies.n : n;
    default:
        return e->muscles.n > 0 ? e->muscles.n : c->model->n_muscles;
    }
}

static int32_t is_offset(int32_t kind) {
    return kind == MHI_OF_MARKER || kind == MHI_OF_INSERTION;
}

static const char *name_of(const mhi_calibration *c, int32_t kind, int32_t subject) {
    return kind == MHI_OF_MARKER ? c->model->markers[subject].name
           : kind == MHI_OF_MASS ? c->model->bodies[subject].name
                                 : c->model->muscles[subject].name;
}

static mhi_estimated *add(mhi_calibration *c, int32_t entry, int32_t subject, int32_t axis) {
    const mhi_plan_entry *e = &c->plan.entries[entry];
    mhi_estimated *p = &c->list[c->n++];
    const double unit = is_offset(e->kind)        ? MHI_OFFSET_UNIT
                        : e->kind == MHI_OF_DELAY ? MHI_DELAY_UNIT
                                                  : 1;
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
    const char *kind = mhi_plan_names[e->kind], *of = name_of(c, e->kind, subject);
    if (axis >= 0) {
        (void)snprintf(p->name, sizeof p->name, "%s of %.100s, %c", kind, of, "xyz"[axis]);
    } else if (e->together) {
        (void)snprintf(p->name, sizeof p->name, "%s of %.80s and %d more", kind, of,
                       (int)n_subjects(c, e) - 1);
    } else {
        (void)snprintf(p->name, sizeof p->name, "%s of %.100s", kind, of);
    }
    return p;
}

static const char *what_of(int32_t kind) {
    return kind == MHI_OF_MARKER ? "marker" : kind == MHI_OF_MASS ? "body" : "muscle";
}

/* Why a subject has no such number; NULL: it has. */
static const char *cannot(const mhi_calibration *c, int32_t kind, int32_t i) {
    if (kind == MHI_OF_MARKER && c->model->markers[i].body < 0) {
        return "is fixed to the ground";
    }
    if (kind == MHI_OF_MASS && !(c->model->bodies[i].mass > 0)) {
        return "has no mass in the model";
    }
    if (kind == MHI_OF_INSERTION && !mhi_insertion_is_fixed(c->model, i)) {
        return "does not end at a fixed point of a body";
    }
    return c->list_of[kind][is_offset(kind) && kind != MHI_OF_MARKER ? 3 * i : i] >= 0
               ? "stands there twice"
               : NULL;
}

/* Adds what entry `entry` says of subject i. */
static void take(mhi_calibration *c, int32_t entry, int32_t i, int32_t *together) {
    const mhi_plan_entry *e = &c->plan.entries[entry];
    int32_t *list = c->list_of[e->kind];
    if (is_offset(e->kind)) {
        for (int32_t axis = 0; axis < 3; axis++) {
            if (e->kind == MHI_OF_INSERTION) {
                list[3 * i + axis] = c->n;
            } else if (axis == 0) {
                list[i] = c->n;
            }
            (void)add(c, entry, i, axis);
        }
        return;
    }
    if (*together < 0 || !e->together) {
        *together = c->n;
        (void)add(c, entry, i, -1);
    }
    list[i] = *together;
}

/* Subjects that the entry names, or all that can be. */
static mhe_status choose_entry(mhi_calibration *c, int32_t entry, const char *const *names,
                               int32_t n, mhe_error *err) {
    const mhi_plan_entry *e = &c->plan.entries[entry];
    const mhe_text_list *named = e->kind == MHI_OF_MARKER ? &e->markers
                                 : e->kind == MHI_OF_MASS ? &e->bodies
                                                          : &e->muscles;
    int32_t together = -1;
    for (int32_t i = 0; i < (named->n > 0 ? named->n : n); i++) {
        int32_t at = i;
        if (named->n > 0) {
            for (at = 0; at < n && strcmp(names[at], named->values[i]) != 0; at++) {
            }
        }
        if (at == n) {
            return unknown(c, e, what_of(e->kind), named->values[i], names, n, err);
        }
        const char *why = cannot(c, e->kind, at);
        if (why == NULL) {
            take(c, entry, at, &together);
        } else if (named->n > 0 || !(is_offset(e->kind) || e->kind == MHI_OF_MASS)) {
            return mhi_fail_at(err, MHE_E_CONFIG, c->run->tree, e->node,
                               "calibrate.parameters: %s of '%s' %s", mhi_plan_names[e->kind],
                               names[at], why);
        }
    }
    return MHE_OK;
}

/* What the person weighs says what to expect of the masses. */
static mhe_status expect_masses(mhi_calibration *c, mhe_error *err) {
    double all = 0;
    for (int32_t b = 0; b < c->model->n_bodies; b++) {
        all += c->model->bodies[b].mass;
    }
    for (int32_t i = 0; i < c->plan.n_entries && !isnan(c->plan.body_mass) && all > 0; i++) {
        mhi_plan_entry *e = &c->plan.entries[i];
        if (e->kind != MHI_OF_MASS || !isnan(e->mean)) {
            continue;
        }
        e->mean = c->plan.body_mass / all;
        if (!(e->mean >= e->lower && e->mean <= e->upper)) {
            return mhi_fail_at(err, MHE_E_CONFIG, c->run->tree, e->node,
                               "calibrate.body_mass: %g kg is %.3g times what the model weighs "
                               "(%g kg), which is not within %g .. %g",
                               c->plan.body_mass, e->mean, all, e->lower, e->upper);
        }
    }
    for (int32_t i = 0; i < c->plan.n_entries; i++) {
        mhi_plan_entry *e = &c->plan.entries[i];
        e->mean = isnan(e->mean) ? 1 : e->mean; /* a mass, and nothing is known of it */
    }
    return MHE_OK;
}

/* Room for all lists, -1: those of the system's numbers one behind the other, as the system has
 * them; what is not asked for behind all others. */
static mhe_status make_lists(mhi_calibration *c, mhe_error *err) {
    static const int32_t of_system[] = {MHI_OF_STRENGTH, MHI_OF_OPTIMAL, MHI_OF_SLACK,
                                        MHI_OF_INSERTION, MHI_OF_MASS};
    static const int32_t others[] = {MHI_OF_GAIN, MHI_OF_SHAPE, MHI_OF_DELAY, MHI_OF_MARKER};
    const int32_t n_m = c->model->n_muscles, n_k = c->model->n_markers, n_b = c->model->n_bodies;
    const int32_t n = 9 * n_m + n_k + n_b;
    int32_t *numbers = MHI_TAKE(&c->arena, int32_t, n), most = 0;
    for (int32_t i = 0; i < c->plan.n_entries; i++) {
        c->asked[c->plan.entries[i].kind] = 1;
        most += 3 * n_subjects(c, &c->plan.entries[i]);
    }
    c->list = MHI_TAKE(&c->arena, mhi_estimated, most);
    if (numbers == NULL || c->list == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < n; i++) {
        numbers[i] = -1;
    }
    int32_t *next = numbers;
    for (int32_t asked = 1; asked >= 0; asked--) {
        for (size_t i = 0; i < sizeof of_system / sizeof of_system[0]; i++) {
            const int32_t kind = of_system[i];
            if (c->asked[kind] == asked) {
                c->list_of[kind] = next;
                next += kind == MHI_OF_INSERTION ? 3 * n_m : kind == MHI_OF_MASS ? n_b : n_m;
            }
        }
    }
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        c->list_of[others[i]] = next;
        next += others[i] == MHI_OF_MARKER ? n_k : n_m;
    }
    c->setup = (mhi_parameters_setup){.of_system = numbers,
                                      .gain = c->list_of[MHI_OF_GAIN],
                                      .shape = c->list_of[MHI_OF_SHAPE],
                                      .delay = c->list_of[MHI_OF_DELAY],
                                      .marker = c->list_of[MHI_OF_MARKER]};
    return MHE_OK;
}

mhe_status mhi_calibration_choose(mhi_calibration *c, mhe_error *err) {
    const int32_t n_m = c->model->n_muscles, n_k = c->model->n_markers, n_b = c->model->n_bodies;
    const char **names = MHI_TAKE(&c->arena, const char *, n_m + n_k + n_b);
    mhe_status status = make_lists(c, err);
    if (status == MHE_OK && names == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (status == MHE_OK) {
        status = expect_masses(c, err);
    }
    for (int32_t i = 0; i < n_m + n_k + n_b && status == MHE_OK; i++) {
        names[i] = i < n_m         ? c->model->muscles[i].name
                   : i < n_m + n_k ? c->model->markers[i - n_m].name
                                   : c->model->bodies[i - n_m - n_k].name;
    }
    for (int32_t i = 0; i < c->plan.n_entries && status == MHE_OK; i++) {
        const int32_t kind = c->plan.entries[i].kind;
        status = kind == MHI_OF_MARKER ? choose_entry(c, i, names + n_m, n_k, err)
                 : kind == MHI_OF_MASS ? choose_entry(c, i, names + n_m + n_k, n_b, err)
                                       : choose_entry(c, i, names, n_m, err);
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

double mhi_calibration_of(const mhi_calibration *c, int32_t kind, int32_t subject) {
    const int32_t number = c->list_of[kind][subject];
    return number >= 0 ? c->list[number].value : kind <= MHI_OF_GAIN || kind == MHI_OF_MASS ? 1 : 0;
}

const mhi_estimated *mhi_calibration_find(const mhi_calibration *c, int32_t kind, int32_t subject,
                                          int32_t axis) {
    const int32_t *list = c->list_of[kind];
    const int32_t number = kind == MHI_OF_INSERTION                      ? list[3 * subject + axis]
                           : kind == MHI_OF_MARKER && list[subject] >= 0 ? list[subject] + axis
                                                                         : list[subject];
    return number < 0 ? NULL : &c->list[number];
}
