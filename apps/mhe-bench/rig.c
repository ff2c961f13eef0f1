/* SPDX-License-Identifier: Apache-2.0 */
#include "rig.h"

#include "measure.h"

#include <string.h>

static void start(const rig *r, mhe_estimator *estimator) {
    if (r->recording->reference.present) {
        mhi_estimator_set_start(estimator, r->recording->reference.q, r->recording->reference.qdot);
    }
}

/* The estimate's node as a point of the problem. */
static void keep_point(rig *r, const mhe_system *face, const mhe_estimate *e) {
    if (r->n_points == RIG_POINTS_MAX) {
        return;
    }
    const size_t n_q = sizeof(double) * (size_t)face->n_q;
    double *x = r->x + (ptrdiff_t)r->n_points * face->n_x;
    double *u = r->u + (ptrdiff_t)r->n_points * face->n_u;
    memcpy(x, e->q, n_q);
    memcpy(x + face->n_q, e->qdot, n_q);
    memcpy(u, e->controls, sizeof(double) * (size_t)face->n_u);
    if (mhi_system_equilibrium(mhi_ocp_context(mhi_estimator_ocp(r->estimator)), x, x + face->n_q,
                               e->activation, x, NULL) != MHE_OK) {
        return;
    }
    r->n_points++;
}

static mhe_status take(rig *r, mhi_errors *errors, const mhe_estimate *e, mhe_error *err) {
    r->n_estimates++;
    r->n_converged += e->status == MHE_FRAME_OK;
    r->iterations_sum += e->iterations;
    r->iterations_max = e->iterations > r->iterations_max ? e->iterations : r->iterations_max;
    keep_point(r, mhi_system_face(mhi_estimator_system(r->estimator)), e);
    return errors == NULL ? MHE_OK : mhi_errors_add(errors, e, err);
}

static mhe_status first_run(rig *r, mhe_error *err) {
    mhi_errors *errors = NULL;
    mhe_status status = MHE_OK;
    if (r->recording->reference.present) {
        status = mhi_errors_create(mhi_estimator_system(r->estimator), r->recording, &errors, err);
    }
    start(r, r->estimator);
    for (int32_t k = 0; k < r->n_frames && status == MHE_OK; k++) {
        const mhe_frame frame =
            mhi_recording_frame(r->recording, r->info.n_markers, r->info.n_muscles, k);
        mhe_estimate estimate = {.size = sizeof estimate};
        int32_t ready = 0;
        status = mhe_estimator_push(r->estimator, &frame, &estimate, &ready, err);
        if (status == MHE_OK && ready) {
            status = take(r, errors, &estimate, err);
        }
    }
    const mhi_output_section *output = &r->variant->run->output;
    r->has_rmse = status == MHE_OK && errors != NULL;
    if (r->has_rmse) {
        mhi_errors_rmse(errors, output->skip_first, output->skip_last, &r->rmse);
    }
    mhi_errors_free(errors);
    if (status == MHE_OK && r->n_estimates == 0) {
        return mhe_fail(err, MHE_E_INPUT, "%s: %d frames are too few for a window of %d intervals",
                        r->variant->name, r->n_frames, r->info.window);
    }
    return status;
}

mhe_status rig_create(const variant *v, int32_t estimates, const mhe_host *loud,
                      const mhe_host *silent, rig *r, mhe_error *err) {
    *r = (rig){.variant = v, .host = silent};
    mhe_status status = mhi_estimator_create(v->run, loud, &r->estimator, err);
    if (status != MHE_OK) {
        return status;
    }
    const mhi_system *system = mhi_estimator_system(r->estimator);
    r->info.size = sizeof r->info;
    mhe_estimator_describe(r->estimator, &r->info);
    status = mhi_recording_read(v->run, mhi_system_description(system), loud, &r->recording, err);
    if (status == MHE_OK && r->recording->n_frames > 0) {
        const double *time = r->recording->time;
        status =
            mhe_estimator_covers(r->estimator, time[0], time[r->recording->n_frames - 1], 0, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    const int64_t wanted = ((int64_t)r->info.window + estimates) * r->info.ratio;
    const int cut = estimates > 0 && wanted < r->recording->n_frames;
    r->n_frames = cut ? (int32_t)wanted : r->recording->n_frames;
    r->n_estimates_max = r->n_frames / r->info.ratio + 1;
    r->x = MHI_TAKE(&r->arena, double, RIG_POINTS_MAX *mhi_system_face(system)->n_x);
    r->u = MHI_TAKE(&r->arena, double, RIG_POINTS_MAX *mhi_system_face(system)->n_u);
    if (r->x == NULL || r->u == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    return first_run(r, err);
}

void rig_free(rig *r) {
    mhi_recording_free(r->recording);
    mhe_estimator_close(r->estimator);
    mhi_arena_free(&r->arena);
}

/* Pushes a frame and prepares the next; *prepare: s of preparation since the last estimate. */
static mhe_status run_frame(mhe_estimator *estimator, const mhe_frame *frame, double *const *parts,
                            double *prepare, int32_t *n, mhe_error *err) {
    mhe_estimate estimate = {.size = sizeof estimate};
    int32_t ready = 0;
    const double begin = measure_seconds();
    mhe_status status = mhe_estimator_push(estimator, frame, &estimate, &ready, err);
    const double pushed = measure_seconds();
    if (status != MHE_OK) {
        return status;
    }
    if (ready) {
        parts[PART_FRAME][*n] = *prepare + (pushed - begin);
        parts[PART_PREPARE][*n] = *prepare;
        parts[PART_FEEDBACK][*n] = pushed - begin;
        parts[PART_EVALUATION][*n] = estimate.evaluation_time;
        parts[PART_REST][*n] = pushed - begin - estimate.evaluation_time;
        *n += 1;
        *prepare = 0;
    }
    status = mhe_estimator_prepare(estimator, err);
    *prepare += measure_seconds() - pushed;
    return status;
}

mhe_status rig_run(const rig *r, double *const *parts, int32_t *n, mhe_error *err) {
    mhe_estimator *estimator = NULL;
    double prepare = 0;
    *n = 0;
    mhe_status status = mhi_estimator_create(r->variant->run, r->host, &estimator, err);
    if (status != MHE_OK) {
        return status;
    }
    start(r, estimator);
    for (int32_t k = 0; k < r->n_frames && status == MHE_OK; k++) {
        const mhe_frame frame =
            mhi_recording_frame(r->recording, r->info.n_markers, r->info.n_muscles, k);
        status = run_frame(estimator, &frame, parts, &prepare, n, err);
    }
    mhe_estimator_close(estimator);
    return status;
}
