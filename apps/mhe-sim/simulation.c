/* SPDX-License-Identifier: Apache-2.0 */
#include "simulation.h"

#include "config/options.h"
#include "plugin/instance.h"

#include <math.h>
#include <string.h>

#define PLANT "mhe.integrator.sundials"
#define STEPS_MAX 10000000 /* a day at 100 Hz */

static mhe_status open_integrator(simulation *s, const mhe_host *host, mhi_registry *registry,
                                  mhe_error *err) {
    const mhe_plugin *plugin = NULL;
    mhe_status status = mhi_registry_find(registry, PLANT, MHE_INTEGRATOR_IFACE, &plugin, err);
    if (status != MHE_OK) {
        return status;
    }
    void *config = mhi_arena_take(&s->arena, plugin->config_size);
    if (config == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    status = mhi_options_fill(plugin->options, (int32_t)plugin->option_count, s->run->tree, NULL,
                              NULL, 0, plugin->id, s->run->dir, &s->arena, config, err);
    s->integrator = plugin->ops;
    if (status == MHE_OK) {
        status = mhi_integrator_create(plugin, host, mhi_system_face(s->system), config,
                                       &s->integrator_self, err);
    }
    if (status == MHE_OK) {
        status = s->integrator->context_create(s->integrator_self, s->context,
                                               &s->integrator_context, err);
    }
    return status;
}

mhe_status simulation_open(simulation *s, const mhi_run *run, const mhi_system *system,
                           const mhe_host *host, mhi_registry *registry, double rate,
                           mhe_error *err) {
    const mhe_system *f = mhi_system_face(system);
    const mhe_description *d = mhi_system_description(system);
    *s = (simulation){
        .run = run, .system = system, .rate = rate, .n_q = f->n_q, .n_m = f->n_m, .n_x = f->n_x};
    s->x = MHI_TAKE(&s->arena, double, f->n_x);
    s->x_next = MHI_TAKE(&s->arena, double, f->n_x);
    s->u = MHI_TAKE(&s->arena, double, f->n_u);
    s->w = MHI_TAKE(&s->arena, double, f->n_w);
    s->n_columns = f->n_q + f->n_q + 3 * f->n_m + f->n_z;
    s->row = MHI_TAKE(&s->arena, double, s->n_columns);
    s->marker = MHI_TAKE(&s->arena, double, 3 * d->n_markers);
    s->muscles = MHI_TAKE(&s->arena, const char *, f->n_m);
    if (!s->x || !s->x_next || !s->u || !s->w || !s->row || !s->marker || !s->muscles) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->activation = s->row + f->n_q + f->n_q;
    s->excitation = s->activation + f->n_m;
    s->force = s->excitation + f->n_m;
    for (int32_t i = 0; i < f->n_m; i++) {
        s->muscles[i] = d->muscles[i].name;
    }
    mhe_status status = mhi_system_context_create(system, &s->context, err);
    return status == MHE_OK ? open_integrator(s, host, registry, err) : status;
}

mhe_status simulation_steps(const simulation *s, const mhi_table *input, int32_t *n,
                            mhe_error *err) {
    const double span = input->time[input->n_rows - 1] - input->time[0];
    if (!(span * s->rate < STEPS_MAX)) {
        return mhe_fail(err, MHE_E_INPUT, "%s: %g s at %g Hz are more than %d steps", input->path,
                        span, s->rate, STEPS_MAX);
    }
    *n = (int32_t)floor(span * s->rate + 1e-6);
    return MHE_OK;
}

/* "<prefix>_<name>", n of them; 0: out of memory. */
static int add_labels(simulation *s, const char *prefix, const char *const *names, int32_t n,
                      const char ***labels) {
    for (int32_t i = 0; i < n; i++) {
        const char *label = mhi_arena_format(&s->arena, "%s_%s", prefix, names[i]);
        if (label == NULL) {
            return 0;
        }
        *(*labels)++ = label;
    }
    return 1;
}

/* Labels of a row; NULL: out of memory. */
static const char *const *reference_labels(simulation *s) {
    const mhe_layout *l = mhi_system_face(s->system)->layout;
    const char **labels = MHI_TAKE(&s->arena, const char *, s->n_columns), **next = labels;
    int ok = labels != NULL;
    for (int32_t b = 0; b < l->n_blocks && ok; b++) {
        const mhe_block *block = mhe_layout_at(l, b);
        if (block->role == MHE_ROLE_STATE && block->structure == MHE_STRUCTURE_DENSE) {
            ok = add_labels(s, block->name, block->entry_names, block->count, &next);
        }
    }
    ok = ok && add_labels(s, "a", s->muscles, s->n_m, &next) &&
         add_labels(s, "e", s->muscles, s->n_m, &next) &&
         add_labels(s, "F", s->muscles, s->n_m, &next);
    for (int32_t b = 0; b < l->n_blocks && ok; b++) {
        const mhe_block *block = mhe_layout_at(l, b);
        if (block->role == MHE_ROLE_STATE && block->structure == MHE_STRUCTURE_MUSCLE) {
            ok = add_labels(s, block->name, block->entry_names, block->count, &next);
        }
    }
    return ok ? labels : NULL;
}

mhe_status simulation_files(simulation *s, const char *folder, const char *input, mhe_error *err) {
    const mhe_description *d = mhi_system_description(s->system);
    const char *const *labels = reference_labels(s);
    const char **markers = MHI_TAKE(&s->arena, const char *, d->n_markers);
    if (labels == NULL || markers == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < d->n_markers; i++) {
        markers[i] = d->markers[i].name;
    }
    static const char *const names[] = {"reference.sto", "markers.trc", "emg.sto", "forces.sto"};
    mhe_status status = mhe_outbox_open(folder, &s->outbox, err);
    if (status == MHE_OK) {
        status = mhe_outbox_claim(s->outbox, names, (int32_t)(sizeof names / sizeof names[0]), err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_spare(s->outbox, input, err);
    }
    if (status == MHE_OK) {
        status = mhe_sink_sto(s->outbox, "reference.sto", "reference", labels, s->n_columns,
                              &s->reference, err);
    }
    if (status == MHE_OK) {
        status = mhe_sink_trc(s->outbox, "markers.trc", markers, d->n_markers, s->rate, 1e-3, "mm",
                              &s->trc, err);
    }
    if (status == MHE_OK) {
        status =
            mhe_sink_sto(s->outbox, "emg.sto", "EMG, normalised", s->muscles, s->n_m, &s->emg, err);
    }
    return status;
}

mhe_status simulation_write(simulation *s, double time, mhe_error *err) {
    const double *a = mhi_system_activation(s->system, s->x, s->u);
    const size_t n_m = sizeof(double) * (size_t)s->n_m;
    mhi_muscle_state muscles;
    mhe_system_point at;
    mhi_system_point(s->system, s->x, s->u, NULL, &at);
    mhe_status status = mhi_system_muscles(s->context, &at, 0, &muscles, err);
    if (status != MHE_OK) {
        return status;
    }
    double *row = s->row;
    const mhe_system *f = mhi_system_face(s->system);
    memcpy(row, s->x, sizeof(double) * (size_t)(s->activation - row));
    memcpy(s->activation, a, n_m);
    memcpy(s->excitation, s->u, n_m);
    memcpy(s->force, muscles.force, n_m);
    memcpy(s->force + f->n_m, s->x + f->n_x - f->n_z, sizeof(double) * (size_t)f->n_z);
    status = mhe_sink_row(s->reference, time, row, err);
    if (status == MHE_OK) {
        status = mhi_system_markers(s->context, s->x, s->marker, NULL, err);
    }
    if (status == MHE_OK) {
        status = mhe_sink_row(s->trc, time, s->marker, err);
    }
    return status == MHE_OK ? mhe_sink_row(s->emg, time, s->u, err) : status;
}

mhe_status simulation_step(simulation *s, double time, mhe_error *err) {
    mhe_status status = mhi_system_inputs(s->system, time + 0.5 / s->rate, s->w, err);
    if (status != MHE_OK) {
        return status;
    }
    status = s->integrator->step(s->integrator_context, s->x, s->u, s->w, 1 / s->rate, NULL,
                                 s->x_next, NULL, err);
    if (status != MHE_OK) {
        const mhe_error why = *err;
        return mhe_fail(err, MHE_E_NUMERIC, "integration stopped at %g s: %.500s", time, why.text);
    }
    memcpy(s->x, s->x_next, sizeof(double) * (size_t)s->n_x);
    return MHE_OK;
}

mhe_status simulation_commit(simulation *s, mhe_error *err) {
    return mhe_outbox_commit(s->outbox, err);
}

void simulation_close(simulation *s) {
    mhe_outbox_close(s->outbox);
    if (s->integrator_context != NULL) {
        s->integrator->context_destroy(s->integrator_context);
    }
    if (s->integrator_self != NULL) {
        s->integrator->destroy(s->integrator_self);
    }
    mhi_system_context_free(s->context);
    mhi_arena_free(&s->arena);
}
