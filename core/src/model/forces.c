/* SPDX-License-Identifier: Apache-2.0 */
/* forces.c: the force plugins of a system. */
#include "base/values.h"
#include "io/external_loads.h"
#include "model/system_private.h"
#include "plugin/instance.h"

#include <math.h>
#include <string.h>

static int32_t larger(int32_t a, int32_t b) {
    return a > b ? a : b;
}

static mhe_status bad(const mhi_force *f, mhe_error *err, const char *what, int32_t value,
                      int32_t limit) {
    return mhe_fail(err, MHE_E_PLUGIN, "%s: layout() gives %s %d of 0 .. %d", f->plugin->id, what,
                    value, limit);
}

static mhe_status check_layout(const mhi_force *f, const mhi_system *s, mhe_error *err) {
    const mhe_force_layout *l = &f->layout;
    if (l->n_inputs < 0 || l->n_paths < 0 || l->n_loads < 0 || l->n_parameters < 0 ||
        l->n_pairs < 0 || (l->n_pairs > 0 && l->pairs == NULL) ||
        (l->n_inputs > 0 && (l->input_names == NULL || l->input_units == NULL)) ||
        (l->n_paths > 0 && l->paths == NULL) || (l->n_loads > 0 && l->loads == NULL) ||
        (l->n_parameters > 0 && l->parameter_names == NULL)) {
        return mhe_fail(err, MHE_E_PLUGIN,
                        "%s: layout() gives a count below 0, or one without its list",
                        f->plugin->id);
    }
    for (int32_t i = 0; i < l->n_paths; i++) {
        if (l->paths[i] < 0 || l->paths[i] >= s->n_paths) {
            return bad(f, err, "path", l->paths[i], s->n_paths - 1);
        }
    }
    for (int32_t i = 0; i < l->n_loads; i++) {
        const int32_t of[] = {l->loads[i].body, l->loads[i].axes, l->loads[i].origin};
        for (int32_t k = 0; k < 3; k++) {
            if (of[k] < (k == 0 ? 0 : -1) || of[k] >= s->description->n_bodies) {
                return bad(f, err, "body", of[k], s->description->n_bodies - 1);
            }
        }
    }
    for (int32_t i = 0; i < 2 * l->n_pairs; i++) {
        const int32_t body = l->pairs[i / 2].body[i % 2];
        if (body < -1 || body >= s->description->n_bodies) {
            return bad(f, err, "body", body, s->description->n_bodies - 1);
        }
    }
    return (l->n_loads > 0 || l->n_pairs > 0) && s->model->loads == NULL
               ? mhe_fail(err, MHE_E_UNSUPPORTED, "%s: the model cannot load bodies", f->plugin->id)
               : MHE_OK;
}

/* The host that force plugins see: the application's, and what the core reads for them. */
static void pass_log(const mhe_host *host, int32_t level, const char *text) {
    const mhe_host *outer = host->data;
    outer->log(outer, level, text);
}

static const void *service(const mhe_host *host, const char *id) {
    const mhe_host *outer = host->data;
    return strcmp(id, MHE_EXTERNAL_LOADS_SERVICE) == 0 ? &mhi_external_loads
                                                       : outer->service(outer, id);
}

static mhe_status create_one(mhi_system *s, const mhi_force_setup *setup, mhi_force *f,
                             mhe_error *err) {
    f->plugin = setup->plugin;
    f->ops = f->plugin->ops;
    mhe_status status = mhi_force_create(f->plugin, &s->host, s->description, setup->config,
                                         &f->self, &f->layout, err);
    if (status == MHE_OK) {
        status = check_layout(f, s, err);
    }
    f->name = setup->name != NULL      ? setup->name
              : f->layout.name != NULL ? f->layout.name
                                       : f->plugin->id;
    for (int32_t i = 0; i < s->n_forces && status == MHE_OK && f->layout.n_inputs > 0; i++) {
        if (s->forces[i].layout.n_inputs > 0 && strcmp(s->forces[i].name, f->name) == 0) {
            return mhe_fail(err, MHE_E_CONFIG, "%s: a force before it has inputs named '%s' too",
                            f->plugin->id, f->name);
        }
    }
    return status;
}

static int32_t acts(const mhe_force_layout *l) {
    return l->generalised || l->n_paths > 0 || l->n_loads > 0 || l->n_pairs > 0;
}

