/* SPDX-License-Identifier: Apache-2.0 */
#include "calibrate/calibrate.h"
#include "estimator/create.h"
#include "estimator/tasks.h"
#include "io/model_file.h"
#include "model/anatomy.h"
#include "model/bounds.h"
#include "ocp/junction.h"
#include "plugin/instance.h"

#include <math.h>
#include <mhe/config.h>
#include <string.h>
#include <time.h>

static double processor_seconds(void) {
    struct timespec t;
    (void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Where each recording stands in the chain of nodes. */
static mhe_status lay_out(mhi_calibration *c, const mhi_system *system, mhe_error *err) {
    mhi_junction junction;
    mhe_status status = mhi_junction_create(system, NULL, &c->arena, &junction, err);
    int32_t node = -1;
    for (int32_t i = 0; i < c->plan.n_recordings && status == MHE_OK; i++) {
        mhi_motion *m = &c->motions[i];
        if (!m->plan->hold_out) {
            m->first = node < 0 ? 0 : node + junction.n;
            node = m->first + m->n_nodes - 1;
        }
    }
    c->n_intervals = node;
    c->place = MHI_TAKE(&c->arena, int32_t, node);
    if (status == MHE_OK && c->place == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t k = 0, past = 0; k < node && status == MHE_OK; k++) {
        c->place[k] = past++;
        for (int32_t i = 0; i < c->plan.n_recordings; i++) {
            const mhi_motion *m = &c->motions[i];
            if (m->first >= 0 && k >= m->first && k < m->first + m->n_nodes - 1) {
                c->place[k] = -1;
                past = 0;
            }
        }
    }
    return status;
}

typedef struct problem {
    mhi_system *system;
    mhi_ocp *ocp;
    const mhe_solver_ops *solver;
    void *self;
    mhe_solution s;
} problem;

static void close_problem(problem *p) {
    if (p->self != NULL) {
        p->solver->destroy(p->self);
    }
    mhi_ocp_free(p->ocp);
    mhi_system_free(p->system);
}

static mhe_status open_system(mhi_calibration *c, problem *p, mhe_error *err) {
    const mhi_run *run = c->run;
    const char *names[5];
    int32_t n_names = 0;
    mhi_force_setup *forces = NULL;
    int32_t n_forces = 0;
    mhe_status status = mhi_motion_forces(c, &forces, &n_forces, err);
    if (status != MHE_OK) {
        return status;
    }
    for (int32_t i = MHI_OF_STRENGTH; i <= MHI_OF_SLACK; i++) {
        if (c->asked[i]) {
            names[n_names++] = mhi_plan_names[i];
        }
    }
    if (c->asked[MHI_OF_INSERTION]) {
        names[n_names++] = MHI_INSERTION;
    }
    if (c->asked[MHI_OF_MASS]) {
        names[n_names++] = MHI_MASS;
    }
    const mhi_node *model = mhi_node_find(mhi_tree_root(run->tree), "model");
    const mhi_node *paths = model == NULL ? NULL : mhi_node_find(model, "paths");
    if (c->asked[MHI_OF_INSERTION] && paths != NULL && paths->text != NULL &&
        strcmp(paths->text, "fitted") == 0) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, paths,
                           "model.paths: where insertions are estimated paths must be exact");
    }
    mhi_bounds bounds;
    status = mhi_bounds_read(run, c->model, &c->arena, &bounds, err);
    const mhi_system_setup setup = {.host = c->host,
                                    .description = c->model,
                                    .model = run->model.plugin,
                                    .model_config = run->model.config,
                                    .muscle = run->muscle.plugin,
                                    .muscle_config = run->muscle.config,
                                    .formulation = run->formulation,
                                    .residual_torques = run->bounds.residual_torques,
                                    .actuators = run->bounds.actuators,
                                    .forces = forces,
                                    .n_forces = n_forces,
                                    .bounds = &bounds,
                                    .parameters = names,
                                    .n_parameters = n_names};
    return status == MHE_OK ? mhi_system_create(&setup, &p->system, err) : status;
}

