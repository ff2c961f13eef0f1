/* SPDX-License-Identifier: Apache-2.0 */
#include "results.h"

#include "base/arena.h"
#include "matlab.h"

#include <math.h>
#include <string.h>

#define MOST_SINKS 2

/* Also what picture.c, report.c and summary.c write. */
const char *const results_names[] = {
    "estimates.sto", "estimates.csv", "motion.sto",    "forces.sto",      "forces.csv",
    "torques.sto",   "torques.csv",   "markers.trc",   "markers.csv",     "marker_residuals.sto",
    "emg.sto",       "emg.csv",       "quality.sto",   "quality.csv",     "marker_residuals.csv",
    "results.mat",   "config.yaml",   "summary.json",  "report.html",     "estimates.gp",
    "estimates.svg", "reactions.sto", "reactions.csv", "uncertainty.sto", "uncertainty.csv"};
const int32_t results_n_names = (int32_t)(sizeof results_names / sizeof results_names[0]);

/* One table in all its formats. */
typedef struct series {
    mhe_sink *sinks[MOST_SINKS];
    int32_t n_sinks;
    matlab_table *table; /* NULL: none */
} series;

struct results {
    mhe_estimator_info info;
    series estimates, motion, forces, markers, residuals, torques, emg, quality, reactions,
        uncertainty;
    matlab *matlab;             /* NULL: no such file */
    const mhe_block *actuators; /* NULL: none are driven */
    int32_t csv;
    double *row; /* of the widest file */
    mhi_arena arena;
};

/* A list of column names. */
typedef struct names {
    results *owner;
    const char **list;
    int32_t n, failed;
} names;

/* Appends "<prefix><name><suffix>" for each name. */
static void add_names(names *to, const char *prefix, const char *const *list, int32_t n,
                      const char *suffix) {
    for (int32_t i = 0; i < n && !to->failed; i++) {
        const char *name = mhi_arena_format(&to->owner->arena, "%s%s%s", prefix, list[i], suffix);
        to->failed = name == NULL;
        to->list[to->n++] = name;
    }
}

/* Everything but the .sto or .trc. */
static mhe_status open_others(results *r, mhe_outbox *outbox, const char *name, const names *labels,
                              series *s, mhe_error *err) {
    mhe_status status = MHE_OK;
    if (labels->failed) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (r->csv) {
        char file[64];
        (void)snprintf(file, sizeof file, "%s.csv", name);
        status = mhe_sink_csv(outbox, file, labels->list, labels->n, &s->sinks[s->n_sinks], err);
        s->n_sinks += status == MHE_OK;
    }
    if (status == MHE_OK && r->matlab != NULL) {
        status = matlab_add(r->matlab, name, labels->list, labels->n, &s->table, err);
    }
    return status;
}

static mhe_status open_series(results *r, mhe_outbox *outbox, const char *name, const char *title,
                              const names *labels, series *s, mhe_error *err) {
    char file[64];
    (void)snprintf(file, sizeof file, "%s.sto", name);
    mhe_status status = labels->failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                       : mhe_sink_sto(outbox, file, title, labels->list, labels->n,
                                                      &s->sinks[0], err);
    s->n_sinks = status == MHE_OK;
    return status == MHE_OK ? open_others(r, outbox, name, labels, s, err) : status;
}

/* Whether block i of the system is of states that no other column shows: what muscles have beside
 * their activation ("fiber_length"). */
static const mhe_block *own_states(const mhe_layout *layout, int32_t i) {
    static const char *const shown[] = {"q", "qdot", "activation"};
    const mhe_block *block = mhe_layout_at(layout, i);
    int32_t known = block->role != MHE_ROLE_STATE;
    for (size_t k = 0; k < sizeof shown / sizeof shown[0]; k++) {
        known |= strcmp(block->name, shown[k]) == 0;
    }
    return known ? NULL : block;
}

static void add_own_states(results *r, names *labels) {
    for (int32_t i = 0; i < r->info.layout->n_blocks; i++) {
        const mhe_block *block = own_states(r->info.layout, i);
        const char *prefix = block == NULL ? "" : mhi_arena_format(&r->arena, "%s_", block->name);
        labels->failed |= prefix == NULL;
        if (block != NULL && prefix != NULL) {
            add_names(labels, prefix, block->entry_names, block->count, "");
        }
    }
}

static mhe_status open_states(results *r, mhe_outbox *outbox, names *labels, mhe_error *err) {
    const mhe_estimator_info *f = &r->info;
    add_names(labels, "q_", f->coordinate_names, f->n_q, "");
    add_names(labels, "qdot_", f->coordinate_names, f->n_q, "");
    add_names(labels, "a_", f->muscle_names, f->n_muscles, "");
    if (f->formulation == 0) {
        add_names(labels, "e_", f->muscle_names, f->n_muscles, "");
    }
    add_own_states(r, labels);
    mhe_status status =
        open_series(r, outbox, "estimates", "estimates", labels, &r->estimates, err);
    labels->n = 0;
    add_names(labels, "", f->coordinate_names, f->n_q, "");
    add_names(labels, "", f->muscle_names, f->n_muscles, ".activation");
    if (status == MHE_OK && !labels->failed) { /* what the OpenSim GUI shows on the model */
        status = mhe_sink_sto(outbox, "motion.sto", "motion", labels->list, labels->n,
                              &r->motion.sinks[0], err);
        r->motion.n_sinks = status == MHE_OK;
    }
    return status;
}

