/* SPDX-License-Identifier: Apache-2.0 */
/* estimator.c: the public estimator: frames in, estimates out. */
#include "base/need.h"
#include "estimator/estimator_private.h"
#include "io/model_file.h"
#include "model/bounds.h"
#include "plugin/instance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

mhe_status mhi_estimator_read_model(const mhi_run *run, const mhe_host *host,
                                    mhe_description **description, mhe_error *err) {
    const mhi_model_section *section = &run->model_file;
    mhe_status status = mhi_model_read(section->file, description, err);
    if (status != MHE_OK) {
        return mhi_run_locate_file(run, status, err);
    }
    const mhe_description *d = *description;
    for (int32_t i = 0; i < d->n_warnings; i++) {
        host->log(host, MHE_LOG_WARNING, d->warnings[i]);
    }
    for (int32_t i = 0; i < d->n_unsupported; i++) {
        host->log(host, MHE_LOG_WARNING, d->unsupported[i]);
    }
    if (d->n_unsupported > 0 && section->unsupported == MHI_UNSUPPORTED_STOP) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s (%d such element%s; 'model.unsupported: warn' goes on without)",
                        d->unsupported[0], d->n_unsupported, d->n_unsupported == 1 ? "" : "s");
    }
    status = mhi_estimator_lock(run, *description, err);
    status = status == MHE_OK ? mhi_estimator_motion(run, *description, host, err) : status;
    return mhi_run_locate_file(run, status, err);
}

mhe_status mhi_estimator_locate(const mhi_run *run, mhe_status status, mhe_error *err) {
    const mhi_use *const parts[] = {[MHE_PART_MODEL] = &run->model,
                                    [MHE_PART_MUSCLE] = &run->muscle,
                                    [MHE_PART_INTEGRATOR] = &run->integrator,
                                    [MHE_PART_SOLVER] = &run->solver};
    const mhi_use *found = NULL;
    if (err == NULL) {
        return status;
    }
    if (err->part == MHE_PART_COST && err->entry >= 0 && err->entry < run->n_costs) {
        found = &run->costs[err->entry];
    } else if (err->part > MHE_PART_NONE && err->part <= MHE_PART_SOLVER) {
        found = parts[err->part];
    } else if (err->part == MHE_PART_FORCE && err->entry >= 0 && err->entry <= run->forces.n) {
        found = err->entry == run->forces.n ? &run->external_loads : &run->forces.uses[err->entry];
        found = found->node != NULL ? found : NULL; /* of one by default */
    }
    if (found == NULL) {
        return mhi_run_locate_file(run, status, err);
    }
    const mhe_error why = *err;
    return mhi_fail_at(err, status, run->tree, found->node, "%s", why.text);
}

mhe_status mhe_estimator_covers(const mhe_estimator *e, double first, double last, int32_t measured,
                                mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"estimator", e});
    if (status == MHE_OK) {
        status = mhi_system_covers(e->system, first, last, measured, err);
        status = status == MHE_OK ? MHE_OK : mhi_estimator_locate(e->run, status, err);
    }
    return status;
}

int32_t mhe_estimator_marker_offsets(const mhe_estimator *e, double *offsets) {
    if (e == NULL || offsets == NULL || !(e->rates.offsets.sd > 0)) {
        return 0;
    }
    memcpy(offsets, e->rates.offsets.value, sizeof *offsets * (size_t)e->rates.offsets.n);
    return 1;
}

/* As OpenSim calls them: "hip_r_on_femur_r_in_femur_r". */
static mhe_status name_joints(mhe_estimator *e, mhe_error *err) {
    const mhe_description *d = e->description;
    const int32_t axes = e->run->output.reactions;
    e->joint_names = MHI_TAKE(&e->arena, const char *, d->n_bodies);
    for (int32_t i = 0; i < d->n_bodies && e->joint_names != NULL; i++) {
        const mhe_body *b = &d->bodies[i];
        const int32_t of = axes == MHI_IN_CHILD ? i : axes == MHI_IN_PARENT ? b->parent : -1;
        const char *joint = d->joints != NULL && d->joints[i] != NULL ? d->joints[i] : b->name;
        e->joint_names[i] = mhi_arena_format(&e->arena, "%s_on_%s_in_%s", joint, b->name,
                                             of < 0 ? "ground" : d->bodies[of].name);
    }
    return e->joint_names == NULL || e->arena.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                                     : MHE_OK;
}