/* Whose node k of the problem is. */
static double emg_before(const void *data, int32_t k, int32_t muscle, double delay, double *slope) {
    const mhi_calibration *c = data;
    for (int32_t i = 0; i < c->plan.n_recordings; i++) {
        const mhi_motion *m = &c->motions[i];
        if (m->first >= 0 && k >= m->first && k < m->first + m->n_nodes) {
            return mhi_motion_emg_before(c, m, k - m->first, muscle, delay, slope);
        }
    }
    *slope = 0;
    return NAN;
}

static mhe_status open_ocp(mhi_calibration *c, problem *p, mhe_error *err) {
    const mhi_run *run = c->run;
    const mhi_recording *r = NULL;
    mhi_term_setup *terms = MHI_TAKE(&c->arena, mhi_term_setup, run->n_costs);
    for (int32_t i = 0; i < run->n_costs && terms != NULL; i++) {
        const mhi_use *cost = &run->costs[i];
        terms[i] =
            (mhi_term_setup){cost->plugin, cost->config, cost->weight, cost->sigma, cost->huber};
    }
    for (int32_t i = 0; i < c->plan.n_recordings && r == NULL; i++) {
        r = c->motions[i].first >= 0 ? c->motions[i].recording : NULL;
    }
    const double interval = run->horizon.ratio / r->rate;
    for (int32_t i = 0; i < c->plan.n_recordings; i++) {
        const mhi_motion *m = &c->motions[i];
        if (m->first >= 0 && fabs(m->recording->rate / r->rate - 1) > 1e-3) {
            return mhe_fail(err, MHE_E_INPUT,
                            "%s: %g frames a second, other recordings have %g: all must be alike",
                            m->run.data.markers, m->recording->rate, r->rate);
        }
    }
    const mhi_tasks *tasks = NULL;
    const mhe_status status = mhi_tasks_read(run, c->model, NULL, &c->arena, &tasks, err);
    if (status != MHE_OK) {
        return status;
    }
    c->setup.emg_before = emg_before;
    c->setup.emg = c;
    const mhi_ocp_setup setup = {.host = c->host,
                                 .system = p->system,
                                 .integrator = run->integrator.plugin,
                                 .integrator_config = run->integrator.config,
                                 .terms = terms,
                                 .n_terms = run->n_costs,
                                 .tasks = tasks,
                                 .n_intervals = c->n_intervals,
                                 .interval = interval,
                                 .n_workers = run->realtime.threads,
                                 .parameters = &c->setup,
                                 .estimated = p->system,
                                 .junctions = c->place,
                                 .node_weight = fmin(1, interval / c->plan.noise_time)};
    return terms == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                         : mhi_ocp_create(&setup, &p->ocp, err);
}

/* How much each channel varies over all recordings: what the costs take for the noise's measure. */
static void set_spread(mhi_calibration *c, mhi_ocp *ocp) {
    const int32_t control = mhi_ocp_control(ocp), n_m = c->model->n_muscles;
    double *spread = mhi_ocp_target_spread(ocp, control);
    for (int32_t i = 0; i < n_m; i++) {
        double n = 0, sum = 0, squares = 0;
        for (int32_t k = 0; k < c->n_intervals; k++) {
            const double value = mhi_ocp_target(ocp, control, k)[i];
            n += !isnan(value);
            sum += isnan(value) ? 0 : value;
            squares += isnan(value) ? 0 : value * value;
        }
        spread[i] = n > 0 ? sqrt(fmax(0, squares / n - sum * sum / (n * n))) : NAN;
    }
}