/* "forces.<position>: " before what a plugin says. */
static mhe_status placed(int32_t position, mhe_status status, mhe_error *err) {
    if (status == MHE_OK || err == NULL) {
        return status;
    }
    const mhe_error why = *err;
    err->part = MHE_PART_FORCE;
    err->entry = position;
    return mhe_fail(err, status, "forces.%d: %.700s", (int)position, why.text);
}

mhe_status mhi_forces_create(mhi_system *s, const mhi_system_setup *setup, mhe_error *err) {
    s->host = (mhe_host){.size = sizeof s->host,
                         .data = (void *)(uintptr_t)setup->host,
                         .log = pass_log,
                         .service = service};
    s->forces = MHI_TAKE(&s->arena, mhi_force, setup->n_forces);
    if (s->forces == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < setup->n_forces && status == MHE_OK; i++) {
        mhi_force *f = &s->forces[s->n_forces];
        *f = (mhi_force){.position = i, .first_input = s->face.n_w};
        status = placed(i, create_one(s, &setup->forces[i], f, err), err);
        if (f->self != NULL && (status != MHE_OK || !acts(&f->layout))) {
            f->ops->destroy(f->self);
            continue;
        }
        if (status == MHE_OK) {
            s->n_forces++;
            s->face.n_w += f->layout.n_inputs;
            s->most_paths = larger(s->most_paths, f->layout.n_paths);
            s->most_loads = larger(s->most_loads, f->layout.n_loads);
            s->most_pairs = larger(s->most_pairs, f->layout.n_pairs);
            s->forces_see_rates |=
                f->layout.generalised || f->layout.n_paths > 0 || f->layout.n_pairs > 0;
        }
    }
    return status;
}

void mhi_forces_destroy(mhi_system *s) {
    for (int32_t i = 0; i < s->n_forces; i++) {
        s->forces[i].ops->destroy(s->forces[i].self);
    }
}

mhe_status mhi_system_inputs(const mhi_system *s, double t, double *w, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < s->n_forces && status == MHE_OK; i++) {
        const mhi_force *f = &s->forces[i];
        if (f->layout.n_inputs > 0 && f->ops->input != NULL) {
            status = f->ops->input(f->self, t, w + f->first_input, err);
        }
    }
    return status;
}

void mhi_system_inputs_of(const mhi_system *s, int32_t position, int32_t *first, int32_t *n) {
    *first = *n = 0;
    for (int32_t i = 0; i < s->n_forces; i++) {
        if (s->forces[i].position == position) {
            *first = s->forces[i].first_input;
            *n = s->forces[i].layout.n_inputs;
        }
    }
}

mhe_status mhi_system_known(const mhi_system *s, int32_t position, double *first, double *last,
                            mhe_error *err) {
    for (int32_t i = 0; i < s->n_forces; i++) {
        const mhi_force *f = &s->forces[i];
        if (f->position == position && f->layout.n_inputs > 0 && f->ops->input != NULL) {
            return f->ops->covers(f->self, first, last, err);
        }
    }
    return MHE_OK;
}

int32_t mhi_system_input_is_measured(const mhi_system *s, const char *name) {
    for (int32_t i = 0; i < s->n_forces; i++) {
        if (s->forces[i].layout.n_inputs > 0 && strcmp(s->forces[i].name, name) == 0) {
            return s->forces[i].ops->input == NULL;
        }
    }
    return 0;
}

/* Times are printed with so many digits. */
#define COVER_SLACK 2e-3

mhe_status mhi_system_covers(const mhi_system *s, double first, double last, int32_t measured,
                             mhe_error *err) {
    for (int32_t i = 0; i < s->n_forces; i++) {
        const mhi_force *f = &s->forces[i];
        double from = first, to = last;
        mhe_status status = MHE_OK;
        if (f->layout.n_inputs == 0 || (measured && f->ops->input == NULL)) {
            continue;
        }
        if (f->ops->input == NULL) {
            status = mhe_fail(err, MHE_E_INPUT,
                              "%s: its %d inputs ('%s' ...) come with the frames, and there are no "
                              "data for them",
                              f->plugin->id, (int)f->layout.n_inputs, f->layout.input_names[0]);
        } else {
            status = f->ops->covers(f->self, &from, &to, err);
        }
        if (status == MHE_OK && (from > first + COVER_SLACK || to < last - COVER_SLACK)) {
            status = mhe_fail(err, MHE_E_INPUT,
                              "%s: its inputs are known from %g to %g s, the motion is from %g to "
                              "%g s",
                              f->plugin->id, from, to, first, last);
        }
        if (status != MHE_OK) {
            return placed(f->position, status, err);
        }
    }
    return MHE_OK;
}

