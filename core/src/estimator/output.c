/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/estimator_private.h"

#include <string.h>

mhe_status mhi_output_create(mhi_output *o, const mhe_system *system, int32_t n_k, int32_t n_joints,
                             const mhi_channels *channels, mhi_arena *arena, mhe_error *err) {
    const int32_t n_q = system->n_q, n_m = system->n_m;
    const mhi_room rooms[] = {{&o->x, system->n_x},
                              {&o->u, system->n_u},
                              {&o->held, system->n_u},
                              {&o->q, n_q},
                              {&o->v, n_q},
                              {&o->activation, n_m},
                              {&o->excitation, n_m},
                              {&o->force, n_m},
                              {&o->moment, n_q},
                              {&o->reaction, 6 * n_joints},
                              {&o->input, system->n_w},
                              {&o->residual, n_q},
                              {&o->marker, 3 * n_k}};
    if (MHI_TAKE_ROOMS(arena, rooms, err) != MHE_OK) {
        return MHE_E_MEMORY;
    }
    o->tracked = MHI_TAKE(arena, mhe_tracked, channels->n);
    o->rows = MHI_TAKE(arena, mhi_output_row, channels->n);
    if (o->tracked == NULL || o->rows == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < channels->n; i++) {
        mhi_output_row *r = &o->rows[i];
        const int32_t width = channels->rows[i].face.width;
        r->measured = MHI_TAKE(arena, double, width);
        r->target = MHI_TAKE(arena, double, width);
        r->weight = MHI_TAKE(arena, double, width);
        r->estimated = MHI_TAKE(arena, double, width);
        r->why = MHI_TAKE(arena, int32_t, width);
        if (!r->measured || !r->target || !r->weight || !r->estimated || !r->why) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
    }
    return MHE_OK;
}

/* The signal in the estimate; activations are controls where muscles are not `driven` by
 * excitations, and what is compared is what was held from the node on. */
static const double *estimated(const mhi_output *o, int32_t signal, int32_t driven) {
    switch (signal) {
    case MHI_SIGNAL_MARKERS:
        return o->marker;
    case MHI_SIGNAL_Q:
        return o->q;
    case MHI_SIGNAL_QDOT:
        return o->v;
    case MHI_SIGNAL_ACTIVATION:
        return driven ? o->activation : o->excitation;
    case MHI_SIGNAL_EXCITATION:
        return o->excitation;
    case MHI_SIGNAL_MUSCLE_FORCE:
        return o->force;
    case MHI_SIGNAL_JOINT_MOMENT:
        return o->moment;
    default:
        return o->residual;
    }
}

/* What a channel tracked at node k, `controls` where its signal is a control. */
static void give_tracked(mhe_estimator *e, int32_t i, int32_t k, int32_t controls) {
    const mhi_channel *c = &e->channels.rows[i];
    const int32_t width = c->face.width;
    const int32_t of_control = c->signal >= 0 && mhi_ocp_signals(e->ocp)->signal[c->signal].reads_u;
    const int32_t driven = mhi_ocp_control(e->ocp) == MHI_SIGNAL_EXCITATION;
    const ptrdiff_t at = (ptrdiff_t)(of_control ? controls : k) * width;
    const size_t bytes = sizeof(double) * (size_t)width;
    mhi_output_row *r = &e->output.rows[i];
    mhe_tracked *t = &e->output.tracked[i];
    *t = (mhe_tracked){.size = sizeof *t,
                       .channel = i,
                       .measured = r->measured,
                       .target = r->target,
                       .weight = r->weight,
                       .why = r->why,
                       .estimated = r->estimated};
    memcpy(r->measured, c->measured + at, bytes);
    memcpy(r->estimated,
           c->signal < 0 ? c->measured + at : estimated(&e->output, c->signal, driven), bytes);
    for (int32_t j = 0; j < width; j++) {
        const int32_t why = c->why[at + j];
        r->why[j] = why == MHE_TRACK_USED && !c->read ? MHE_TRACK_UNREAD : why;
        r->weight[j] = r->why[j] == MHE_TRACK_USED;
        r->target[j] = c->read ? c->believed[at + j] : NAN;
        t->n_measured += why != MHE_TRACK_MISSING;
        t->n_left_out += why == MHE_TRACK_FAR || why == MHE_TRACK_SATURATED;
    }
    t->rms = mhi_rms_distance(r->estimated, r->measured, width, c->face.per_label);
}

/* Controls at the time of node k [n_u]. They are held over intervals, each as large as it should be
 * in the interval's middle: at a node the mean of both sides, where both are known. */
static void hold(mhe_estimator *e, int32_t k, int32_t controls) {
    const double *after = mhi_row(e->window.solution.u, controls, e->n_u);
    const double *before = k > 0                ? mhi_row(e->window.solution.u, k - 1, e->n_u)
                           : e->window.has_left ? e->window.left_u
                                                : after;
    for (int32_t i = 0; i < e->n_u; i++) {
        e->output.held[i] = 0.5 * (before[i] + after[i]);
    }
}

