/* SPDX-License-Identifier: Apache-2.0 */
/* context.c: instances of the model and the memory of their contexts. */
#include "context.h"

#include "fit.h"

#include <mhe/host.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define PLACEMENT 1e-10 /* m, 1: what rounding may make of long chains */

/* The recursion places links where Simbody does: at one posture in which every joint is turned. */
static mhe_status check_placement(const tree *t, mhe_error *err) {
    const size_t n = (size_t)t->n_joints;
    double *angle = calloc(25 * n, sizeof *angle), worst = 0;
    skeleton *made = NULL;
    if (angle == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for the model");
    }
    double *r = angle + n, *p = r + 9 * n, *r_own = p + 3 * n, *p_own = r_own + 9 * n;
    for (size_t i = 0; i < n; i++) {
        angle[i] = 0.3 + 0.1 * (double)(i % 7);
    }
    mhe_status status = skeleton_create(t, NULL, &made, err);
    if (status == MHE_OK) {
        status = skeleton_place(made, angle, r, p, err);
        skeleton_free(made);
    }
    if (status == MHE_OK) {
        dynamics_place(t, angle, r_own, p_own);
        for (size_t i = 0; i < 12 * n; i++) { /* r and p lie one after the other */
            worst = fmax(worst, fabs(r[i] - r_own[i]) / (1 + fabs(r[i])));
        }
        if (!(worst < PLACEMENT)) {
            status =
                mhe_fail(err, MHE_E_INTERNAL, "links are %g off where Simbody places them", worst);
        }
    }
    free(angle);
    return status;
}

/* Lists what each path depends on. */
static mhe_status list_own(simbody_model *model, mhe_error *err) {
    size_t n_p = (size_t)model->tree->n_muscles, n_q = (size_t)model->tree->n_q;
    uint8_t *pattern = calloc(n_p * n_q + 1, 1);
    model->own_start = calloc(n_p + 1, sizeof *model->own_start);
    model->own = calloc(n_p * n_q + 1, sizeof *model->own);
    if (pattern == NULL || model->own_start == NULL || model->own == NULL) {
        free(pattern);
        return mhe_fail(err, MHE_E_MEMORY, "no memory for the model");
    }
    mhe_status status = simbody_path_pattern(model, pattern, err);
    int32_t n = 0;
    for (size_t p = 0; p < n_p; p++) {
        for (size_t i = 0; i < n_q; i++) {
            if (pattern[p * n_q + i]) {
                model->own[n++] = (int32_t)i;
            }
        }
        model->own_start[p + 1] = n;
    }
    free(pattern);
    return status;
}

/* A mass matrix that is singular is no error until accelerations are asked for. */
static void warn_massless(const mhe_host *host, const simbody_model *model) {
    for (int32_t i = 0; i < model->tree->n_q && host != NULL; i++) {
        if (!tree_moves_mass(model->tree, i)) {
            const mhe_description *d = model->description;
            char text[512];
            (void)snprintf(text, sizeof text,
                           "%s: coordinate '%s' moves no mass: no force has an acceleration there",
                           d->source != NULL ? d->source : "", d->coordinates[i].name);
            host->log(host, MHE_LOG_WARNING, text);
        }
    }
}

static void model_unbuild(simbody_model *model) {
    free(model->bundles);
    routes_free(model->routes);
    routes_free(model->whole);
    free(model->own_start);
    free(model->own);
    tree_free(model->tree);
    model->bundles = NULL;
    model->routes = model->whole = NULL;
    model->own_start = model->own = NULL;
    model->tree = NULL;
}

/* `description`: the model's own, or with polynomials for some paths. */
static mhe_status model_build(simbody_model *model, const mhe_description *description,
                              mhe_error *err) {
    mhe_status status = tree_create(description, &model->tree, err);
    if (status == MHE_OK) {
        status = routes_create(description, model->tree, NULL, &model->routes, err);
    }
    if (status == MHE_OK) {
        model->bundles = path_bundles(model->tree, &model->n_bundles);
        if (model->bundles == NULL) {
            status = mhe_fail(err, MHE_E_MEMORY, "no memory for the model");
        }
    }
    return status == MHE_OK ? list_own(model, err) : status;
}

/* Puts polynomials in place of paths; those stay at hand for poses out of range, and to draw. */
static mhe_status model_fit(simbody_model *model, const simbody_config *c, mhe_error *err) {
    mhe_status status = fits_create(model->host, model->description, model, c->paths_tolerance,
                                    c->paths_range, &model->fits, err);
    if (status != MHE_OK) {
        return status;
    }
    model_unbuild(model);
    status = model_build(model, &model->fits->description, err);
    if (status == MHE_OK) {
        status = routes_create(model->description, model->tree, model->fits->description.paths,
                               &model->whole, err);
    }
    if (status == MHE_OK) {
        routes_join(model->routes, model->whole);
    }
    return status;
}

