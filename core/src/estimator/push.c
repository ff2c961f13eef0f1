/* SPDX-License-Identifier: Apache-2.0 */
/* push.c: frames in, estimates out. */
#include "estimator/estimator_private.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

double mhi_now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* The EMG that a node at this frame tracks: that of `delay` frames ago, before that the first. */
static const double *delayed_emg(mhe_estimator *e, const double *emg) {
    const int32_t slots = e->delay + 1;
    const int32_t put = (int32_t)(e->n_frames % slots), get = (int32_t)((e->n_frames + 1) % slots);
    for (int32_t slot = 0; slot < slots; slot++) {
        if (slot == put || e->n_frames == 0) {
            memcpy(e->delay_line + slot * e->n_m, emg, sizeof(double) * (size_t)e->n_m);
        }
    }
    return e->delay_line + get * e->n_m;
}

/* Callers compiled before there were angles have a shorter frame. */
static const double *measured_angles(const mhe_estimator *e, const mhe_frame *frame) {
    const int known = frame->size >= offsetof(mhe_frame, angles) + sizeof frame->angles;
    return known && frame->angles != NULL ? frame->angles : e->no_angles;
}

/* Everything that is told about a node; the last one has the controls that lead to it. */
static mhe_status give_estimate(mhe_estimator *e, int32_t k, mhe_estimate *out, mhe_error *err) {
    const int32_t controls = k < e->n ? k : e->n - 1;
    const double *x = mhi_row(e->solution.x, k, e->n_x);
    const double *u = mhi_row(e->solution.u, controls, e->n_u);
    const int driven = e->n_x > 2 * e->n_q;
    const double *a = driven ? x + 2 * e->n_q : u;
    const size_t n_q = sizeof(double) * (size_t)e->n_q, n_m = sizeof(double) * (size_t)e->n_m;
    memcpy(e->out_q, x, n_q);
    memcpy(e->out_v, x + e->n_q, n_q);
    memcpy(e->out_activation, a, n_m);
    memcpy(e->out_excitation, u, n_m);
    memcpy(e->out_residual, u + e->n_m, sizeof(double) * (size_t)e->n_r);
    mhi_muscle_state muscles;
    mhi_system_context *context = mhi_ocp_context(e->ocp);
    mhe_status status = mhi_system_muscles(context, x, x + e->n_q, a, 0, &muscles, err);
    if (status == MHE_OK) {
        memcpy(e->out_force, muscles.force, n_m);
        memcpy(e->out_moment, muscles.moment, n_q);
        status = mhi_system_markers(context, x, e->out_marker, NULL, err);
    }
    out->time = e->times[k];
    out->marker_rms =
        mhi_rms_distance(e->out_marker, mhi_row(e->markers, k, 3 * e->n_k), 3 * e->n_k, 3);
    out->emg_rms = mhi_rms_distance(u, mhi_row(e->emg, controls, e->n_m), e->n_m, 1);
    out->q = e->out_q;
    out->qdot = e->out_v;
    out->activation = e->out_activation;
    out->excitation = driven ? e->out_excitation : NULL;
    out->force = e->out_force;
    out->moment = e->out_moment;
    out->residual = e->out_residual;
    out->markers = e->out_marker;
    return status;
}

mhe_status mhi_estimator_node(mhe_estimator *e, int32_t k, mhe_estimate *estimate, mhe_error *err) {
    *estimate = (mhe_estimate){.size = sizeof *estimate};
    return give_estimate(e, k - 1, estimate, err); /* the window has moved on since */
}

mhe_status mhe_estimator_prepare(mhe_estimator *e, mhe_error *err) {
    if (!e->begun || e->prepared || e->filled < e->n) {
        return MHE_OK;
    }
    const double begin = mhi_now();
    mhe_status status = MHE_OK;
    mhi_window_follow(e);
    if (e->solver->prepare != NULL && e->settled) {
        status = e->solver->prepare(e->solver_self, &e->solution, err);
    }
    e->ahead += mhi_now() - begin;
    return status;
}