/* Controls of a junction are the state that they lead to, within its bounds alone. */
static void start_junctions(const mhi_calibration *c, problem *p, const mhi_junction *junction) {
    const int32_t n_x = junction->n_x, n_u = junction->n_u;
    for (int32_t k = 0; k < c->n_intervals; k++) {
        const int32_t number = c->place[k];
        double *u = p->s.u + (ptrdiff_t)k * n_u;
        if (number < 0) {
            continue;
        }
        const double *first = p->s.x + (ptrdiff_t)(k - number + junction->n) * n_x;
        for (int32_t i = 0; i < n_u; i++) {
            u[i] = 0;
            mhi_ocp_u_lower(p->ocp, k)[i] = -INFINITY;
            mhi_ocp_u_upper(p->ocp, k)[i] = INFINITY;
        }
        for (int32_t i = 0; i < n_x; i++) {
            const int32_t control = junction->control[number * n_x + i];
            if (control >= 0) {
                u[control] = first[i];
            }
        }
        double *next = p->s.x + (ptrdiff_t)(k + 1) * n_x;
        const mhe_stage_values out = {.size = sizeof out, .x_next = next};
        mhi_junction_step(junction, number, p->s.x + (ptrdiff_t)k * n_x, u, 0, &out);
        for (int32_t i = 0; i < n_x && number < junction->n - 1; i++) {
            mhi_ocp_x_lower(p->ocp, k + 1)[i] = -INFINITY;
            mhi_ocp_x_upper(p->ocp, k + 1)[i] = INFINITY;
        }
    }
}

/* Of a motion's first activations and fibre lengths (m), about where they were found. Activations
 * may be anywhere within their bounds: the estimator finds them with the wrong model, and what
 * holds them there moves what else explains the first moments, a delay above all (by 6 ms at 0.1).
 */
#define FIRST_SD 1.0
#define FIRST_LENGTH_SD 0.01

/* Nothing tells the first activations of redundant muscles apart but what comes before: they stay
 * near those of the start, as far as the motion says nothing of them. */
static mhe_status hold_beginnings(mhi_calibration *c, problem *p, mhe_error *err) {
    const mhe_system *f = mhi_system_face(p->system);
    double *weight = MHI_TAKE(&c->arena, double, f->n_x);
    for (int32_t b = 0; b < f->layout->n_blocks && weight != NULL; b++) {
        const mhe_block *block = mhe_layout_at(f->layout, b);
        const double sd = block->structure == MHE_STRUCTURE_MUSCLE ? FIRST_LENGTH_SD : FIRST_SD;
        const int32_t moves = strcmp(block->name, "q") == 0 || strcmp(block->name, "qdot") == 0;
        for (int32_t i = 0; i < block->count && block->role == MHE_ROLE_STATE && !moves; i++) {
            weight[block->first + i] = 1 / (sd * sd);
        }
    }
    for (int32_t i = 0; i < c->plan.n_recordings && weight != NULL; i++) {
        const mhi_motion *m = &c->motions[i];
        double *centre = MHI_TAKE(&c->arena, double, f->n_x);
        if (m->first < 0 || centre == NULL) {
            continue;
        }
        memcpy(centre, p->s.x + (ptrdiff_t)m->first * f->n_x, sizeof *centre * (size_t)f->n_x);
        mhi_ocp_set_prior_at(p->ocp, m->first, centre, weight);
    }
    return c->arena.failed || weight == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                             : MHE_OK;
}

static mhe_status take_solution(mhi_calibration *c, problem *p, mhe_error *err) {
    const mhe_stage_problem *f = mhi_ocp_face(p->ocp);
    const ptrdiff_t x = (ptrdiff_t)(f->n_intervals + 1) * f->n_x,
                    u = (ptrdiff_t)f->n_intervals * f->n_u;
    p->s = (mhe_solution){.size = sizeof p->s};
    const mhi_room rooms[] = {{&p->s.x, x},          {&p->s.u, u},        {&p->s.lambda, x},
                              {&p->s.zx_lower, x},   {&p->s.zx_upper, x}, {&p->s.zu_lower, u},
                              {&p->s.zu_upper, u},   {&p->s.p, c->n},     {&p->s.zp_lower, c->n},
                              {&p->s.zp_upper, c->n}};
    return MHI_TAKE_ROOMS(&c->arena, rooms, err);
}

/* Bounds of a node. Activations follow excitations that have bounds, so that behind a first node
 * their own say nothing new, and cost a program most of its search for those that hold. */