static mhe_status create_problem(mhe_estimator *e, mhe_error *err) {
    const mhi_run *run = e->run;
    mhi_bounds bounds;
    mhe_status status = mhi_bounds_read(run, e->description, &e->arena, &bounds, err);
    if (status != MHE_OK) {
        return status;
    }
    const int32_t n_forces = run->forces.n + (run->external_loads.plugin != NULL);
    mhi_force_setup *forces = MHI_TAKE(&e->arena, mhi_force_setup, n_forces);
    if (forces == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < n_forces; i++) {
        const mhi_use *use = i < run->forces.n ? &run->forces.uses[i] : &run->external_loads;
        forces[i] = (mhi_force_setup){use->plugin, use->config, NULL};
    }
    const mhi_system_setup system = {.host = e->host,
                                     .description = e->description,
                                     .model = run->model.plugin,
                                     .model_config = run->model.config,
                                     .muscle = run->muscle.plugin,
                                     .muscle_config = run->muscle.config,
                                     .formulation = run->formulation,
                                     .residual_torques = run->bounds.residual_torques,
                                     .actuators = run->bounds.actuators,
                                     .forces = forces,
                                     .n_forces = n_forces,
                                     .bounds = &bounds};
    status = mhi_system_create(&system, &e->system, err);
    if (status != MHE_OK) {
        return status;
    }
    if (run->output.reactions != MHI_IN_NONE) {
        status = mhi_reactions_create(&system, e->system, &e->reactions, err);
        status = status == MHE_OK ? name_joints(e, err) : status;
    }
    if (status != MHE_OK) {
        return status;
    }
    mhi_term_setup *terms = MHI_TAKE(&e->arena, mhi_term_setup, run->n_costs);
    if (terms == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < run->n_costs; i++) {
        const mhi_use *cost = &run->costs[i];
        terms[i] =
            (mhi_term_setup){cost->plugin, cost->config, cost->weight, cost->sigma, cost->huber};
    }
    status = mhi_tasks_read(run, e->description, e->host, &e->arena, &e->tasks, err);
    if (status != MHE_OK) {
        return status;
    }
    const mhi_ocp_setup ocp = {.host = e->host,
                               .tasks = e->tasks,
                               .system = e->system,
                               .integrator = run->integrator.plugin,
                               .integrator_config = run->integrator.config,
                               .terms = terms,
                               .n_terms = run->n_costs,
                               .n_intervals = run->horizon.window,
                               .interval = 0.01 * run->horizon.ratio, /* until frames tell */
                               .n_workers = run->realtime.threads};
    status = mhi_ocp_create(&ocp, &e->ocp, err);
    if (status == MHE_OK) {
        status = mhi_solver_create(run->solver.plugin, e->host, mhi_ocp_face(e->ocp),
                                   run->solver.config, &e->solver_self, err);
    }
    return status;
}

