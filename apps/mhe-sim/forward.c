/* SPDX-License-Identifier: Apache-2.0 */
/* forward.c: given excitations. */
#include "estimator/columns.h"
#include "estimator/create.h"
#include "motion.h"
#include "simulation.h"

#include <string.h>

typedef struct forward {
    const motion_setup *setup;
    simulation simulation;
    mhi_table *excitations;
    int32_t *column; /* [n_m] */
    mhe_estimator *estimator;
} forward;

static mhe_status open_excitations(forward *f, mhe_error *err) {
    static const mhi_naming naming = {"muscle", {"e_%s", "%s", "%s.excitation"}, 1};
    simulation *s = &f->simulation;
    mhe_status status = mhi_sto_read(f->setup->input, &f->excitations, err);
    if (status != MHE_OK) {
        return status;
    }
    int32_t found = 0;
    uint8_t *used = MHI_TAKE(&s->arena, uint8_t, f->excitations->n_columns);
    f->column = MHI_TAKE(&s->arena, int32_t, s->n_m);
    if (used == NULL || f->column == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    return mhi_columns_match(f->excitations, &naming, s->muscles, s->n_m, f->excitations->n_columns,
                             f->column, used, &found, f->setup->host, err);
}

/* Muscle controls at a time; muscles without a column rest at the lower bound. */
static mhe_status controls_at(forward *f, double time, mhe_error *err) {
    simulation *s = &f->simulation;
    for (int32_t i = 0; i < s->n_m; i++) {
        const double e = f->column[i] < 0 ? f->setup->run->bounds.excitation_min
                                          : mhi_column_at(f->excitations, f->column[i], time, 0);
        if (!(e >= 0 && e <= 1)) {
            return mhe_fail(err, MHE_E_INPUT, "%s: '%s' is %g at %g s; excitations are in [0, 1]",
                            f->excitations->path, s->muscles[i], e, time);
        }
        s->u[i] = e;
    }
    return MHE_OK;
}

static mhe_status first_state(forward *f, mhe_error *err) {
    simulation *s = &f->simulation;
    const mhi_run *run = f->setup->run;
    const mhe_coordinate *c = mhi_system_description(s->system)->coordinates;
    const mhe_real_list *given[2] = {&run->initial.q, &run->initial.qdot};
    for (int32_t part = 0; part < 2; part++) {
        if (given[part]->n != 0 && given[part]->n != s->n_q) {
            return mhe_fail(err, MHE_E_CONFIG,
                            "%s: initial.%s has %d values; the model has %d coordinates", run->path,
                            part == 0 ? "q" : "qdot", given[part]->n, s->n_q);
        }
        for (int32_t i = 0; i < s->n_q; i++) {
            const double unset = part == 0 ? c[i].value : c[i].speed;
            s->x[part * s->n_q + i] = given[part]->n > 0 ? given[part]->values[i] : unset;
        }
    }
    const mhe_status status = mhi_system_close_loops(s->context, s->x, s->x + s->n_q, err);
    return status != MHE_OK
               ? status
               : mhi_system_equilibrium(s->context, s->x, s->x + s->n_q, s->u, s->x, err);
}

static mhe_status integrate(forward *f, mhe_error *err) {
    simulation *s = &f->simulation;
    const mhi_table *e = f->excitations;
    const double begin = e->time[0];
    int32_t n = 0;
    mhe_status status = simulation_steps(s, e, &n, err);
    if (status == MHE_OK) {
        status = mhe_estimator_covers(f->estimator, begin, begin + n / s->rate, 0, err);
    }
    if (status == MHE_OK) {
        status = controls_at(f, begin, err);
    }
    if (status == MHE_OK) {
        status = first_state(f, err);
    }
    for (int32_t k = 0; k <= n && status == MHE_OK; k++) {
        const double time = begin + k / s->rate;
        status = controls_at(f, time, err);
        if (status == MHE_OK) {
            status = simulation_write(s, time, err);
        }
        if (status == MHE_OK && k < n) {
            status = simulation_step(s, time, err);
        }
    }
    return status;
}

mhe_status motion_forward(const motion_setup *setup, mhe_error *err) {
    forward f = {.setup = setup};
    mhe_status status = mhi_estimator_create(setup->run, setup->host, &f.estimator, err);
    if (status == MHE_OK) {
        status = simulation_open(&f.simulation, setup->run, mhi_estimator_system(f.estimator),
                                 setup->host, setup->registry, setup->rate, err);
    }
    if (status == MHE_OK) {
        status = open_excitations(&f, err);
    }
    if (status == MHE_OK) {
        status = simulation_files(&f.simulation, setup->out, setup->input, err);
    }
    if (status == MHE_OK) {
        status = integrate(&f, err);
    }
    if (status == MHE_OK) {
        status = simulation_commit(&f.simulation, err);
    }
    mhi_table_free(f.excitations);
    simulation_close(&f.simulation);
    mhe_estimator_close(f.estimator);
    return status;
}