static mhe_status open_markers(results *r, mhe_outbox *outbox, const mhe_recording_info *recording,
                               names *labels, mhe_error *err) {
    static const char *const axes[] = {"_x", "_y", "_z"};
    const mhe_estimator_info *f = &r->info;
    labels->n = 0;
    for (int32_t i = 0; i < 3 * f->n_markers; i++) {
        add_names(labels, "", &f->marker_names[i / 3], 1, axes[i % 3]);
    }
    mhe_status status = mhe_sink_trc(outbox, "markers.trc", f->marker_names, f->n_markers,
                                     recording->rate / f->ratio, recording->marker_unit,
                                     recording->marker_unit_name, &r->markers.sinks[0], err);
    r->markers.n_sinks = status == MHE_OK;
    return status == MHE_OK ? open_others(r, outbox, "markers", labels, &r->markers, err) : status;
}

static mhe_status open_reactions(results *r, mhe_outbox *outbox, names *labels, mhe_error *err) {
    static const char *const parts[] = {"_fx", "_fy", "_fz", "_mx", "_my", "_mz"};
    labels->n = 0;
    for (int32_t i = 0; i < 6 * r->info.n_joints; i++) {
        add_names(labels, "", &r->info.joint_names[i / 6], 1, parts[i % 6]);
    }
    return open_series(r, outbox, "reactions", "what joints transmit (N, N m)", labels,
                       &r->reactions, err);
}

static mhe_status open_uncertainty(results *r, mhe_outbox *outbox, names *labels, mhe_error *err) {
    const mhe_estimator_info *f = &r->info;
    labels->n = 0;
    add_names(labels, "q_", f->coordinate_names, f->n_q, "");
    add_names(labels, "a_", f->muscle_names, f->n_muscles, "");
    add_names(labels, "force_", f->muscle_names, f->n_muscles, "");
    add_names(labels, "moment_", f->coordinate_names, f->n_q, "");
    return open_series(r, outbox, "uncertainty",
                       "standard deviations of angles, activations, forces (N), moments (N m)",
                       labels, &r->uncertainty, err);
}

static mhe_status open_all(results *r, mhe_outbox *outbox, const mhe_recording_info *recording,
                           const char **room, mhe_error *err) {
    static const char *quality[] = {"status",   "iterations", "kkt_residual",
                                    "solve_ms", "marker_rms", "emg_rms"};
    const mhe_estimator_info *f = &r->info;
    names labels = {.owner = r, .list = room};
    mhe_status status = open_states(r, outbox, &labels, err);
    labels.n = 0;
    add_names(&labels, "", f->muscle_names, f->n_muscles, "");
    if (status == MHE_OK) {
        status = open_series(r, outbox, "forces", "muscle forces (N)", &labels, &r->forces, err);
    }
    labels.n = 0;
    add_names(&labels, "moment_", f->coordinate_names, f->n_q, "");
    add_names(&labels, "residual_", f->coordinate_names, f->n_residual_torques, "");
    if (r->actuators != NULL) {
        add_names(&labels, "actuator_", r->actuators->entry_names, r->actuators->count, "");
    }
    if (status == MHE_OK) {
        status =
            open_series(r, outbox, "torques", "joint moments by muscles, residual torques (N m)",
                        &labels, &r->torques, err);
    }
    if (status == MHE_OK) {
        status = open_markers(r, outbox, recording, &labels, err);
    }
    labels.n = 0;
    add_names(&labels, "", f->marker_names, f->n_markers, "");
    if (status == MHE_OK) {
        status = open_series(r, outbox, "marker_residuals", "distances of the markers (m)", &labels,
                             &r->residuals, err);
    }
    labels.n = 0;
    add_names(&labels, "", f->muscle_names, f->n_muscles, "");
    if (status == MHE_OK) {
        status = open_series(r, outbox, "emg", "EMG that was tracked", &labels, &r->emg, err);
    }
    if (status == MHE_OK && f->n_joints > 0) {
        status = open_reactions(r, outbox, &labels, err);
    }
    if (status == MHE_OK && f->uncertainty) {
        status = open_uncertainty(r, outbox, &labels, err);
    }
    const names of_quality = {.owner = r, .list = quality, .n = 6};
    return status == MHE_OK ? open_series(r, outbox, "quality", "quality of each estimate",
                                          &of_quality, &r->quality, err)
                            : status;
}