/* States and controls of node k, and the muscles there. */
static mhe_status give_values(mhe_estimator *e, int32_t k, int32_t controls, mhe_error *err) {
    mhi_output *o = &e->output;
    const double *x = mhi_row(e->window.solution.x, k, e->window.n_x);
    const double *u = mhi_row(e->window.solution.u, controls, e->n_u);
    hold(e, k, controls);
    const double *a = mhi_system_activation(e->system, x, o->held);
    const size_t n_q = sizeof(double) * (size_t)e->n_q, n_m = sizeof(double) * (size_t)e->n_m;
    memcpy(o->x, x, sizeof(double) * (size_t)e->n_x);
    memcpy(o->u, u, sizeof(double) * (size_t)e->n_u);
    memcpy(o->q, x, n_q);
    memcpy(o->v, x + e->n_q, n_q);
    memcpy(o->activation, a, n_m);
    memcpy(o->excitation, u, n_m);
    memcpy(o->residual, o->held + e->n_m,
           sizeof(double) * (size_t)mhi_ocp_problem(e->ocp)->n_residual_torques);
    mhi_muscle_state muscles;
    mhi_system_context *context = mhi_ocp_context(e->ocp);
    mhe_system_point at;
    mhi_system_point(e->system, x, o->held, NULL, &at);
    mhe_status status = mhi_system_muscles(context, &at, 0, &muscles, err);
    if (status == MHE_OK) {
        memcpy(o->force, muscles.force, n_m);
        memcpy(o->moment, muscles.moment, n_q);
        status = mhi_system_markers(context, x, o->marker, NULL, err);
    }
    return status;
}

/* Inputs of forces at the time of node k. */
static const double *give_inputs(mhe_estimator *e, int32_t k) {
    const int32_t n_w = mhi_system_face(e->system)->n_w;
    if (n_w == 0) {
        return NULL;
    }
    memcpy(e->output.input, mhi_ocp_input(e->ocp, k), sizeof(double) * (size_t)n_w);
    (void)mhi_system_inputs(e->system, e->window.times[k], e->output.input, NULL);
    return e->output.input;
}

/* What joints transmit at node k, with the controls and the loads of its time. NaN: no answer. */
static void give_reactions(mhe_estimator *e) {
    mhi_output *o = &e->output;
    const int32_t n_w = mhi_system_face(e->system)->n_w;
    mhe_system_point at;
    mhi_system_point(e->system, o->x, o->held, n_w > 0 ? o->input : NULL, &at);
    if (mhi_reactions_solve(e->reactions, mhi_ocp_context(e->ocp), &at, e->run->output.reactions,
                            o->reaction, NULL) != MHE_OK) {
        for (int32_t i = 0; i < 6 * e->description->n_bodies; i++) {
            o->reaction[i] = NAN;
        }
    }
}

mhe_status mhi_output_give(mhe_estimator *e, int32_t k, mhe_estimate *out, mhe_error *err) {
    const int32_t controls = k < e->window.n ? k : e->window.n - 1;
    const mhi_output *o = &e->output;
    const mhi_channel *markers = mhi_channels_find(&e->channels, MHI_SIGNAL_MARKERS);
    const mhi_channel *emg = mhi_channels_find(&e->channels, mhi_ocp_control(e->ocp));
    const mhe_status status = give_values(e, k, controls, err);
    for (int32_t i = 0; i < e->channels.n; i++) {
        give_tracked(e, i, k, controls);
    }
    out->time = e->window.times[k];
    out->marker_rms =
        mhi_rms_distance(o->marker, mhi_row(markers->measured, k, 3 * e->n_k), 3 * e->n_k, 3);
    out->emg_rms =
        mhi_rms_distance(o->excitation, mhi_row(emg->believed, controls, e->n_m), e->n_m, 1);
    out->q = o->q;
    out->qdot = o->v;
    out->activation = o->activation;
    out->excitation = mhi_ocp_control(e->ocp) == MHI_SIGNAL_EXCITATION ? o->excitation : NULL;
    out->force = o->force;
    out->moment = o->moment;
    out->residual = o->residual;
    out->markers = o->marker;
    out->phase = e->phase;
    out->n_tracked = e->channels.n;
    out->tracked_size = sizeof(mhe_tracked);
    out->tracked = o->tracked;
    out->inputs = give_inputs(e, k);
    if (e->reactions != NULL) {
        give_reactions(e);
        out->reactions = o->reaction;
    }
    out->layout = mhi_ocp_problem(e->ocp)->layout;
    out->states = o->x;
    out->controls = o->u;
    return status;
}
