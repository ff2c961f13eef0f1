/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/estimator_private.h"

#include <string.h>

mhe_status mhi_window_create(mhi_window *w, int32_t n, int32_t n_x, int32_t n_u, mhi_arena *arena,
                             mhe_error *err) {
    *w = (mhi_window){.n = n, .n_x = n_x, .n_u = n_u, .solution = {.size = sizeof w->solution}};
    const mhi_room rooms[] = {{&w->times, n + 1},
                              {&w->solution.x, (n + 1) * n_x},
                              {&w->solution.u, n * n_u},
                              {&w->solution.lambda, n * n_x},
                              {&w->solution.zx_lower, (n + 1) * n_x},
                              {&w->solution.zx_upper, (n + 1) * n_x},
                              {&w->solution.zu_lower, n * n_u},
                              {&w->solution.zu_upper, n * n_u},
                              {&w->left_u, n_u},
                              {&w->guess_x, (n + 1) * n_x},
                              {&w->guess_u, n * n_u},
                              {&w->prior_centre, n_x},
                              {&w->prior_weight, n_x}};
    return MHI_TAKE_ROOMS(arena, rooms, err);
}

void mhi_window_append(mhe_estimator *e, double time, const double *const *values) {
    const int32_t k = e->window.filled++;
    e->window.times[k] = time;
    for (int32_t i = 0; i < e->channels.n; i++) {
        mhi_channel *c = &e->channels.rows[i];
        mhi_channel_set(c, k, values == NULL ? c->absent : values[i]);
    }
    mhi_phase_on(e, MHI_EVENT_NODES);
}

void mhi_window_skip(mhe_estimator *e, double time) {
    mhi_window_append(e, time, NULL);
    if (e->window.filled > e->window.n) {
        if (mhi_phase_begun(e)) {
            mhi_window_follow(e);
        }
        mhi_window_advance(e);
    }
}

void mhi_window_clear(mhe_estimator *e) {
    e->window.filled = e->window.prepared = e->window.has_left = 0;
    mhi_trust_clear(&e->trust);
    mhi_rates_clear(&e->rates);
    mhi_begin_forget(&e->begin);
    mhi_phase_on(e, MHI_EVENT_EMPTIED);
}

/* Drops the first of n rows of an array, keeping the last one twice. */
static void shift_rows(double *array, int32_t n, int32_t width) {
    memmove(array, array + width, sizeof(double) * (size_t)(n - 1) * (size_t)width);
}

/* The layout's, at every node. */
static void set_general_bounds(mhe_estimator *e) {
    const mhe_layout *layout = mhi_system_face(e->system)->layout;
    for (int32_t k = 0; k <= e->window.n; k++) {
        mhi_layout_bounds(layout, MHE_ROLE_STATE, mhi_ocp_x_lower(e->ocp, k),
                          mhi_ocp_x_upper(e->ocp, k));
        if (k < e->window.n) {
            mhi_layout_bounds(layout, MHE_ROLE_CONTROL, mhi_ocp_u_lower(e->ocp, k),
                              mhi_ocp_u_upper(e->ocp, k));
        }
    }
}

void mhi_window_set_bounds(mhe_estimator *e) {
    const size_t bytes = sizeof(double) * (size_t)e->window.n_x;
    set_general_bounds(e);
    mhi_ocp_set_begins(e->ocp, !mhi_phase_settled(e));
    for (int32_t i = e->n_x; i < e->window.n_x && !mhi_phase_settled(e); i++) {
        e->window.solution.x[i] = 0; /* nothing is known of a node before */
    }
    if (mhi_phase_settled(e)) {
        memcpy(mhi_ocp_x_lower(e->ocp, 0), e->window.solution.x, bytes);
        memcpy(mhi_ocp_x_upper(e->ocp, 0), e->window.solution.x, bytes);
    }
}

/* How far markers are off: from the postures nearest to them where these are looked for, else from
 * the estimates, which muscles pull. */
