/* SPDX-License-Identifier: Apache-2.0 */
/* markers.c: from joint angles to recorded markers. */
#include "noise/parts.h"
#include "plugin/instance.h"

#include <math.h>

/* The description with every marker moved in its segment. */
static mhe_status move_markers(const mhi_noise *noise, const mhe_description *from,
                               mhi_arena *arena, mhe_description *to, mhe_error *err) {
    mhe_marker *markers = MHI_TAKE(arena, mhe_marker, from->n_markers);
    if (markers == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    *to = *from;
    to->markers = markers;
    for (int32_t i = 0; i < from->n_markers; i++) {
        const mhi_stream stream = {(uint64_t)noise->seed, MHI_STREAM_OFFSET, (uint32_t)i};
        markers[i] = from->markers[i];
        for (uint32_t axis = 0; axis < 3; axis++) {
            markers[i].location[axis] += noise->markers.sd * mhi_random_normal(&stream, axis);
        }
    }
    return MHE_OK;
}

/* q at a moment: cubic Hermite where the reference has velocities. */
static void posture(const mhi_recording *r, int32_t n_q, mhi_moment at, double *q) {
    const double *q0 = r->reference.q + (ptrdiff_t)at.row * n_q;
    const double *v0 = r->reference.qdot + (ptrdiff_t)at.row * n_q;
    const double s = at.fraction, h = at.step;
    for (int32_t i = 0; i < n_q; i++) {
        q[i] = q0[i];
        if (s > 0) {
            const double way = q0[i + n_q] - q0[i];
            const double bend = (1 - s) * (h * v0[i] - way) - s * (h * v0[i + n_q] - way);
            q[i] += s * way + (isnan(bend) ? 0 : s * (1 - s) * bend);
        }
    }
}

static mhe_status follow(const mhi_noise *noise, const mhi_recording *r, const mhe_model_ops *model,
                         void *context, int32_t n_q, mhi_record *out, mhi_arena *arena,
                         mhe_error *err) {
    double *q = MHI_TAKE(arena, double, n_q), *v = MHI_TAKE(arena, double, n_q);
    if (q == NULL || v == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k < out->n_samples && status == MHE_OK; k++) {
        posture(r, n_q, mhi_clock_moment(&noise->markers.clock, r, out->time[k]), q);
        const mhe_kinematics wanted = {.size = sizeof wanted,
                                       .marker = out->values + (ptrdiff_t)k * out->n_channels};
        status = model->kinematics(context, q, v, &wanted, err);
    }
    return status > 0 ? mhe_fail(err, MHE_E_NUMERIC, "the reference's posture has no markers")
                      : status;
}

static mhe_status see_model(const mhi_noise *noise, const mhi_recording *r,
                            const mhe_description *moved, const mhe_plugin *model,
                            const void *model_config, const mhe_host *host, mhi_record *out,
                            mhi_arena *arena, mhe_error *err) {
    const mhe_model_ops *ops = model->ops;
    void *self = NULL, *context = NULL;
    mhe_status status = mhi_model_create(model, host, moved, model_config, &self, err);
    if (status != MHE_OK) {
        return status;
    }
    status = ops->context_create(self, &context, err);
    if (status == MHE_OK) {
        status = follow(noise, r, ops, context, moved->n_coordinates, out, arena, err);
        ops->context_destroy(context);
    }
    ops->destroy(self);
    return status;
}

static void add_white(const mhi_noise *noise, int32_t marker, mhi_record *out) {
    const mhi_stream stream = {(uint64_t)noise->seed, MHI_STREAM_WHITE, (uint32_t)marker};
    for (int32_t k = 0; k < out->n_samples; k++) {
        double *p = out->values + (ptrdiff_t)k * out->n_channels + 3 * marker;
        for (int32_t axis = 0; axis < 3; axis++) {
            p[axis] += noise->markers.white_sd *
                       mhi_random_normal(&stream, 3 * (uint64_t)k + (uint64_t)axis);
        }
    }
}

static void add_drift(const mhi_noise *noise, int32_t marker, mhi_record *out) {
    const mhi_stream stream = {(uint64_t)noise->seed, MHI_STREAM_DRIFT, (uint32_t)marker};
    const double sd = noise->markers.drift_sd;
    double drift[3] = {0};
    for (int32_t k = 0; k < out->n_samples; k++) {
        const double dt = k > 0 ? out->time[k] - out->time[k - 1] : INFINITY; /* d_0 is free */
        const double keep = exp(-dt / noise->markers.drift_time);
        const double fresh = sd * sqrt(-expm1(-2 * dt / noise->markers.drift_time));
        double *p = out->values + (ptrdiff_t)k * out->n_channels + 3 * marker;
        for (int32_t axis = 0; axis < 3; axis++) {
            drift[axis] = keep * drift[axis] +
                          fresh * mhi_random_normal(&stream, 3 * (uint64_t)k + (uint64_t)axis);
            p[axis] += drift[axis];
        }
    }
}

/* NULL-safe list of names; `segments` adds ground behind the bodies. */
static mhe_status list_names(const mhe_description *d, const char ***markers,
                             const char ***segments, mhi_arena *arena, mhe_error *err) {
    *markers = MHI_TAKE(arena, const char *, d->n_markers);
    *segments = MHI_TAKE(arena, const char *, d->n_bodies + 1);
    if (*markers == NULL || *segments == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < d->n_markers; i++) {
        (*markers)[i] = d->markers[i].name;
    }
    for (int32_t i = 0; i < d->n_bodies; i++) {
        (*segments)[i] = d->bodies[i].name;
    }
    (*segments)[d->n_bodies] = "ground";
    return MHE_OK;
}

/* Spans of single markers; spans of segments become those of their markers. */
static mhe_status hide(const mhi_noise *noise, const mhe_description *d, mhi_arena *arena,
                       mhi_record *out, mhe_error *err) {
    const mhi_marker_noise *m = &noise->markers;
    const char **markers = NULL, **segments = NULL;
    mhi_span *gaps = NULL, *segment_gaps = NULL;
    int32_t n = 0, n_segment = 0;
    mhe_status status = list_names(d, &markers, &segments, arena, err);
    if (status == MHE_OK) {
        const mhi_subjects subjects = {"marker", markers, d->n_markers};
        const mhi_map_place place = {noise->tree, m->node, "gaps"};
        status = mhi_spans_read(&m->gaps, &place, &subjects, arena, &gaps, &n, err);
    }
    if (status == MHE_OK) {
        const mhi_subjects subjects = {"segment", segments, d->n_bodies + 1};
        const mhi_map_place place = {noise->tree, m->node, "segment_gaps"};
        status = mhi_spans_read(&m->segment_gaps, &place, &subjects, arena, &segment_gaps,
                                &n_segment, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    mhi_spans_apply(gaps, n, 3, NAN, out);
    for (int32_t i = 0; i < d->n_markers; i++) {
        const int32_t body = d->markers[i].body >= 0 ? d->markers[i].body : d->n_bodies;
        for (int32_t s = 0; s < n_segment; s++) {
            if (segment_gaps[s].subject == body) {
                const mhi_span of_marker = {i, segment_gaps[s].begin, segment_gaps[s].end};
                mhi_spans_apply(&of_marker, 1, 3, NAN, out);
            }
        }
    }
    return MHE_OK;
}

static mhe_status check_reference(const mhi_recording *r, const mhe_description *d,
                                  mhe_error *err) {
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->n_frames * d->n_coordinates; i++) {
        if (!isfinite(r->reference.q[i])) {
            return mhe_fail(err, MHE_E_INPUT, "the reference has no value of '%s' at %g s",
                            d->coordinates[i % d->n_coordinates].name,
                            r->time[i / d->n_coordinates]);
        }
    }
    return MHE_OK;
}

mhe_status mhi_noise_markers(const mhi_noise *noise, const mhi_recording *reference,
                             const mhe_description *d, const mhe_plugin *model,
                             const void *model_config, const mhe_host *host, mhi_record *out,
                             mhe_error *err) {
    mhi_arena arena = {0};
    mhe_description moved;
    *out = (mhi_record){0};
    mhe_status status = check_reference(reference, d, err);
    if (status == MHE_OK) {
        status = mhi_record_open(out, &noise->markers.clock, reference, 3 * d->n_markers,
                                 "noise.markers", err);
    }
    if (status == MHE_OK) {
        status = move_markers(noise, d, &arena, &moved, err);
    }
    if (status == MHE_OK) {
        status = see_model(noise, reference, &moved, model, model_config, host, out, &arena, err);
    }
    for (int32_t i = 0; i < d->n_markers && status == MHE_OK; i++) {
        if (noise->markers.white_sd > 0) {
            add_white(noise, i, out);
        }
        if (noise->markers.drift_sd > 0) {
            add_drift(noise, i, out);
        }
    }
    if (status == MHE_OK) {
        status = hide(noise, d, &arena, out, err);
    }
    if (status != MHE_OK) {
        mhi_record_free(out);
    }
    mhi_arena_free(&arena);
    return status;
}