/* The estimator's parts, once its problem is there. */
static mhe_status create_parts(mhe_estimator *e, mhe_error *err) {
    const mhi_run *run = e->run;
    const int32_t n = run->horizon.window;
    const double interval = mhi_ocp_problem(e->ocp)->interval; /* a guess */
    mhe_status status =
        mhi_window_create(&e->window, n, mhi_ocp_face(e->ocp)->n_x, e->n_u, &e->arena, err);
    if (status == MHE_OK) {
        status =
            mhi_channels_create(run, e->ocp, e->description, n + 1, &e->arena, &e->channels, err);
    }
    if (status == MHE_OK) {
        e->given = MHI_TAKE(&e->arena, const double *, e->channels.n);
        status = e->given == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    if (status == MHE_OK) {
        status = mhi_frame_clock_create(&e->clock, n, run->horizon.ratio, interval, &e->arena, err);
    }
    if (status == MHE_OK) {
        status = mhi_trust_create(&e->trust, e->n_k, run, &e->arena, err);
    }
    if (status == MHE_OK) {
        status =
            mhi_begin_create(&e->begin, e->system, mhi_ocp_context(e->ocp), n + 1, &e->arena, err);
    }
    if (status == MHE_OK) {
        status = mhi_unmet_create(&e->unmet, mhi_ocp_face(e->ocp)->n_x, &e->arena, err);
    }
    if (status == MHE_OK) {
        mhi_start_set_tasks(e->begin.start, e->tasks);
        status = mhi_rates_create(&e->rates, run, e->system, mhi_ocp_context(e->ocp), e->tasks,
                                  n + 1, &e->arena, err);
    }
    if (status == MHE_OK) {
        status = mhi_output_create(&e->output, mhi_system_face(e->system), e->n_k,
                                   e->reactions != NULL ? e->description->n_bodies : 0,
                                   &e->channels, &e->arena, err);
    }
    return status;
}

static mhe_status start_from_config(mhe_estimator *e, mhe_error *err) {
    const mhi_initial_section *initial = &e->run->initial;
    const mhi_node *node = mhi_node_find(mhi_tree_root(e->run->tree), "initial");
    const int32_t given[2] = {initial->q.n, initial->qdot.n};
    for (int32_t i = 0; i < 2; i++) {
        if (given[i] != 0 && given[i] != e->n_q) {
            return mhi_fail_at(err, MHE_E_CONFIG, e->run->tree, node,
                               "initial.%s has %d values; the model has %d coordinates",
                               i == 0 ? "q" : "qdot", given[i], e->n_q);
        }
    }
    for (int32_t i = 0; i < given[0]; i++) {
        const mhe_coordinate *c = &e->description->coordinates[i];
        const double q = initial->q.values[i];
        if (q < c->lower - initial->tolerance || q > c->upper + initial->tolerance) {
            return mhi_fail_at(err, MHE_E_CONFIG, e->run->tree, node,
                               "initial.q: %g of '%s' is outside of its range, %g to %g", q,
                               c->name, c->lower, c->upper);
        }
    }
    mhi_estimator_set_start(e, given[0] > 0 ? initial->q.values : NULL,
                            given[1] > 0 ? initial->qdot.values : NULL);
    return MHE_OK;
}

/* On `description`, or where it is NULL on the one that the run names. */
static mhe_status create_on(const mhi_run *run, const mhe_description *description,
                            const mhe_host *host, mhe_estimator **estimator, mhe_error *err) {
    *estimator = NULL;
    mhe_estimator *e = calloc(1, sizeof *e);
    if (e == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    e->host = host;
    e->run = run;
    e->solver = run->solver.plugin->ops;
    e->node = run->output.node;
    e->pace.budget = 1e-3 * run->realtime.deadline_ms;
    mhe_status status = MHE_OK;
    if (description == NULL) {
        status = mhi_estimator_read_model(run, host, &e->owned_description, err);
    }
    e->description = description == NULL ? e->owned_description : description;
    if (status == MHE_OK) {
        if (err != NULL) {
            err->part = MHE_PART_NONE; /* of an earlier failure */
        }
        status = create_problem(e, err);
        status = status == MHE_OK ? MHE_OK : mhi_estimator_locate(run, status, err);
    }
    if (status == MHE_OK) {
        const mhe_system *f = mhi_system_face(e->system);
        e->n_q = f->n_q;
        e->n_m = f->n_m;
        e->n_r = f->n_r;
        e->n_x = f->n_x;
        e->n_u = f->n_u;
        e->n_k = e->description->n_markers;
        status = create_parts(e, err);
    }
    if (status == MHE_OK) {
        mhi_pace_create(e);
    }
    if (status == MHE_OK && run->output.uncertainty) {
        status = mhi_bands_create(e, &e->bands, err);
    }
    if (status == MHE_OK) {
        status = start_from_config(e, err);
    }
    if (status != MHE_OK) {
        mhe_estimator_close(e);
        return status;
    }
    *estimator = e;
    return MHE_OK;
}

mhe_status mhi_estimator_create(const mhi_run *run, const mhe_host *host, mhe_estimator **estimator,
                                mhe_error *err) {
    return create_on(run, NULL, host, estimator, err);
}

mhe_status mhi_estimator_create_on(const mhi_run *run, const mhe_description *description,
                                   const mhe_host *host, mhe_estimator **estimator,
                                   mhe_error *err) {
    return create_on(run, description, host, estimator, err);
}

void mhe_estimator_close(mhe_estimator *e) {
    if (e == NULL) {
        return;
    }
    mhi_bands_free(e->bands);
    mhi_begin_free(&e->begin);
    mhi_rates_free(&e->rates);
    mhi_channels_free(&e->channels);
    if (e->solver_self != NULL) {
        e->solver->destroy(e->solver_self);
    }
    mhi_reactions_free(e->reactions);
    mhi_ocp_free(e->ocp);
    mhi_system_free(e->system);
    mhi_description_free(e->owned_description);
    mhi_electrodes_close(e->feed.electrodes);
    mhe_config_close(e->config);
    mhi_arena_free(&e->arena);
    free(e);
}

const mhi_system *mhi_estimator_system(const mhe_estimator *e) {
    return e->system;
}

mhi_ocp *mhi_estimator_ocp(mhe_estimator *e) {
    return e->ocp;
}

void mhi_estimator_set_start(mhe_estimator *e, const double *q, const double *qdot) {
    for (int32_t i = 0; i < e->n_q; i++) {
        e->begin.q[i] = isnan(e->begin.q[i]) && q != NULL ? q[i] : e->begin.q[i];
        e->begin.v[i] = isnan(e->begin.v[i]) && qdot != NULL ? qdot[i] : e->begin.v[i];
    }
}

void mhi_estimator_set_state(mhe_estimator *e, const double *x) {
    memcpy(e->window.solution.x, x, sizeof(double) * (size_t)e->n_x);
    e->window.prepared = 0;
    mhi_phase_on(e, MHI_EVENT_SETTLED);
}

void mhi_estimator_set_node(mhe_estimator *e, int32_t node) {
    e->node = node;
    mhi_bands_set_node(e->bands, node);
}

void mhi_estimator_set_deadline(mhe_estimator *e, double seconds) {
    e->pace.budget = seconds;
}

void mhi_estimator_grant(mhe_estimator *e, const mhe_grant *grant) {
    e->pace.is_granted = grant != NULL;
    if (grant != NULL) {
        e->pace.granted = *grant;
    }
}

void mhi_estimator_granted(const mhe_estimator *e, mhe_grant *grant) {
    *grant = e->pace.looks.grant;
}

void mhi_estimator_set_stop(mhe_estimator *e, const atomic_int *stop) {
    e->stop = stop;
    mhi_ocp_set_stop(e->ocp, stop);
}

void mhi_estimator_set_seen(mhe_estimator *e) {
    for (int32_t i = 0; i < e->channels.n; i++) {
        e->channels.rows[i].seen = 1;
    }
}

void mhi_estimator_set_outlier(mhe_estimator *e, double distance) {
    e->trust.outlier = distance;
}