mhe_status results_open(mhe_outbox *outbox, const mhe_estimator_info *info,
                        const mhe_recording_info *recording, const char *formats, results **result,
                        mhe_error *err) {
    *result = NULL;
    mhi_arena arena = {0};
    const int32_t widest = 4 * info->n_q + 2 * info->n_muscles + 3 * info->n_markers +
                           6 * info->n_joints + info->layout->n_x + info->layout->n_u + 6;
    results *r = MHI_TAKE(&arena, results, 1);
    const char **room = MHI_TAKE(&arena, const char *, widest);
    if (r != NULL) {
        r->info = *info;
        r->actuators = mhe_layout_find(info->layout, MHE_ROLE_CONTROL, "actuator");
        r->csv = strstr(formats, "csv") != NULL;
        r->row = MHI_TAKE(&arena, double, widest);
        r->arena = arena;
    }
    if (r == NULL || room == NULL || r->row == NULL) {
        mhi_arena_free(&arena);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = strstr(formats, "mat") != NULL
                            ? matlab_open(outbox, "results.mat", &r->matlab, err)
                            : MHE_OK;
    if (status == MHE_OK) {
        status = open_all(r, outbox, recording, room, err);
    }
    if (status != MHE_OK) {
        results_close(r);
        return status;
    }
    *result = r;
    return MHE_OK;
}

void results_close(results *r) {
    if (r != NULL) {
        mhi_arena arena = r->arena;
        mhi_arena_free(&arena);
    }
}

/* Appends n values to the row. */
static int32_t put(results *r, int32_t at, const double *values, int32_t n) {
    memcpy(r->row + at, values, sizeof(double) * (size_t)n);
    return at + n;
}

static mhe_status write_row(const series *s, double time, const double *values, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < s->n_sinks && status == MHE_OK; i++) {
        status = mhe_sink_row(s->sinks[i], time, values, err);
    }
    return status == MHE_OK && s->table != NULL ? matlab_row(s->table, time, values, err) : status;
}

/* NaN where an estimate has none. */
static mhe_status write_uncertainty(results *r, const mhe_estimate *e, mhe_error *err) {
    const mhe_estimator_info *f = &r->info;
    int32_t n = 2 * (f->n_q + f->n_muscles);
    for (int32_t i = 0; i < n; i++) {
        r->row[i] = NAN;
    }
    if (e->q_sd != NULL) {
        n = put(r, 0, e->q_sd, f->n_q);
        n = put(r, n, e->activation_sd, f->n_muscles);
        n = put(r, n, e->force_sd, f->n_muscles);
        (void)put(r, n, e->moment_sd, f->n_q);
    }
    return write_row(&r->uncertainty, e->time, r->row, err);
}

mhe_status results_write(results *r, const mhe_estimate *e, const double *distance,
                         const double *emg, mhe_error *err) {
    const mhe_estimator_info *f = &r->info;
    int32_t n = put(r, 0, e->q, f->n_q);
    n = put(r, n, e->qdot, f->n_q);
    n = put(r, n, e->activation, f->n_muscles);
    if (e->excitation != NULL) {
        n = put(r, n, e->excitation, f->n_muscles);
    }
    for (int32_t i = 0; i < f->layout->n_blocks; i++) {
        const mhe_block *block = own_states(f->layout, i);
        if (block != NULL) {
            n = put(r, n, e->states + block->first, block->count);
        }
    }
    mhe_status status = write_row(&r->estimates, e->time, r->row, err);
    if (status == MHE_OK) {
        (void)put(r, put(r, 0, e->q, f->n_q), e->activation, f->n_muscles);
        status = write_row(&r->motion, e->time, r->row, err);
    }
    if (status == MHE_OK) {
        status = write_row(&r->forces, e->time, e->force, err);
    }
    if (status == MHE_OK) {
        status = write_row(&r->markers, e->time, e->markers, err);
    }
    if (status == MHE_OK) {
        status = write_row(&r->residuals, e->time, distance, err);
    }
    if (status == MHE_OK) {
        status = write_row(&r->emg, e->time, emg, err);
    }
    if (status == MHE_OK) {
        n = put(r, 0, e->moment, f->n_q);
        n = put(r, n, e->residual, f->n_residual_torques);
        if (r->actuators != NULL) {
            (void)put(r, n, mhe_estimate_block(e, r->actuators), r->actuators->count);
        }
        status = write_row(&r->torques, e->time, r->row, err);
    }
    if (status == MHE_OK && e->reactions != NULL) {
        status = write_row(&r->reactions, e->time, e->reactions, err);
    }
    if (status == MHE_OK && f->uncertainty) {
        status = write_uncertainty(r, e, err);
    }
    if (status == MHE_OK) {
        /* Of a solve that broke off it is infinite, which few readers of tables take. */
        const double residual = isfinite(e->kkt_residual) ? e->kkt_residual : NAN;
        const double quality[] = {e->status,           e->iterations, residual,
                                  1e3 * e->solve_time, e->marker_rms, e->emg_rms};
        status = write_row(&r->quality, e->time, quality, err);
    }
    return status;
}
