/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/errors.h"

#include "base/arena.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { Q, QDOT, ACTIVATION, EXCITATION, FORCE, MARKER, N_KINDS };

struct mhi_errors {
    const mhi_recording *recording;
    mhi_system_context *context;
    int32_t n_q, n_m, n_k;
    int32_t n[N_KINDS], offset[N_KINDS], n_channels;
    int32_t next_frame; /* of the recording, to look from */
    double *marker;     /* [3 n_k] of the reference */
    double *squares;    /* [n_rows x n_channels], grown as needed */
    int32_t n_rows, capacity;
    mhi_arena arena;
};

mhe_status mhi_errors_create(const mhi_system *system, const mhi_recording *recording,
                             mhi_errors **errors, mhe_error *err) {
    *errors = NULL;
    const mhe_description *d = mhi_system_description(system);
    mhi_errors *e = calloc(1, sizeof *e);
    if (e == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    e->recording = recording;
    e->n_q = d->n_coordinates;
    e->n_m = d->n_muscles;
    e->n_k = d->n_markers;
    const int32_t n[N_KINDS] = {e->n_q, e->n_q, e->n_m, e->n_m, e->n_m, e->n_k};
    for (int32_t kind = 0; kind < N_KINDS; kind++) {
        e->n[kind] = n[kind];
        e->offset[kind] = e->n_channels;
        e->n_channels += n[kind];
    }
    e->marker = MHI_TAKE(&e->arena, double, 3 * e->n_k);
    mhe_status status = e->marker == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                          : mhi_system_context_create(system, &e->context, err);
    if (status != MHE_OK) {
        mhi_errors_free(e);
        return status;
    }
    *errors = e;
    return MHE_OK;
}

void mhi_errors_free(mhi_errors *e) {
    if (e == NULL) {
        return;
    }
    mhi_system_context_free(e->context);
    mhi_arena_free(&e->arena);
    free(e->squares);
    free(e);
}

/* The recording's frame of an estimate, -1 if there is none at its time. */
static int32_t frame_at(mhi_errors *e, double time) {
    const mhi_recording *r = e->recording;
    for (int32_t k = e->next_frame; k < r->n_frames && r->time[k] <= time + 1e-6; k++) {
        e->next_frame = k;
        if (fabs(r->time[k] - time) <= 1e-6) {
            return k;
        }
    }
    return -1;
}

static double *new_row(mhi_errors *e) {
    if (e->n_rows == e->capacity) {
        const int32_t capacity = e->capacity == 0 ? 256 : 2 * e->capacity;
        double *grown =
            realloc(e->squares, sizeof(double) * (size_t)capacity * (size_t)e->n_channels);
        if (grown == NULL) {
            return NULL;
        }
        e->squares = grown;
        e->capacity = capacity;
    }
    return e->squares + (ptrdiff_t)e->n_rows++ * e->n_channels;
}

static void compare(const mhi_errors *e, int32_t kind, const double *estimate, const double *truth,
                    double *row) {
    for (int32_t i = 0; i < e->n[kind]; i++) {
        const double d = estimate == NULL ? NAN : estimate[i] - truth[i];
        row[e->offset[kind] + i] = d * d;
    }
}

static int any_nan(const double *values, int32_t n) {
    int found = 0;
    for (int32_t i = 0; i < n; i++) {
        found |= isnan(values[i]);
    }
    return found;
}

mhe_status mhi_errors_add(mhi_errors *e, const mhe_estimate *s, mhe_error *err) {
    const int32_t k = frame_at(e, s->time);
    if (k < 0) {
        return MHE_OK;
    }
    double *row = new_row(e);
    if (row == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const mhi_reference *r = &e->recording->reference;
    const double *q = r->q + (ptrdiff_t)k * e->n_q, *v = r->qdot + (ptrdiff_t)k * e->n_q;
    const double *a = r->activation + (ptrdiff_t)k * e->n_m;
    const double *force = r->force + (ptrdiff_t)k * e->n_m;
    mhe_status status = MHE_OK;
    mhi_muscle_state muscles;
    const int known = !any_nan(q, e->n_q); /* a reference may end before the markers do */
    if (known && any_nan(force, e->n_m) && !any_nan(v, e->n_q) && !any_nan(a, e->n_m)) {
        const mhe_system_point at = {.size = sizeof at, .q = q, .v = v, .a = a};
        status = mhi_system_muscles(e->context, &at, 0, &muscles, err);
        force = muscles.force;
    }
    compare(e, Q, s->q, q, row);
    compare(e, QDOT, s->qdot, v, row);
    compare(e, ACTIVATION, s->activation, a, row);
    compare(e, EXCITATION, s->excitation, r->excitation + (ptrdiff_t)k * e->n_m, row);
    if (status == MHE_OK) {
        compare(e, FORCE, s->force, force, row);
    }
    if (status == MHE_OK && known) {
        status = mhi_system_markers(e->context, q, e->marker, NULL, err);
    }
    for (int32_t i = 0; i < e->n_k && status == MHE_OK; i++) {
        double squares = known ? 0 : NAN;
        for (int32_t axis = 0; axis < 3; axis++) {
            const double d = s->markers[3 * i + axis] - e->marker[3 * i + axis];
            squares += d * d;
        }
        row[e->offset[MARKER] + i] = squares;
    }
    return status;
}

static double mean_rmse(const mhi_errors *e, int32_t kind, int32_t first, int32_t end) {
    double sum = 0;
    int32_t channels = 0;
    for (int32_t i = 0; i < e->n[kind]; i++) {
        double squares = 0;
        int32_t n = 0;
        for (int32_t k = first; k < end; k++) {
            const double square = e->squares[(ptrdiff_t)k * e->n_channels + e->offset[kind] + i];
            squares += isnan(square) ? 0 : square;
            n += !isnan(square);
        }
        sum += n == 0 ? 0 : sqrt(squares / n);
        channels += n > 0;
    }
    return channels == 0 ? NAN : sum / channels;
}

void mhi_errors_rmse(const mhi_errors *e, int32_t skip_first, int32_t skip_last, mhi_rmse *rmse) {
    const int32_t end = e->n_rows - skip_last;
    *rmse = (mhi_rmse){.q = mean_rmse(e, Q, skip_first, end),
                       .qdot = mean_rmse(e, QDOT, skip_first, end),
                       .activation = mean_rmse(e, ACTIVATION, skip_first, end),
                       .excitation = mean_rmse(e, EXCITATION, skip_first, end),
                       .force = mean_rmse(e, FORCE, skip_first, end),
                       .marker = mean_rmse(e, MARKER, skip_first, end)};
}
