/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/rates.h"

#include <math.h>
#include <string.h>

mhe_status mhi_rates_create(mhi_rates *r, const mhi_run *run, const mhi_system *system,
                            mhi_system_context *context, const mhi_tasks *tasks, int32_t nodes,
                            mhi_arena *arena, mhe_error *err) {
    const int32_t n_q = mhi_system_face(system)->n_q;
    const int32_t n_k = mhi_system_description(system)->n_markers;
    *r = (mhi_rates){.n_q = n_q, .nodes = nodes, .nearest = INFINITY};
    if (!run->data.rates && run->data.marker_offset == 0) {
        return MHE_OK;
    }
    const mhi_room rooms[] = {
        {&r->q, (ptrdiff_t)nodes * n_q}, {&r->found, n_q}, {&r->v, n_q}, {&r->corrected, 3 * n_k}};
    mhe_status status = MHI_TAKE_ROOMS(arena, rooms, err);
    if (status == MHE_OK) {
        status = mhi_offsets_create(&r->offsets, run->data.marker_offset, system, context, tasks,
                                    nodes, arena, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    mhi_rates_clear(r);
    status = mhi_start_create(system, context, &r->start, err);
    if (status == MHE_OK) {
        mhi_start_set_tasks(r->start, tasks);
        mhi_start_set_enough(r->start, 1e-6);
    }
    return status;
}

void mhi_rates_free(mhi_rates *r) {
    mhi_start_free(r->start);
}

static double *posture(mhi_rates *r, int32_t k) {
    return r->q + (ptrdiff_t)k * r->n_q;
}

static void forget(mhi_rates *r, int32_t k) {
    for (int32_t i = 0; i < r->n_q; i++) {
        posture(r, k)[i] = NAN;
    }
    mhi_offsets_forget(&r->offsets, k);
}

void mhi_rates_clear(mhi_rates *r) {
    for (int32_t k = 0; k < r->nodes && r->q != NULL; k++) {
        forget(r, k);
    }
}

void mhi_rates_shift(mhi_rates *r) {
    if (r->q != NULL) {
        memmove(r->q, posture(r, 1), sizeof(double) * (size_t)((r->nodes - 1) * r->n_q));
        mhi_offsets_shift(&r->offsets);
        forget(r, r->nodes - 1);
    }
}

double mhi_rates_misfit(const mhi_rates *r) {
    return r->n_seen > 0 ? sqrt(r->squares / r->n_seen) : NAN;
}

static int32_t any(const mhi_rates *r, const double *values) {
    int32_t found = 0;
    for (int32_t i = 0; i < r->n_q && !found; i++) {
        found = !isnan(values[i]);
    }
    return found;
}

/* Slope from node `a` to node `b` -> v; NaN where one of them is not known. */
static void slope(mhi_rates *r, int32_t a, int32_t b, const double *times) {
    const double span = times[b] - times[a];
    for (int32_t i = 0; i < r->n_q; i++) {
        r->v[i] = (posture(r, b)[i] - posture(r, a)[i]) / span;
    }
}

static void put(mhi_rates *r, mhi_channel *c, int32_t k) {
    if (c != NULL && any(r, r->v)) {
        mhi_channel_set(c, k, r->v);
    }
}

/* Where to look for the posture of node k: straight on from the two before. */
static void expect(mhi_rates *r, int32_t k, const double *times, const double *near) {
    memcpy(r->found, near, sizeof(double) * (size_t)r->n_q);
    for (int32_t i = 0; i < r->n_q && k > 0; i++) {
        const double last = posture(r, k - 1)[i];
        const double move =
            k > 1 ? (last - posture(r, k - 2)[i]) / (times[k - 1] - times[k - 2]) : NAN;
        const double on = last + (times[k] - times[k - 1]) * move;
        r->found[i] = !isnan(on) ? on : !isnan(last) ? last : near[i];
    }
}

/* The posture by inverse kinematics, if one comes near, from where it is expected. */
static void find_posture(mhi_rates *r, int32_t k, const double *markers, double outlier) {
    double distance = NAN;
    const mhe_status status = (isfinite(r->nearest) ? mhi_start_posture : mhi_start_search)(
        r->start, markers, r->found, &distance, NULL);
    /* a frame that no posture comes near, where others fit, was not measured well */
    if (status == MHE_OK && !isnan(distance) && !(outlier > 0 && distance > r->nearest + outlier)) {
        r->nearest = fmin(r->nearest, distance);
        r->squares += distance * distance / 3; /* the distance is that of a point */
        r->n_seen++;
        memcpy(posture(r, k), r->found, sizeof(double) * (size_t)r->n_q);
    }
}

/* The same, by markers without what is known of their offsets, of which it tells more. */
static void take_posture(mhi_rates *r, int32_t k, const double *times, const double *markers,
                         const double *near, double outlier) {
    expect(r, k, times, near);
    if (r->offsets.sd == 0) {
        find_posture(r, k, markers, outlier);
        return;
    }
    mhi_offsets_turn(&r->offsets, k, r->found);
    mhi_offsets_correct(&r->offsets, k, markers, r->corrected);
    find_posture(r, k, r->corrected, outlier);
    if (any(r, posture(r, k))) {
        mhi_offsets_learn(&r->offsets, k, markers, r->q);
    }
}

void mhi_rates_take(mhi_rates *r, int32_t k, const double *times, const double *markers,
                    const double *angles, const double *near, double outlier, mhi_channel *c) {
    if (r->start == NULL) {
        return;
    }
    forget(r, k);
    take_posture(r, k, times, markers, near, outlier);
    for (int32_t i = 0; i < r->n_q && angles != NULL; i++) {
        if (!isnan(angles[i])) {
            posture(r, k)[i] = angles[i];
            mhi_offsets_hold(&r->offsets, k, i);
        }
    }
    if (k > 0) {
        slope(r, k - 1, k, times);
        put(r, c, k);
    }
    if (k > 1) {
        slope(r, k - 2, k, times);
        put(r, c, k - 1);
    }
}
