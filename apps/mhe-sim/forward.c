/* SPDX-License-Identifier: Apache-2.0 */
#include "forward.h"

#include "base/arena.h"
#include "estimator/columns.h"
#include "io/model_file.h"
#include "io/sink.h"
#include "model/system.h"

#include <math.h>
#include <string.h>

typedef struct simulation {
    const forward_setup *setup;
    mhe_description *description;
    mhi_system *system;
    mhi_system_context *context;
    const mhe_integrator_ops *integrator;
    void *integrator_self, *integrator_context;
    mhi_table *excitations;
    int32_t *column;
    double *x, *x_next, *u, *row, *marker;
    const char **labels, **muscles, **markers;
    mhi_outbox *outbox;
    mhi_sink *reference, *trc, *emg;
    mhi_arena arena;
} simulation;

static mhe_status open_model(simulation *s, mhe_error *err) {
    const mhi_run *run = s->setup->run;
    mhe_status status = mhi_model_read(run->model_file.file, &s->description, err);
    if (status == MHE_OK && s->description->n_unsupported > 0 &&
        run->model_file.unsupported == MHI_UNSUPPORTED_STOP) {
        status = mhe_fail(err, MHE_E_INPUT, "%s", s->description->unsupported[0]);
    }
    if (status != MHE_OK) {
        return status;
    }
    const mhi_system_setup setup = {.host = s->setup->host,
                                    .description = s->description,
                                    .model = run->model.plugin,
                                    .model_config = run->model.config,
                                    .muscle = run->muscle.plugin,
                                    .muscle_config = run->muscle.config,
                                    .formulation = run->formulation};
    status = mhi_system_create(&setup, &s->system, err);
    if (status == MHE_OK) {
        status = mhi_system_context_create(s->system, &s->context, err);
    }
    s->integrator = run->integrator.plugin->ops;
    if (status == MHE_OK) {
        status = s->integrator->create(s->setup->host, mhi_system_face(s->system),
                                       run->integrator.config, &s->integrator_self, err);
    }
    if (status == MHE_OK) {
        status = s->integrator->context_create(s->integrator_self, s->context,
                                               &s->integrator_context, err);
    }
    return status;
}