static double misfit(const mhe_estimator *e, const mhi_channel *markers) {
    if (e->rates.start != NULL) {
        return mhi_rates_misfit(&e->rates);
    }
    return markers->n_misfit > 0 ? sqrt(markers->misfit / markers->n_misfit) : NAN;
}

void mhi_window_set_targets(mhe_estimator *e) {
    for (int32_t i = 0; i < e->channels.n;
         i++) { /* of EMG, for costs that ask how much of it is noise */
        mhi_channel *c = &e->channels.rows[i];
        if (c->read && c->signal >= 0 && !c->posture) {
            mhi_channel_spread(c, e->window.filled, mhi_ocp_target_spread(e->ocp, c->signal));
        } else if (c->read && c->signal == MHI_SIGNAL_MARKERS) {
            double *spread = mhi_ocp_target_spread(e->ocp, c->signal);
            const double off = misfit(e, c);
            for (int32_t j = 0; j < c->face.width; j++) {
                spread[j] = off;
            }
        }
    }
    for (int32_t k = 0; k <= e->window.n; k++) {
        mhi_ocp_set_time(e->ocp, k, e->window.times[k]);
        for (int32_t i = 0; i < e->channels.n; i++) {
            const mhi_channel *c = &e->channels.rows[i];
            double *target = c->signal < 0 ? mhi_ocp_input(e->ocp, k) + c->input
                                           : mhi_ocp_target(e->ocp, c->signal, k);
            if (target != NULL) {
                memcpy(target, mhi_row(c->believed, k, c->face.width),
                       sizeof(double) * (size_t)c->face.width);
                if (c->signal == MHI_SIGNAL_MARKERS && e->rates.offsets.sd > 0) {
                    mhi_offsets_correct(&e->rates.offsets, k, target, target);
                }
            }
        }
    }
}

/* The newest state, which no solve has seen: where the last control leads. */
static void extend(mhe_estimator *e) {
    double *x = mhi_row(e->window.solution.x, e->window.n, e->window.n_x);
    const double *before = mhi_row(e->window.solution.x, e->window.n - 1, e->window.n_x);
    const double *u = mhi_row(e->window.solution.u, e->window.n - 1, e->n_u);
    mhi_pace_tick(e);
    mhe_status status = mhi_ocp_extend(e->ocp, e->window.n - 1, before, u, x, NULL);
    for (int32_t i = 0; i < e->window.n_x; i++) { /* with what is carried */
        const double value = status == MHE_OK && isfinite(x[i]) ? x[i] : before[i];
        x[i] = mhi_clip(value, mhi_ocp_x_lower(e->ocp, e->window.n)[i],
                        mhi_ocp_x_upper(e->ocp, e->window.n)[i]);
    }
}

void mhi_window_follow(mhe_estimator *e) {
    if (e->window.prepared) {
        return;
    }
    mhi_window_set_bounds(e);
    extend(e);
    mhi_trust_expect(e);
    e->window.prepared = 1;
}

void mhi_window_advance(mhe_estimator *e) {
    mhi_window *w = &e->window;
    mhe_solution *s = &w->solution;
    const int32_t n = w->n;
    mhi_channels_shift(&e->channels, w->filled);
    mhi_rates_shift(&e->rates);
    shift_rows(w->times, n + 1, 1);
    w->filled--;
    w->prepared = 0;
    shift_rows(s->x, n + 1, w->n_x);
    shift_rows(s->zx_lower, n + 1, w->n_x);
    shift_rows(s->zx_upper, n + 1, w->n_x);
    memcpy(w->left_u, s->u, sizeof(double) * (size_t)w->n_u);
    w->has_left = mhi_phase_begun(e);
    shift_rows(s->u, n, w->n_u);
    shift_rows(s->zu_lower, n, w->n_u);
    shift_rows(s->zu_upper, n, w->n_u);
    shift_rows(s->lambda, n, w->n_x);
    mhi_ocp_shift(e->ocp);
    mhi_phase_on(e, MHI_EVENT_NODES);
}