mhe_status simbody_create(const mhe_host *host, const mhe_description *description,
                          const void *config, void **self, mhe_error *err) {
    const simbody_config *c = config;
    simbody_model *model = calloc(1, sizeof *model);
    if (model == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for the model");
    }
    model->host = host;
    model->description = description;
    model->dynamics = c->dynamics;
    mhe_status status = model_build(model, description, err);
    if (status == MHE_OK) {
        status = check_placement(model->tree, err);
    }
    if (status == MHE_OK && c->paths == SIMBODY_PATHS_FITTED) {
        status = model_fit(model, c, err);
    }
    if (status == MHE_OK && host != NULL && description->n_obstacles > 0) {
        status = simbody_tell_inside(model, err);
    }
    if (status != MHE_OK) {
        simbody_destroy(model);
        return status;
    }
    warn_massless(host, model);
    *self = model;
    return MHE_OK;
}

void simbody_destroy(void *self) {
    simbody_model *model = self;
    if (model != NULL) {
        model_unbuild(model);
        fits_free(model->fits);
        free(model);
    }
}

/* One block for all arrays of doubles. */
static mhe_status context_allocate(simbody_context *c) {
    size_t n = (size_t)c->tree->n_joints, n_q = (size_t)c->tree->n_q;
    size_t n_m = (size_t)c->tree->n_muscles;
    struct {
        double **field;
        size_t n;
    } parts[] = {{&c->v, n_q},
                 {&c->numbers, 4 * (n_q + (size_t)c->description->n_dependents)},
                 {&c->slopes, 4 * n},
                 {&c->angle, n},
                 {&c->speed, n},
                 {&c->acceleration, n},
                 {&c->torque, n},
                 {&c->rounding_torque, n},
                 {&c->r, 9 * n},
                 {&c->p, 3 * n},
                 {&c->joint_mass, n * n},
                 {&c->by_angle, n * n},
                 {&c->by_speed, n * n},
                 {&c->mass, n_q * n_q},
                 {&c->factor, n_q * n_q},
                 {&c->bias, n_q},
                 {&c->rest, n_q},
                 {&c->length_q, n_m * n_q},
                 {&c->loop_acceleration, 6 * n},
                 {&c->loop_vdot, n_q}};
    size_t total = 0;
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        total += parts[i].n;
    }
    c->memory = calloc(total, sizeof *c->memory);
    c->links = calloc(n, sizeof *c->links);
    c->steps = calloc((size_t)c->tree->max_chain + 1, sizeof *c->steps);
    if (c->tree->rounded && c->dynamics == SIMBODY_DYNAMICS_RECURSIVE) {
        c->points = calloc(n, sizeof *c->points);
        c->rounding = calloc(n, sizeof *c->rounding);
        if (c->points == NULL || c->rounding == NULL) {
            return MHE_E_MEMORY;
        }
    }
    if (c->memory == NULL || c->links == NULL || c->steps == NULL) {
        return MHE_E_MEMORY;
    }
    double *next = c->memory;
    for (size_t i = 0; i < sizeof parts / sizeof parts[0]; i++) {
        *parts[i].field = next;
        next += parts[i].n;
    }
    return MHE_OK;
}

mhe_status simbody_context_create(const void *self, void **context, mhe_error *err) {
    const simbody_model *model = self;
    simbody_context *c = calloc(1, sizeof *c);
    if (c == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "no memory for a context");
    }
    c->description = model->description;
    c->tree = model->tree;
    c->host = model->host;
    c->routes = model->routes;
    c->own_start = model->own_start;
    c->own = model->own;
    c->bundles = model->bundles;
    c->n_bundles = model->n_bundles;
    c->dynamics = model->dynamics;
    mhe_status status = context_allocate(c);
    if (status == MHE_OK) {
        status = route_work_create(c->routes, model->whole, &c->route_work);
    }
    if (status != MHE_OK) {
        (void)mhe_fail(err, status, "no memory for a context");
        goto fail;
    }
    if (c->dynamics == SIMBODY_DYNAMICS_SIMBODY) {
        status = skeleton_create(c->tree, c->description, &c->skeleton, err);
    }
    if (status != MHE_OK) {
        goto fail;
    }
    *context = c;
    return MHE_OK;

fail:
    simbody_context_destroy(c);
    return status;
}

/* A fitted path whose pose left the range that it was fitted over was exact there. */
static void tell_left(const simbody_context *c) {
    if (c->host != NULL && c->route_work.left > 0) {
        char text[160];
        (void)snprintf(text, sizeof text,
                       "%lld lengths of fitted paths were outside their range, and exact there "
                       "(model.motion and paths_range say what they are fitted over)",
                       (long long)c->route_work.left);
        c->host->log(c->host, MHE_LOG_WARNING, text);
    }
}

void simbody_context_destroy(void *context) {
    simbody_context *c = context;
    if (c != NULL) {
        tell_left(c);
        skeleton_free(c->skeleton);
        route_work_free(&c->route_work);
        free(c->links);
        free(c->steps);
        free(c->points);
        free(c->rounding);
        free(c->memory);
        free(c);
    }
}