/* From a posture that is known or measured, or where none ever is from the EMG alone: a window
 * whose markers are still hidden would wander anywhere, and take long for it. */
static int32_t can_begin(const mhe_estimator *e) {
    int32_t known = !e->has_posture;
    for (int32_t i = 0; i < e->n_q && !known; i++) {
        known = !isnan(e->start_q[i]) || !isnan(e->angles[i]);
    }
    for (int32_t i = 0; i < 3 * e->n_k && !known; i++) {
        known = !isnan(e->markers[i]);
    }
    return known;
}

/* The first window from its measurements, once there is a posture in its oldest frame. */
static mhe_status begin_window(mhe_estimator *e, int32_t *known, mhe_error *err) {
    mhe_status status = e->interval > 0 ? MHE_OK : mhi_clock_measure(e, known, err);
    if (status != MHE_OK || !*known) {
        return status;
    }
    if (!can_begin(e)) {
        e->waited++;
        *known = 0;
        mhi_window_advance(e);
        return MHE_OK;
    }
    if (e->waited > 0) {
        char line[160];
        (void)snprintf(line, sizeof line,
                       "no posture was measured in the %d frames before %.6g s: estimates begin "
                       "there",
                       (int)e->waited, e->times[0]);
        e->host->log(e->host, MHE_LOG_WARNING, line);
        e->waited = 0;
    }
    return mhi_window_begin(e, err);
}

/* Start and targets of the full window. `*known`: it can be solved. */
static mhe_status start_window(mhe_estimator *e, int32_t *known, mhe_error *err) {
    mhe_status status = MHE_OK;
    *known = 1;
    if (e->begun) {
        mhi_window_follow(e);
        mhi_recover_screen(e);
        if (mhi_recover_is_lost(e)) {
            (void)mhi_window_begin(e, NULL); /* where it cannot, the old start goes on */
        }
    } else {
        status = begin_window(e, known, err);
    }
    if (status == MHE_OK && *known) {
        mhi_window_set_targets(e);
    }
    return status;
}

mhe_status mhe_estimator_push(mhe_estimator *e, const mhe_frame *frame, mhe_estimate *estimate,
                              int32_t *ready, mhe_error *err) {
    int32_t used = 0, known = 0;
    *ready = 0;
    e->arrival = mhi_now();
    mhe_status status = mhi_clock_take(e, frame->time, &used, err);
    if (status != MHE_OK) {
        return status;
    }
    const double *emg = delayed_emg(e, frame->emg == NULL ? e->no_emg : frame->emg);
    e->n_frames++;
    e->has_posture |= frame->markers != NULL || measured_angles(e, frame) != e->no_angles;
    mhi_recover_count_emg(e, emg);
    if (!used) {
        return MHE_OK;
    }
    mhi_window_append(e, frame->time, frame->markers == NULL ? e->no_markers : frame->markers, emg,
                      measured_angles(e, frame));
    mhi_recover_drop_emg(e);
    if (e->filled <= e->n) {
        return MHE_OK;
    }
    mhe_solve_info info = {.size = sizeof info};
    *estimate = (mhe_estimate){.size = sizeof *estimate};
    status = start_window(e, &known, err);
    if (status == MHE_OK && !known) {
        return MHE_OK;
    }
    if (status == MHE_OK) {
        status = mhi_window_solve(e, &info, &estimate->status, err);
    }
    if (status == MHE_OK) {
        mhi_recover_solved(e, estimate->status);
        status = give_estimate(e, e->node, estimate, err);
        estimate->latency = mhi_now() - e->arrival;
        estimate->solve_time = estimate->latency + e->ahead;
    }
    e->ahead = 0;
    mhi_window_advance(e); /* in any case: the next frame needs its place */
    if (status != MHE_OK) {
        return status;
    }
    estimate->iterations = info.iterations;
    estimate->kkt_residual = info.kkt_residual;
    estimate->evaluation_time = info.evaluation_time;
    *ready = 1;
    return MHE_OK;
}