static void zero(double *values, int32_t n) {
    memset(values, 0, sizeof(double) * (size_t)n);
}

static void add(double *to, const double *from, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        to[i] += from[i];
    }
}

/* Calls one plugin, whose values then stand in the context. */
static mhe_status evaluate_one(mhi_system_context *c, const mhi_force *f,
                               const mhe_system_point *at, int32_t derivatives, mhe_error *err) {
    const mhe_force_layout *l = &f->layout;
    const int32_t n_q = c->system->face.n_q;
    for (int32_t i = 0; i < l->n_paths; i++) {
        c->t_length[i] = c->length[l->paths[i]];
        c->t_velocity[i] = c->velocity[l->paths[i]];
    }
    const mhe_force_point point = {.size = sizeof point,
                                   .q = at->q,
                                   .v = at->v,
                                   .length = c->t_length,
                                   .velocity = c->t_velocity,
                                   .deflection = c->deflection,
                                   .deflection_rate = c->deflection_rate,
                                   .input = l->n_inputs > 0 ? at->w + f->first_input : NULL};
    mhe_force_values out = {.size = sizeof out};
    if (l->generalised) {
        out.tau = c->own;
        out.tau_q = derivatives ? c->own_q : NULL;
        out.tau_v = derivatives ? c->own_v : NULL;
        zero(c->own, n_q);
        zero(c->own_q, derivatives ? n_q * n_q : 0);
        zero(c->own_v, derivatives ? n_q * n_q : 0);
    }
    if (l->n_paths > 0) {
        out.tension = c->tension;
        out.tension_l = derivatives ? c->tension_l : NULL;
        out.tension_w = derivatives ? c->tension_w : NULL;
        zero(c->tension, l->n_paths);
        zero(c->tension_l, l->n_paths);
        zero(c->tension_w, l->n_paths);
    }
    if (l->n_loads > 0) {
        out.load = c->load;
        zero(c->load, 9 * l->n_loads);
    }
    if (l->n_pairs > 0) {
        out.push = c->push;
        out.push_d = derivatives ? c->push_d : NULL;
        out.push_w = derivatives ? c->push_w : NULL;
        zero(c->push, 6 * l->n_pairs);
        zero(c->push_d, 36 * l->n_pairs);
        zero(c->push_w, 36 * l->n_pairs);
    }
    if (l->n_inputs > 0 && at->w == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "%s: no inputs are known here", f->plugin->id);
    }
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < l->n_pairs && status == MHE_OK; i++) {
        status = mhi_pairs_place(c, &l->pairs[i], at->v, i, err);
    }
    status = status == MHE_OK ? f->ops->evaluate(f->self, &point, &out, err) : status;
    const int finite = (!l->generalised || mhi_all_finite(c->own, n_q)) &&
                       mhi_all_finite(c->tension, l->n_paths) &&
                       mhi_all_finite(c->load, 9 * l->n_loads) &&
                       mhi_all_finite(c->push, 6 * l->n_pairs);
    return status == MHE_OK && !finite
               ? mhe_fail(err, MHE_RETRY, "%s: a force is not finite", f->plugin->id)
               : status;
}

/* Adds what it does to the whole. */
static mhe_status add_one(mhi_system_context *c, const mhi_force *f, const double *v,
                          int32_t derivatives, mhe_error *err) {
    const mhe_force_layout *l = &f->layout;
    const int32_t n_q = c->system->face.n_q;
    if (l->generalised) {
        add(c->other, c->own, n_q);
        add(c->other_q, c->own_q, derivatives ? n_q * n_q : 0);
        add(c->other_v, c->own_v, derivatives ? n_q * n_q : 0);
    }
    for (int32_t i = 0; i < l->n_paths; i++) {
        mhi_path_moments(c, l->paths[i], l->paths[i] + 1, &c->tension[i], c->other);
        if (derivatives) {
            const mhi_path_forces one = {c->tension + i, c->tension_l + i, c->tension_w + i,
                                         c->row_q,       c->row_v,         c->other_q,
                                         c->other_v};
            mhi_path_moment_derivatives(c, l->paths[i], l->paths[i] + 1, &one);
        }
    }
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < l->n_pairs && status == MHE_OK; i++) {
        status = mhi_pairs_push(c, &l->pairs[i], v, i, derivatives, err);
    }
    return l->n_loads == 0 || status != MHE_OK
               ? status
               : c->system->model->loads(c->model, l->loads, l->n_loads, c->load, c->other,
                                         derivatives ? c->other_q : NULL, NULL, err);
}