static void set_bounds(const mhi_calibration *c, const mhe_layout *layout, int32_t k,
                       mhi_ocp *ocp) {
    int32_t is_first = 0;
    for (int32_t i = 0; i < c->plan.n_recordings; i++) {
        is_first |= c->motions[i].first == k;
    }
    const mhe_block *a = mhe_layout_find(layout, MHE_ROLE_STATE, "activation");
    double *lower = mhi_ocp_x_lower(ocp, k), *upper = mhi_ocp_x_upper(ocp, k);
    mhi_layout_bounds(layout, MHE_ROLE_STATE, lower, upper);
    for (int32_t i = 0; a != NULL && i < a->count && !is_first; i++) {
        lower[a->first + i] = -INFINITY;
        upper[a->first + i] = INFINITY;
    }
    if (k < c->n_intervals) {
        mhi_layout_bounds(layout, MHE_ROLE_CONTROL, mhi_ocp_u_lower(ocp, k),
                          mhi_ocp_u_upper(ocp, k));
    }
}

/* Targets, bounds and the start. */
static mhe_status start_problem(mhi_calibration *c, problem *p, mhe_error *err) {
    const mhe_stage_problem *f = mhi_ocp_face(p->ocp);
    const mhe_layout *layout = mhi_system_face(p->system)->layout;
    mhi_junction junction;
    mhe_status status = take_solution(c, p, err);
    for (int32_t k = 0; k <= f->n_intervals && status == MHE_OK; k++) {
        set_bounds(c, layout, k, p->ocp);
    }
    for (int32_t i = 0; i < c->plan.n_recordings && status == MHE_OK; i++) {
        const mhi_motion *m = &c->motions[i];
        if (m->first >= 0) {
            mhi_motion_targets(c, i, p->ocp);
            status = mhi_motion_guess(c, i, f->n_x, f->n_u, p->s.x + (ptrdiff_t)m->first * f->n_x,
                                      p->s.u + (ptrdiff_t)m->first * f->n_u, err);
        }
    }
    status = status == MHE_OK ? mhi_motion_loads(c, p->system, p->ocp, err) : status;
    if (status == MHE_OK) {
        set_spread(c, p->ocp);
        status = hold_beginnings(c, p, err);
    }
    if (status == MHE_OK) {
        status = mhi_junction_create(p->system, c->place, &c->arena, &junction, err);
    }
    if (status == MHE_OK) {
        start_junctions(c, p, &junction);
    }
    for (int32_t i = 0; i < c->n; i++) {
        p->s.p[i] = c->setup.list[i].start;
    }
    return status;
}

/* What was found, and how well it is known. */
static mhe_status take_result(mhi_calibration *c, problem *p, mhe_error *err) {
    const mhe_covariance out = {.size = sizeof out, .node = 0, .pp = c->covariance};
    int32_t known = p->solver->covariance != NULL && !mhi_calibration_is_lost(&c->info);
    mhe_status status = known ? p->solver->covariance(p->self, &out, err) : MHE_OK;
    if (status == MHE_E_NUMERIC) { /* values, though nothing says how well they are known */
        known = 0;
        status = MHE_OK;
    }
    for (int32_t i = 0; i < c->n && status == MHE_OK; i++) {
        mhi_estimated *e = &c->list[i];
        e->value = p->s.p[i] * e->unit;
        const double margin = 1e-4 * (e->upper - e->lower);
        e->at_bound = e->value < e->lower + margin || e->value > e->upper - margin;
        e->sd = !known ? NAN : e->unit * sqrt(c->covariance[i * c->n + i]);
        e->informed =
            e->at_bound || !(e->sd > 0.95 * e->prior_sd) || fabs(e->value - e->mean) > e->prior_sd;
        if (e->at_bound) {
            e->sd = 0;
        }
        for (int32_t j = 0; j < c->n; j++) {
            c->covariance[i * c->n + j] =
                known ? c->covariance[i * c->n + j] * e->unit * c->list[j].unit : NAN;
        }
    }
    return status;
}

