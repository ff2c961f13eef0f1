/* SPDX-License-Identifier: Apache-2.0 */
/* push.c: frames in, estimates out. */
#include "base/clock.h"
#include "base/need.h"
#include "estimator/estimator_private.h"

#include <stdio.h>

mhe_status mhi_estimator_node(mhe_estimator *e, int32_t k, mhe_estimate *estimate, mhe_error *err) {
    *estimate = (mhe_estimate){.size = sizeof *estimate};
    return mhi_output_give(e, k - 1, estimate, err); /* the window has moved on since */
}

mhe_status mhe_estimator_prepare(mhe_estimator *e, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"estimator", e});
    if (status != MHE_OK || !mhi_phase_begun(e) || e->window.prepared ||
        e->window.filled < e->window.n) {
        return status;
    }
    const double begin = mhi_seconds();
    mhi_pace_prepare(e);
    mhi_window_follow(e);
    if (e->solver->prepare != NULL && (mhi_phase_settled(e) || e->begin.by_steps)) {
        status = e->solver->prepare(e->solver_self, &e->window.solution, err);
    }
    mhi_pace_prepared(e, mhi_seconds() - begin);
    return status;
}

/* The grid of nodes, where it is not known: from the times of a full window. `*known` 0: there is a
 * gap, and what lies before it is dropped. */
static mhe_status find_interval(mhe_estimator *e, int32_t *known, mhe_error *err) {
    int32_t gap = 0;
    if (e->clock.interval > 0) {
        return MHE_OK;
    }
    const mhe_status status = mhi_frame_clock_measure(&e->clock, e->window.times, &gap, err);
    for (int32_t k = 0; k < gap; k++) {
        mhi_window_advance(e);
    }
    *known = status == MHE_OK && gap == 0;
    if (*known) {
        mhi_ocp_set_interval(e->ocp, e->clock.interval);
        mhi_channels_set_interval(&e->channels, e->clock.interval, e->clock.ratio);
    }
    return status;
}

static void look_for_late(mhe_estimator *e) {
    mhi_channels_look(&e->channels, e->window.times, e->window.filled, mhi_phase_begun(e),
                      mhi_trust_late, e);
}

/* The first window from its measurements, once there is a posture in its oldest frame. */
static mhe_status begin_window(mhe_estimator *e, int32_t *known, mhe_error *err) {
    mhe_status status = find_interval(e, known, err);
    if (status != MHE_OK || !*known) {
        return status;
    }
    look_for_late(e);
    if (!mhi_begin_can(e)) {
        e->begin.waited++;
        *known = 0;
        mhi_window_advance(e);
        return MHE_OK;
    }
    if (e->begin.waited > 0) {
        char line[160];
        (void)snprintf(line, sizeof line,
                       "no posture was measured in the %d frames before %.6g s: estimates begin "
                       "there",
                       (int)e->begin.waited, e->window.times[0]);
        e->host->log(e->host, MHE_LOG_WARNING, line);
        e->begin.waited = 0;
    }
    return mhi_window_begin(e, err);
}

#define MOST_STUCK 3 /* frames: one to find out, those after it have their step prepared */

