/* SPDX-License-Identifier: Apache-2.0 */
#include "reference_track.h"

#include "control/feedback.h"

#include <math.h>
#include <string.h>

/* Weights of the feedback: a control may move by its distance to the nearest bound, at least by
 * LEAST_ROOM, where a state is off by one unit. */
#define LEAST_ROOM 1e-3

typedef struct tracking {
    simulation *s;
    const mhi_trajectory *t;
    double lower, upper;
    int32_t first; /* node */
    double *q_weight, *r_weight, *gain;
    track_report *report;
    mhi_arena arena;
} tracking;

static mhe_status take(tracking *w, mhe_error *err) {
    const mhi_trajectory *t = w->t;
    const ptrdiff_t n = t->n;
    w->gain = MHI_TAKE(&w->arena, double, n * t->n_x * t->n_u);
    w->q_weight = MHI_TAKE(&w->arena, double, t->n_x);
    w->r_weight = MHI_TAKE(&w->arena, double, n * t->n_u);
    return w->gain && w->q_weight && w->r_weight ? MHE_OK
                                                 : mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

static mhe_status find_gains(tracking *w, mhe_error *err) {
    const mhi_trajectory *t = w->t;
    for (ptrdiff_t i = 0; i < (ptrdiff_t)t->n * t->n_u; i++) {
        const int muscle = i % t->n_u < w->s->n_m;
        const double to_bound = fmin(t->u[i] - w->lower, w->upper - t->u[i]);
        const double room = muscle ? fmax(LEAST_ROOM, to_bound) : 1;
        w->r_weight[i] = 1 / (room * room);
    }
    for (int32_t i = 0; i < t->n_x; i++) {
        w->q_weight[i] = 1;
    }
    const mhi_feedback_setup setup = {.n = t->n,
                                      .n_x = t->n_x,
                                      .n_u = t->n_u,
                                      .A = t->A,
                                      .B = t->B,
                                      .q_weight = w->q_weight,
                                      .r_weight = w->r_weight};
    return mhi_feedback_gains(&setup, w->gain, err);
}

/* The solution's control at node k with the feedback's correction; the last one is held. */
static void control_at(tracking *w, ptrdiff_t k) {
    const mhi_trajectory *t = w->t;
    simulation *s = w->s;
    if (k == t->n) {
        return;
    }
    const double *u = t->u + k * t->n_u;
    memcpy(s->u, u, sizeof(double) * (size_t)t->n_u);
    mhi_feedback_apply(w->gain + k * t->n_u * t->n_x, t->n_x, t->n_u, s->x, t->x + k * t->n_x,
                       s->u);
    for (int32_t i = 0; i < s->n_m; i++) {
        s->u[i] = fmin(fmax(s->u[i], w->lower), w->upper);
        w->report->correction = fmax(w->report->correction, fabs(s->u[i] - u[i]));
        w->report->peak_excitation = fmax(w->report->peak_excitation, s->u[i]);
    }
}

static void compare(tracking *w, ptrdiff_t k) {
    const simulation *s = w->s;
    const double *x = w->t->x + k * w->t->n_x;
    for (int32_t i = 0; i < s->n_q; i++) {
        w->report->q = fmax(w->report->q, fabs(s->x[i] - x[i]));
        w->report->qdot = fmax(w->report->qdot, fabs(s->x[s->n_q + i] - x[s->n_q + i]));
    }
    for (int32_t i = 0; i < s->n_m; i++) {
        const double force = s->force[i];
        w->report->peak_force = fmax(w->report->peak_force, force);
    }
}

static mhe_status move(tracking *w, mhe_sink *forces, mhe_error *err) {
    simulation *s = w->s;
    const mhi_trajectory *t = w->t;
    mhe_status status = MHE_OK;
    memcpy(s->x, t->x + (ptrdiff_t)w->first * t->n_x, sizeof(double) * (size_t)t->n_x);
    for (int32_t k = w->first; k <= t->n && status == MHE_OK; k++) {
        const double time = (k - w->first) * t->interval;
        control_at(w, k);
        status = simulation_write(s, time, err);
        if (status == MHE_OK) {
            compare(w, k);
            status = mhe_sink_row(forces, time, s->force, err);
        }
        if (status == MHE_OK && k < t->n) {
            status = simulation_step(s, time, err);
        }
    }
    return status;
}

mhe_status reference_track(simulation *s, const mhi_trajectory *solution, int32_t first,
                           double lower, double upper, track_report *report, mhe_error *err) {
    tracking w = {
        .s = s, .t = solution, .lower = lower, .upper = upper, .first = first, .report = report};
    mhe_sink *forces = NULL;
    *report = (track_report){0};
    mhe_status status = take(&w, err);
    if (status == MHE_OK) {
        status = find_gains(&w, err);
    }
    if (status == MHE_OK) {
        status = mhe_sink_sto(s->outbox, "forces.sto", "muscle forces, N", s->muscles, s->n_m,
                              &forces, err);
    }
    if (status == MHE_OK) {
        status = move(&w, forces, err);
    }
    mhi_arena_free(&w.arena);
    return status;
}