/* Where the config names what refuses: the loads of a recording, or what every run has. */
static mhe_status locate(const mhi_calibration *c, mhe_status status, mhe_error *err) {
    const int32_t of_force = err->part == MHE_PART_FORCE && err->entry >= c->run->forces.n;
    for (int32_t i = 0; i < c->plan.n_recordings && of_force; i++) {
        const mhi_use *loads = &c->plan.recordings[i].loads;
        if (c->motions[i].force == err->entry && loads->node != NULL) {
            const mhe_error why = *err;
            return mhi_fail_at(err, status, c->run->tree, loads->node, "%s", why.text);
        }
    }
    return of_force ? status : mhi_estimator_locate(c->run, status, err);
}

mhe_status mhi_calibration_solve(mhi_calibration *c, mhe_error *err) {
    problem p = {.solver = c->run->solver.plugin->ops};
    mhe_status status = open_system(c, &p, err);
    if (status == MHE_OK) {
        status = lay_out(c, p.system, err);
    }
    if (status == MHE_OK) {
        status = open_ocp(c, &p, err);
    }
    status = status == MHE_OK ? MHE_OK : locate(c, status, err);
    if (status == MHE_OK) {
        status = start_problem(c, &p, err);
    }
    if (status == MHE_OK) {
        status = mhi_solver_create(c->run->solver.plugin, c->host, mhi_ocp_face(p.ocp),
                                   c->run->solver.config, &p.self, err);
    }
    if (status == MHE_OK) {
        const double begin = processor_seconds();
        status = mhi_calibration_search(c, p.ocp, p.solver, p.self, &p.s, err);
        c->seconds = processor_seconds() - begin;
    }
    if (status == MHE_OK) {
        status = take_result(c, &p, err);
    }
    close_problem(&p);
    return status;
}

/* What is asked of EMG needs some. */
static mhe_status check_emg(const mhi_calibration *c, mhe_error *err) {
    int32_t has = 0;
    for (int32_t i = 0; i < c->plan.n_recordings; i++) {
        has |= !c->plan.recordings[i].hold_out && c->motions[i].recording->emg != NULL;
    }
    for (int32_t i = 0; i < c->plan.n_entries && !has; i++) {
        const mhi_plan_entry *e = &c->plan.entries[i];
        if (e->kind == MHI_OF_GAIN || e->kind == MHI_OF_SHAPE || e->kind == MHI_OF_DELAY) {
            return mhi_fail_at(err, MHE_E_CONFIG, c->run->tree, e->node,
                               "calibrate.parameters: %s: no recording to learn from has EMG",
                               mhi_plan_names[e->kind]);
        }
    }
    return MHE_OK;
}

mhe_status mhi_calibration_open(mhi_run *run, const mhi_run *start, mhi_registry *registry,
                                const mhe_host *host, mhi_calibration *c, mhe_error *err) {
    *c = (mhi_calibration){.run = run, .start = start, .host = host};
    mhe_status status = mhi_plan_read(run, registry, &c->plan, err);
    if (status == MHE_OK) {
        status = mhi_estimator_read_model(run, host, &c->model, err);
    }
    if (status == MHE_OK) {
        status = mhi_calibration_choose(c, err);
    }
    if (status == MHE_OK) {
        c->motions = MHI_TAKE(&c->arena, mhi_motion, c->plan.n_recordings);
        status = c->motions == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    }
    for (int32_t i = 0; i < c->plan.n_recordings && status == MHE_OK; i++) {
        status = mhi_motion_read(c, i, err);
    }
    status = status == MHE_OK ? check_emg(c, err) : status;
    if (status == MHE_OK) {
        mhi_calibration_tell_copies(c);
        status = mhi_calibration_check_person(c, err);
    }
    if (status == MHE_OK) {
        status = mhi_calibration_doubt(c, err);
    }
    return status;
}

void mhi_calibration_close(mhi_calibration *c) {
    for (int32_t i = 0; i < c->plan.n_recordings && c->motions != NULL; i++) {
        mhi_recording_free(c->motions[i].recording);
    }
    mhi_description_free(c->model);
    mhi_arena_free(&c->arena);
}