static mhe_status take_arrays(simulation *s, mhe_error *err) {
    const mhe_system *f = mhi_system_face(s->system);
    const mhe_description *d = s->description;
    s->x = MHI_TAKE(&s->arena, double, f->n_x);
    s->x_next = MHI_TAKE(&s->arena, double, f->n_x);
    s->u = MHI_TAKE(&s->arena, double, f->n_u);
    s->row = MHI_TAKE(&s->arena, double, 2 * f->n_q + 3 * f->n_m);
    s->marker = MHI_TAKE(&s->arena, double, 3 * d->n_markers);
    s->column = MHI_TAKE(&s->arena, int32_t, f->n_m);
    s->labels = MHI_TAKE(&s->arena, const char *, 2 * f->n_q + 3 * f->n_m);
    s->muscles = MHI_TAKE(&s->arena, const char *, f->n_m);
    s->markers = MHI_TAKE(&s->arena, const char *, d->n_markers);
    if (!s->x || !s->x_next || !s->u || !s->row || !s->marker || !s->column || !s->labels ||
        !s->muscles || !s->markers) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    int32_t n = 0;
    for (int32_t i = 0; i < 2 * f->n_q; i++) {
        s->labels[n++] = mhi_arena_format(&s->arena, "%s_%s", i < f->n_q ? "q" : "qdot",
                                          d->coordinates[i % f->n_q].name);
    }
    for (int32_t i = 0; i < 3 * f->n_m; i++) {
        static const char *const prefix[] = {"a", "e", "F"};
        s->labels[n++] =
            mhi_arena_format(&s->arena, "%s_%s", prefix[i / f->n_m], d->muscles[i % f->n_m].name);
    }
    for (int32_t i = 0; i < n; i++) {
        if (s->labels[i] == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
    }
    for (int32_t i = 0; i < f->n_m; i++) {
        s->muscles[i] = d->muscles[i].name;
    }
    for (int32_t i = 0; i < d->n_markers; i++) {
        s->markers[i] = d->markers[i].name;
    }
    return MHE_OK;
}

static mhe_status open_excitations(simulation *s, mhe_error *err) {
    static const mhi_naming naming = {"muscle", {"e_%s", "%s", "%s.excitation"}, 1};
    const int32_t n_m = s->description->n_muscles;
    mhe_status status = mhi_sto_read(s->setup->excitations, &s->excitations, err);
    if (status != MHE_OK) {
        return status;
    }
    int32_t found = 0;
    uint8_t *used = MHI_TAKE(&s->arena, uint8_t, s->excitations->n_columns);
    if (used == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    return mhi_columns_match(s->excitations, &naming, s->muscles, n_m, s->excitations->n_columns,
                             s->column, used, &found, s->setup->host, err);
}

/* Muscle controls at a time; muscles without a column rest at the lower bound. */
static mhe_status controls_at(simulation *s, double time, mhe_error *err) {
    const mhi_bounds_section *b = &s->setup->run->bounds;
    for (int32_t i = 0; i < s->description->n_muscles; i++) {
        const double e = s->column[i] < 0 ? b->excitation_min
                                          : mhi_column_at(s->excitations, s->column[i], time, 0);
        if (!(e >= 0 && e <= 1)) {
            return mhe_fail(err, MHE_E_INPUT, "%s: '%s' is %g at %g s; excitations are in [0, 1]",
                            s->excitations->path, s->muscles[i], e, time);
        }
        s->u[i] = e;
    }
    return MHE_OK;
}

static mhe_status first_state(simulation *s, mhe_error *err) {
    const mhi_run *run = s->setup->run;
    const mhe_system *f = mhi_system_face(s->system);
    const mhe_real_list *given[2] = {&run->initial.q, &run->initial.qdot};
    for (int32_t part = 0; part < 2; part++) {
        if (given[part]->n != 0 && given[part]->n != f->n_q) {
            return mhe_fail(err, MHE_E_CONFIG,
                            "%s: initial.%s has %d values; the model has %d coordinates", run->path,
                            part == 0 ? "q" : "qdot", given[part]->n, f->n_q);
        }
        for (int32_t i = 0; i < f->n_q; i++) {
            const mhe_coordinate *c = &s->description->coordinates[i];
            const double value = part == 0 ? c->value : c->speed;
            s->x[part * f->n_q + i] = given[part]->n > 0 ? given[part]->values[i] : value;
        }
    }
    memcpy(s->x + 2 * f->n_q, s->u, sizeof(double) * (size_t)f->n_a);
    return MHE_OK;
}

static mhe_status open_files(simulation *s, mhe_error *err) {
    const mhe_system *f = mhi_system_face(s->system);
    mhe_status status = mhi_outbox_open(s->setup->out, &s->outbox, err);
    if (status == MHE_OK) {
        status = mhi_sink_sto(s->outbox, "reference.sto", "reference", s->labels,
                              2 * f->n_q + 3 * f->n_m, &s->reference, err);
    }
    if (status == MHE_OK) {
        status = mhi_sink_trc(s->outbox, "markers.trc", s->markers, s->description->n_markers,
                              s->setup->rate, 1e-3, "mm", &s->trc, err);
    }
    if (status == MHE_OK) {
        status =
            mhi_sink_sto(s->outbox, "emg.sto", "EMG, normalised", s->muscles, f->n_m, &s->emg, err);
    }
    return status;
}

static mhe_status write_row(simulation *s, double time, mhe_error *err) {
    const mhe_system *f = mhi_system_face(s->system);
    const double *q = s->x, *v = s->x + f->n_q, *a = f->n_a > 0 ? s->x + 2 * f->n_q : s->u;
    const size_t n_m = sizeof(double) * (size_t)f->n_m;
    mhi_muscle_state muscles;
    mhe_status status = mhi_system_muscles(s->context, q, v, a, 0, &muscles, err);
    if (status != MHE_OK) {
        return status;
    }
    double *row = s->row;
    memcpy(row, s->x, sizeof(double) * (size_t)(2 * f->n_q));
    memcpy(row + 2 * f->n_q, a, n_m);
    memcpy(row + 2 * f->n_q + f->n_m, s->u, n_m);
    memcpy(row + 2 * f->n_q + 2 * f->n_m, muscles.force, n_m);
    status = mhi_sink_row(s->reference, time, row, err);
    if (status == MHE_OK) {
        status = mhi_system_markers(s->context, q, s->marker, NULL, err);
    }
    if (status == MHE_OK) {
        status = mhi_sink_row(s->trc, time, s->marker, err);
    }
    return status == MHE_OK ? mhi_sink_row(s->emg, time, s->u, err) : status;
}

static mhe_status integrate(simulation *s, mhe_error *err) {
    const mhi_table *e = s->excitations;
    const double step = 1 / s->setup->rate, begin = e->time[0];
    const int32_t n = (int32_t)floor((e->time[e->n_rows - 1] - begin) / step + 1e-6);
    const mhe_system *f = mhi_system_face(s->system);
    mhe_status status = controls_at(s, begin, err);
    if (status == MHE_OK) {
        status = first_state(s, err);
    }
    for (int32_t k = 0; k <= n && status == MHE_OK; k++) {
        const double time = begin + k * step;
        status = controls_at(s, time, err);
        if (status == MHE_OK) {
            status = write_row(s, time, err);
        }
        if (status == MHE_OK && k < n) {
            status = s->integrator->step(s->integrator_context, s->x, s->u, step, s->x_next, NULL,
                                         NULL, err);
            memcpy(s->x, s->x_next, sizeof(double) * (size_t)f->n_x);
        }
        if (status == MHE_RETRY) {
            const mhe_error why = *err;
            status = mhe_fail(err, MHE_E_NUMERIC, "integration stopped at %g s: %s", time, why.text);
        }
    }
    return status;
}

mhe_status forward(const forward_setup *setup, mhe_error *err) {
    simulation s = {.setup = setup};
    mhe_status status = open_model(&s, err);
    if (status == MHE_OK) {
        status = take_arrays(&s, err);
    }
    if (status == MHE_OK) {
        status = open_excitations(&s, err);
    }
    if (status == MHE_OK) {
        status = open_files(&s, err);
    }
    if (status == MHE_OK) {
        status = integrate(&s, err);
    }
    if (status == MHE_OK) {
        status = mhi_outbox_commit(s.outbox, err);
    }
    mhi_outbox_close(s.outbox);
    mhi_table_free(s.excitations);
    if (s.integrator_context != NULL) {
        s.integrator->context_destroy(s.integrator_context);
    }
    if (s.integrator_self != NULL) {
        s.integrator->destroy(s.integrator_self);
    }
    mhi_system_context_free(s.context);
    mhi_system_free(s.system);
    mhi_description_free(s.description);
    mhi_arena_free(&s.arena);
    return status;
}