mhe_status mhi_forces_evaluate(mhi_system_context *c, const mhe_system_point *at,
                               int32_t derivatives, mhe_error *err) {
    const mhi_system *s = c->system;
    const int32_t n_q = s->face.n_q;
    mhe_status status = MHE_OK;
    zero(c->other, n_q);
    zero(c->other_q, derivatives ? n_q * n_q : 0);
    zero(c->other_v, derivatives && s->forces_see_rates ? n_q * n_q : 0);
    for (int32_t i = 0; i < s->n_forces && status == MHE_OK; i++) {
        status = evaluate_one(c, &s->forces[i], at, derivatives, err);
        if (status == MHE_OK) {
            status = add_one(c, &s->forces[i], at->v, derivatives, err);
        }
    }
    return status;
}

mhe_status mhi_forces_pull(mhi_system_context *c, const mhe_system_point *at,
                           const mhi_path_pulls *pulls, mhi_force_loads *loads, void *data,
                           mhe_error *err) {
    const int32_t derivatives = pulls->by_length != NULL;
    const mhi_system *s = c->system;
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < s->n_forces && status == MHE_OK; i++) {
        const mhe_force_layout *l = &s->forces[i].layout;
        status = evaluate_one(c, &s->forces[i], at, derivatives, err);
        for (int32_t k = 0; k < l->n_paths && status == MHE_OK; k++) {
            pulls->tension[l->paths[k]] += c->tension[k];
            if (derivatives) {
                pulls->by_length[l->paths[k]] += c->tension_l[k];
                pulls->by_rate[l->paths[k]] += c->tension_w[k];
            }
        }
        if (status == MHE_OK && l->n_loads > 0) {
            status = loads(data, l->loads, l->n_loads, c->load, err);
        }
    }
    return status;
}

mhe_status mhi_forces_check(mhi_system *s, mhe_error *err) {
    const mhe_description *d = s->description;
    const int32_t n_q = s->face.n_q;
    mhi_system_context *c = NULL;
    mhi_arena arena = {0};
    double *q = MHI_TAKE(&arena, double, n_q), *v = MHI_TAKE(&arena, double, n_q);
    double *w = MHI_TAKE(&arena, double, s->face.n_w);
    if (s->n_forces == 0 || !q || !v || !w) {
        mhi_arena_free(&arena);
        return s->n_forces == 0 ? MHE_OK : mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < n_q; i++) {
        q[i] = d->coordinates[i].value;
    }
    mhe_status status = mhi_system_context_create(s, &c, err);
    const mhe_system_point at = {.size = sizeof at, .q = q, .v = v, .w = w};
    if (status == MHE_OK) {
        const mhe_kinematics out = {.size = sizeof out,
                                    .length = c->length,
                                    .length_q = c->length_q,
                                    .body = s->most_pairs > 0 ? c->body : NULL};
        status = s->model->kinematics(c->model, q, v, &out, err);
    }
    for (int32_t i = 0; i < s->n_forces && status == MHE_OK; i++) {
        const mhi_force *f = &s->forces[i];
        double from = 0, to = 0;
        if (f->layout.n_inputs > 0 && f->ops->input != NULL) {
            status = f->ops->covers(f->self, &from, &to, err);
            status =
                status == MHE_OK ? f->ops->input(f->self, from, w + f->first_input, err) : status;
        }
        if (status == MHE_OK) {
            status = evaluate_one(c, f, &at, 0, err);
        }
        status = placed(f->position, status > 0 ? MHE_E_PLUGIN : status, err);
    }
    mhi_system_context_free(c);
    mhi_arena_free(&arena);
    return status;
}