/* Start and targets of the full window. `*known`: it can be solved. */
static mhe_status start_window(mhe_estimator *e, int32_t *known, mhe_error *err) {
    mhe_status status = MHE_OK;
    *known = 1;
    if (mhi_phase_begun(e)) {
        mhi_window_follow(e);
        look_for_late(e);
        mhi_trust_screen(e);
        /* Where no step was made from the old guess, today's measurements are nearer. */
        if (mhi_pace_wakes(e) ||
            (!e->pace.rests && (mhi_trust_is_lost(e) || e->begin.stuck >= MOST_STUCK))) {
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

/* The frame's place: nodes that no frame came for are put in before it. */
static mhe_status find_node(mhe_estimator *e, double time, int32_t *used, mhe_error *err) {
    mhi_tick tick;
    const mhe_status status = mhi_frame_clock_take(&e->clock, time, &tick, err);
    if (status != MHE_OK) {
        return status;
    }
    if (tick.emptied) {
        mhi_window_clear(e);
    }
    for (int32_t i = 0; i < e->channels.n && tick.set_back; i++) {
        mhi_samples_clear(&e->channels.rows[i].samples);
    }
    for (int32_t i = 1; i <= tick.missing; i++) {
        mhi_window_skip(e, tick.before + i * e->clock.interval);
    }
    *used = tick.used;
    return MHE_OK;
}

/* The posture that the newest node's markers and angles say, and their velocities. The posture is
 * looked for near the last one, at first near what the model stands at. */
static void take_rates(mhe_estimator *e, int32_t k) {
    const mhi_channel *markers = mhi_channels_find(&e->channels, MHI_SIGNAL_MARKERS);
    const mhi_channel *angles = mhi_channels_find(&e->channels, MHI_SIGNAL_Q);
    mhi_channel *rates = mhi_channels_find(&e->channels, MHI_SIGNAL_QDOT);
    if (e->rates.start == NULL) {
        return;
    }
    double *near = e->begin.near;
    for (int32_t i = 0; i < e->n_q; i++) {
        near[i] = e->window.solved > 0    ? e->output.q[i]
                  : !isnan(e->begin.q[i]) ? e->begin.q[i]
                                          : e->description->coordinates[i].value;
    }
    mhi_pace_postures(e, 1);
    mhi_rates_take(&e->rates, k, e->window.times, mhi_row(markers->believed, k, 3 * e->n_k),
                   angles == NULL ? NULL : mhi_row(angles->believed, k, e->n_q), near,
                   e->trust.outlier, rates);
    mhi_pace_postures(e, 0);
}

/* A frame's measurements, to the newest node where the frame is one. */
static void take_frame(mhe_estimator *e, const mhe_frame *frame, int32_t used) {
    const mhi_channels *channels = &e->channels;
    for (int32_t i = 0; i < channels->n; i++) {
        mhi_channel *c = &channels->rows[i];
        const double *values = mhi_channels_of_frame(channels, i, frame);
        e->begin.has_posture |= c->posture && values != c->absent;
        c->counts.n_with_frames += mhi_channel_any(values, c->face.width);
        e->given[i] = mhi_channel_delayed(channels, i, values);
        mhi_trust_count(&e->trust, c, e->given[i]);
    }
    e->channels.n_frames++;
    if (!used && e->window.filled == 0) {
        return;
    }
    if (used) {
        mhi_window_append(e, frame->time, e->given);
    }
    for (int32_t i = 0; i < channels->n && !used; i++) {
        mhi_channel_add(&channels->rows[i], e->window.filled - 1, e->given[i]);
    }
    for (int32_t i = 0; i < channels->n; i++) {
        mhi_trust_drop(&e->trust, &channels->rows[i], e->window.filled - 1);
    }
    if (used) {
        take_rates(e, e->window.filled - 1);
    }
}

/* How far the markers stay from the model: what costs may take for their noise. */
static void learn_misfit(mhe_estimator *e, int32_t status) {
    for (int32_t i = 0; i < e->channels.n && status == MHE_FRAME_OK; i++) {
        mhi_channel *c = &e->channels.rows[i];
        if (c->signal == MHI_SIGNAL_MARKERS && c->read) {
            mhi_channel_compare(c, e->output.rows[i].estimated, e->output.rows[i].target);
        }
    }
}

/* The full window's estimate. `*ready` 0: it cannot be solved yet. */
static mhe_status solve_window(mhe_estimator *e, mhe_estimate *estimate, int32_t *ready,
                               mhe_error *err) {
    mhe_solve_info info = {.size = sizeof info};
    mhe_status status = start_window(e, ready, err);
    if (status == MHE_OK && !*ready) {
        return MHE_OK;
    }
    if (status == MHE_OK) {
        status = mhi_window_solve(e, &info, &estimate->status, err);
        mhi_pace_solved(e);
    }
    if (status == MHE_OK) {
        mhi_trust_solved(e, estimate->status);
        status = mhi_output_give(e, e->node, estimate, err);
        if (status == MHE_OK) {
            mhi_bands_give(e, e->node, estimate);
            learn_misfit(e, estimate->status);
        }
        estimate->latency = mhi_seconds() - e->pace.arrival;
        estimate->solve_time = estimate->latency + e->pace.ahead;
        estimate->iterations = info.iterations;
        estimate->programs = info.programs;
        estimate->fallbacks = info.fallbacks;
        estimate->kkt_residual = info.kkt_residual;
        estimate->evaluation_time = info.evaluation_time;
    }
    mhi_pace_end(e, estimate->status);
    mhi_window_advance(e); /* in any case: the next frame needs its place */
    *ready = status == MHE_OK;
    return status;
}

mhe_status mhe_estimator_push(mhe_estimator *e, const mhe_frame *frame, mhe_estimate *estimate,
                              int32_t *ready, mhe_error *err) {
    int32_t used = 0;
    mhe_frame ours;
    mhe_estimate made = {.size = sizeof made};
    mhe_status status =
        MHI_NEED(err, {"estimator", e}, {"frame", frame}, {"estimate", estimate}, {"ready", ready});
    if (status == MHE_OK) {
        *ready = 0;
        status = mhi_take(__func__, &ours, sizeof ours, frame, err);
    }
    if (status == MHE_OK && estimate->size < sizeof estimate->size) {
        status =
            mhe_fail(err, MHE_E_ARGUMENT, "mhe_estimator_push: the estimate's size is not set");
    }
    if (status != MHE_OK) {
        return status;
    }
    e->pace.arrival = mhi_seconds();
    mhi_pace_begin(e);
    status = find_node(e, ours.time, &used, err);
    if (status != MHE_OK) {
        return status;
    }
    if (ours.emg == NULL && e->feed.electrodes != NULL) {
        ours.emg = mhi_feed_of_frame(&e->feed, ours.time);
    }
    take_frame(e, &ours, used);
    if (!used || e->window.filled <= e->window.n) {
        return MHE_OK;
    }
    status = mhi_feed_before_solve(e, err);
    if (status != MHE_OK) {
        return status;
    }
    status = solve_window(e, &made, ready, err);
    return *ready ? mhi_give(__func__, estimate, &made, err) : status;
}
