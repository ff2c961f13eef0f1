/* SPDX-License-Identifier: Apache-2.0 */
#include "results.h"

#include "base/arena.h"

#include <string.h>

struct results {
    mhe_estimator_info info;
    mhi_sink *estimates, *forces, *markers, *torques, *quality;
    double *row; /* of the widest file */
    mhi_arena arena;
};

/* Appends "<prefix><name>" for each name. */
static int add_labels(results *r, const char **labels, int32_t *n, const char *prefix,
                      const char *const *names, int32_t n_names) {
    for (int32_t i = 0; i < n_names; i++) {
        labels[*n] = mhi_arena_format(&r->arena, "%s%s", prefix, names[i]);
        if (labels[(*n)++] == NULL) {
            return -1;
        }
    }
    return 0;
}

static mhe_status open_sinks(results *r, mhi_outbox *outbox, const mhi_recording *recording,
                             const char **labels, mhe_error *err) {
    static const char *const quality[] = {"status",   "iterations", "kkt_residual",
                                          "solve_ms", "marker_rms", "emg_rms"};
    const mhe_estimator_info *f = &r->info;
    const int driven = f->formulation == 0;
    int32_t n = 0;
    if (add_labels(r, labels, &n, "q_", f->coordinate_names, f->n_q) != 0 ||
        add_labels(r, labels, &n, "qdot_", f->coordinate_names, f->n_q) != 0 ||
        add_labels(r, labels, &n, "a_", f->muscle_names, f->n_muscles) != 0 ||
        (driven && add_labels(r, labels, &n, "e_", f->muscle_names, f->n_muscles) != 0)) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status =
        mhi_sink_sto(outbox, "estimates.sto", "estimates", labels, n, &r->estimates, err);
    if (status == MHE_OK) {
        status = mhi_sink_sto(outbox, "forces.sto", "muscle forces (N)", f->muscle_names,
                              f->n_muscles, &r->forces, err);
    }
    n = 0;
    if (add_labels(r, labels, &n, "moment_", f->coordinate_names, f->n_q) != 0 ||
        add_labels(r, labels, &n, "residual_", f->coordinate_names, f->n_residual_torques) != 0) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (status == MHE_OK) {
        status =
            mhi_sink_sto(outbox, "torques.sto", "joint moments by muscles, residual torques (N m)",
                         labels, n, &r->torques, err);
    }
    if (status == MHE_OK) {
        status = mhi_sink_trc(outbox, "markers.trc", f->marker_names, f->n_markers,
                              recording->rate / f->ratio, recording->unit, recording->unit_name,
                              &r->markers, err);
    }
    if (status == MHE_OK) {
        status = mhi_sink_sto(outbox, "quality.sto", "quality of each estimate", quality, 6,
                              &r->quality, err);
    }
    return status;
}

mhe_status results_open(mhi_outbox *outbox, const mhe_estimator_info *info,
                        const mhi_recording *recording, results **result, mhe_error *err) {
    *result = NULL;
    mhi_arena arena = {0};
    const int32_t widest = 4 * info->n_q + 2 * info->n_muscles + 6;
    results *r = MHI_TAKE(&arena, results, 1);
    const char **labels = MHI_TAKE(&arena, const char *, widest);
    if (r != NULL) {
        r->info = *info;
        r->row = MHI_TAKE(&arena, double, widest);
        r->arena = arena;
    }
    if (r == NULL || labels == NULL || r->row == NULL) {
        mhi_arena_free(&arena);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = open_sinks(r, outbox, recording, labels, err);
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

mhe_status results_write(results *r, const mhe_estimate *e, mhe_error *err) {
    const mhe_estimator_info *f = &r->info;
    int32_t n = put(r, 0, e->q, f->n_q);
    n = put(r, n, e->qdot, f->n_q);
    n = put(r, n, e->activation, f->n_muscles);
    if (e->excitation != NULL) {
        (void)put(r, n, e->excitation, f->n_muscles);
    }
    mhe_status status = mhi_sink_row(r->estimates, e->time, r->row, err);
    if (status == MHE_OK) {
        status = mhi_sink_row(r->forces, e->time, e->force, err);
    }
    if (status == MHE_OK) {
        status = mhi_sink_row(r->markers, e->time, e->markers, err);
    }
    if (status == MHE_OK) {
        n = put(r, 0, e->moment, f->n_q);
        (void)put(r, n, e->residual, f->n_residual_torques);
        status = mhi_sink_row(r->torques, e->time, r->row, err);
    }
    if (status == MHE_OK) {
        const double quality[] = {e->status,           e->iterations, e->kkt_residual,
                                  1e3 * e->solve_time, e->marker_rms, e->emg_rms};
        status = mhi_sink_row(r->quality, e->time, quality, err);
    }
    return status;
}
