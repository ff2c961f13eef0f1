/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/estimator_private.h"

#include <math.h>
#include <string.h>

/* Parts of a frame's time after which no posture is looked for elsewhere, and none any more. A
 * model so large that they matter has no time for a step in that frame: the next ones bring it, and
 * need postures that are near. */
#define SEARCH 0.3
#define POSTURES 0.9

mhe_status mhi_begin_create(mhi_begin *b, const mhi_system *system, mhi_system_context *context,
                            int32_t nodes, mhi_arena *arena, mhe_error *err) {
    const int32_t n_q = mhi_system_face(system)->n_q;
    *b = (mhi_begin){.n_q = n_q,
                     .q = MHI_TAKE(arena, double, n_q),
                     .v = MHI_TAKE(arena, double, n_q),
                     .closed = MHI_TAKE(arena, double, n_q),
                     .activation = MHI_TAKE(arena, double, mhi_system_face(system)->n_m),
                     .range = {MHI_TAKE(arena, double, mhi_system_face(system)->n_m),
                               MHI_TAKE(arena, double, mhi_system_face(system)->n_m)},
                     .mean = MHI_TAKE(arena, double, mhi_system_face(system)->n_m),
                     .torque = MHI_TAKE(arena, double, mhi_system_face(system)->n_r),
                     .input = MHI_TAKE(arena, double, mhi_system_face(system)->n_w),
                     .near = MHI_TAKE(arena, double, n_q),
                     .distance = MHI_TAKE(arena, double, nodes)};
    if (b->q == NULL || b->v == NULL || b->closed == NULL || b->near == NULL ||
        b->activation == NULL || b->distance == NULL || b->range[0] == NULL ||
        b->range[1] == NULL || b->mean == NULL || b->torque == NULL || b->input == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = mhi_statics_create(&b->statics, system, arena, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_begin_forget(b);
    return mhi_start_create(system, context, &b->start, err);
}

void mhi_begin_free(mhi_begin *b) {
    mhi_start_free(b->start);
}

void mhi_begin_forget(mhi_begin *b) {
    for (int32_t i = 0; i < b->n_q; i++) {
        b->q[i] = b->v[i] = NAN;
    }
}

int32_t mhi_begin_can(const mhe_estimator *e) {
    int32_t known = !e->begin.has_posture || mhi_channel_any(e->begin.q, e->n_q);
    for (int32_t i = 0; i < e->channels.n && !known; i++) {
        const mhi_channel *c = &e->channels.rows[i];
        known = c->posture && mhi_channel_any(c->measured, c->face.width);
    }
    return known;
}

/* Muscle controls of node k to start from: the EMG where there is one. */
static void guess_controls(mhe_estimator *e, int32_t k, double *a) {
    const mhi_channel *control = mhi_channels_find(&e->channels, mhi_ocp_control(e->ocp));
    const double *emg = mhi_row(control->believed, k, e->n_m);
    for (int32_t i = 0; i < e->n_m; i++) {
        a[i] = mhi_clip(isnan(emg[i]) ? 0.1 : emg[i], e->run->bounds.activation_min + 0.01,
                        e->run->bounds.activation_max - 0.01);
    }
}

/* Measured angles of node k in the place of what q says. */
static void take_angles(const mhe_estimator *e, int32_t k, double *q) {
    const mhi_channel *angles = mhi_channels_find(&e->channels, MHI_SIGNAL_Q);
    for (int32_t i = 0; i < e->n_q; i++) {
        const double angle = mhi_row(angles->believed, k, e->n_q)[i];
        const mhe_coordinate *c = &e->description->coordinates[i];
        q[i] = isnan(angle) ? q[i] : mhi_clip(angle, c->lower, c->upper);
    }
}

/* The posture near q in which the model's loops are closed, where there is one. */
static void close_loops(mhe_estimator *e, double *q) {
    double *near = e->begin.closed;
    memcpy(near, q, sizeof *q * (size_t)e->n_q);
    if (mhi_system_close_loops(mhi_ocp_context(e->ocp), near, NULL, NULL) == MHE_OK) {
        for (int32_t i = 0; i < e->n_q; i++) {
            const mhe_coordinate *c = &e->description->coordinates[i];
            q[i] = mhi_clip(near[i], c->lower, c->upper);
        }
    }
}

/* Inverse kinematics node by node -> q of guess_x, `distance` [n+1] of the markers, NaN without. A
 * node without markers takes the posture before it; measured angles stand for themselves. */
static mhe_status guess_postures(mhe_estimator *e, double *distance, double *nearest,
                                 mhe_error *err) {
    const mhi_channel *markers = mhi_channels_find(&e->channels, MHI_SIGNAL_MARKERS);
    double *q = e->output.q; /* the last estimate, near where there was one */
    int32_t n_seen = 0;
    for (int32_t i = 0; i < e->n_q && e->window.solved == 0; i++) {
        q[i] = isnan(e->begin.q[i]) ? e->description->coordinates[i].value : e->begin.q[i];
    }
    *nearest = INFINITY;
    for (int32_t k = 0; k <= e->window.n; k++) {
        mhi_pace_part(e, n_seen == 0 ? SEARCH : POSTURES);
        mhe_status status = (n_seen == 0 ? mhi_start_search : mhi_start_posture)(
            e->begin.start, mhi_row(markers->believed, k, 3 * e->n_k), q, &distance[k], err);
        if (status != MHE_OK) {
            return status;
        }
        take_angles(e, k, q);
        close_loops(e, q);
        n_seen += !isnan(distance[k]);
        *nearest = fmin(*nearest, distance[k]);
        memcpy(mhi_row(e->window.guess_x, k, e->window.n_x), q, sizeof(double) * (size_t)e->n_q);
    }
    if (n_seen > 0 && *nearest > 1.0) {
        return mhe_fail(
            err, MHE_E_INPUT,
            "the markers do not fit the model within a metre (%.3g m at best): is their unit "
            "right, and is this the model of that person?",
            *nearest);
    }
    return MHE_OK;
}

/* A frame that no posture comes near, where others fit, was not measured well: its neighbour's
 * posture stands in. */
static void drop_outliers(mhe_estimator *e, const double *distance, double nearest) {
    const size_t bytes = sizeof(double) * (size_t)e->n_q;
    mhi_channel *markers = mhi_channels_find(&e->channels, MHI_SIGNAL_MARKERS);
    for (int32_t k = 0; k <= e->window.n && e->trust.outlier > 0; k++) {
        if (!(distance[k] > nearest + e->trust.outlier)) {
            continue;
        }
        mhi_trust_leave_out(markers, k, 0, 3 * e->n_k, MHE_TRACK_FAR);
        int32_t good = k;
        while (good > 0 && distance[good] > nearest + e->trust.outlier) {
            good--;
        }
        while (good < e->window.n && distance[good] > nearest + e->trust.outlier) {
            good++;
        }
        memcpy(mhi_row(e->window.guess_x, k, e->window.n_x),
               mhi_row(e->window.guess_x, good, e->window.n_x), bytes);
    }
}

/* Velocities of node k to start from: the least-squares slopes of the postures of up to three nodes
 * to each side, since the markers' noise over a single interval makes a large velocity. */
static void guess_velocities(mhe_estimator *e, int32_t k, double *v) {
    const int32_t from = k < 3 ? 0 : k - 3, to = k + 3 > e->window.n ? e->window.n : k + 3;
    double mean = 0, squares = 0;
    for (int32_t j = from; j <= to; j++) {
        mean += e->window.times[j] / (to - from + 1);
    }
    for (int32_t j = from; j <= to; j++) {
        squares += (e->window.times[j] - mean) * (e->window.times[j] - mean);
    }
    for (int32_t i = 0; i < e->n_q; i++) {
        double sum = 0;
        for (int32_t j = from; j <= to; j++) {
            sum += (e->window.times[j] - mean) * mhi_row(e->window.guess_x, j, e->window.n_x)[i];
        }
        v[i] = sum / squares;
    }
}

/* Accelerations of node k: slopes of the velocities beside it. */
static void guess_accelerations(const mhe_estimator *e, int32_t k, double *wanted) {
    const int32_t from = k > 0 ? k - 1 : k, to = k < e->window.n ? k + 1 : k;
    const double *before = mhi_row(e->window.guess_x, from, e->window.n_x) + e->n_q;
    const double *after = mhi_row(e->window.guess_x, to, e->window.n_x) + e->n_q;
    for (int32_t i = 0; i < e->n_q; i++) {
        wanted[i] = (after[i] - before[i]) / (e->window.times[to] - e->window.times[from]);
    }
}

/* Muscles without EMG: what guess_means() found. */
static void take_means(mhe_estimator *e, int32_t k, double *a) {
    const mhi_channel *control = mhi_channels_find(&e->channels, mhi_ocp_control(e->ocp));
    const double *emg = mhi_row(control->believed, k, e->n_m);
    for (int32_t i = 0; i < e->n_m; i++) {
        a[i] = isnan(emg[i]) ? e->begin.mean[i] : a[i];
    }
}

/* Muscles without EMG take what static optimisation says of node k (`held`: they are as they are),
 * and residual torques what is left; where it says nothing, a is as it was and the torques are 0.
 */
static void guess_forces(mhe_estimator *e, int32_t k, int32_t held, double *a, double *r) {
    const double *x = mhi_row(e->window.guess_x, k, e->window.n_x);
    const mhi_channel *control = mhi_channels_find(&e->channels, mhi_ocp_control(e->ocp));
    const double *emg = mhi_row(control->believed, k, e->n_m);
    const int32_t n_w = mhi_system_face(e->system)->n_w;
    double *lower = e->begin.range[0], *upper = e->begin.range[1], *wanted = e->begin.closed;
    int32_t n_free = 0;
    memset(r, 0, sizeof *r * (size_t)e->n_r);
    for (int32_t i = 0; i < e->n_m; i++) {
        const int32_t known = !isnan(emg[i]);
        lower[i] = known || held ? a[i] : e->run->bounds.activation_min + 0.01;
        upper[i] = known || held ? a[i] : e->run->bounds.activation_max - 0.01;
        n_free += !known;
    }
    if (n_free == 0 || mhi_system_context_spent(mhi_ocp_context(e->ocp))) {
        return;
    }
    if (n_w > 0) {
        memcpy(e->begin.input, mhi_ocp_input(e->ocp, k), sizeof(double) * (size_t)n_w);
        (void)mhi_system_inputs(e->system, e->window.times[k], e->begin.input, NULL);
    }
    guess_accelerations(e, k, wanted);
    if (mhi_statics_solve(&e->begin.statics, mhi_ocp_context(e->ocp), x, x + e->n_q,
                          n_w > 0 ? e->begin.input : NULL, wanted, lower, upper, a, r) != 0) {
        memset(r, 0, sizeof *r * (size_t)e->n_r);
        return;
    }
    const double *least = mhi_ocp_u_lower(e->ocp, 0), *most = mhi_ocp_u_upper(e->ocp, 0);
    for (int32_t i = 0; i < e->n_r; i++) {
        r[i] = mhi_clip(r[i], least[e->n_m + i], most[e->n_m + i]);
    }
}

/* The muscles' states in equilibrium with their activations; where there is none, of a usual size.
 */
static void guess_states(mhe_estimator *e, const double *a, double *x) {
    const mhe_layout *layout = mhi_system_face(e->system)->layout;
    if (mhi_system_equilibrium(mhi_ocp_context(e->ocp), x, x + e->n_q, a, x, NULL) == MHE_OK) {
        return;
    }
    for (int32_t b = 0; b < layout->n_blocks; b++) {
        const mhe_block *block = mhe_layout_at(layout, b);
        for (int32_t i = 0; i < block->count && block->role == MHE_ROLE_STATE &&
                            block->structure == MHE_STRUCTURE_MUSCLE;
             i++) {
            x[block->first + i] = mhi_clip(block->scale[i], block->lower[i], block->upper[i]);
        }
    }
}

/* Activations that are states cannot jump from node to node: their mean over the window. */
static void guess_means(mhe_estimator *e) {
    double *a = e->begin.activation, *mean = e->begin.mean;
    memset(mean, 0, sizeof *mean * (size_t)e->n_m);
    for (int32_t k = 0; k <= e->window.n; k++) {
        guess_controls(e, k, a);
        guess_forces(e, k, 0, a, e->begin.torque);
        for (int32_t i = 0; i < e->n_m; i++) {
            mean[i] += a[i] / (e->window.n + 1);
        }
    }
}

/* Velocities by slopes, muscles by the EMG and by what moves the body so. */
static void guess_rest(mhe_estimator *e) {
    double *a = e->begin.activation, *r = e->begin.torque;
    const int32_t states = mhi_system_face(e->system)->n_d > 0;
    for (int32_t k = 0; k <= e->window.n; k++) {
        guess_velocities(e, k, mhi_row(e->window.guess_x, k, e->window.n_x) + e->n_q);
    }
    if (states) {
        guess_means(e);
    }
    for (int32_t k = 0; k <= e->window.n; k++) {
        guess_controls(e, k, a);
        if (states) {
            take_means(e, k, a);
        }
        guess_forces(e, k, states, a, r);
        guess_states(e, a, mhi_row(e->window.guess_x, k, e->window.n_x));
        if (k < e->window.n) {
            double *u = mhi_row(e->window.guess_u, k, e->n_u);
            memcpy(u, a, sizeof *u * (size_t)e->n_m);
            memcpy(u + e->n_m, r, sizeof *u * (size_t)e->n_r);
        }
    }
}

/* At the start of a run: q and qdot near what is known, where something is. */
static void bound_first_state(mhe_estimator *e) {
    double *lower = mhi_ocp_x_lower(e->ocp, 0), *upper = mhi_ocp_x_upper(e->ocp, 0);
    const double width = e->run->initial.tolerance;
    for (int32_t i = 0; i < e->n_q; i++) {
        const double known[2] = {e->begin.q[i], e->begin.v[i]};
        for (int32_t part = 0; part < 2; part++) {
            const int32_t j = part * e->n_q + i;
            if (isnan(known[part])) {
                continue;
            }
            const double centre = mhi_clip(known[part], lower[j], upper[j]);
            lower[j] = fmax(lower[j], centre - width);
            upper[j] = fmin(upper[j], centre + width);
        }
    }
}

mhe_status mhi_window_begin(mhe_estimator *e, mhe_error *err) {
    double nearest = 0;
    mhi_trust_begun(e);
    mhi_pace_postures(e, 1);
    mhe_status status = guess_postures(e, e->begin.distance, &nearest, err);
    mhi_pace_postures(e, 0);
    mhi_pace_part(e, 1);
    if (status != MHE_OK) {
        return status;
    }
    drop_outliers(e, e->begin.distance, nearest);
    guess_rest(e);
    mhi_ocp_set_begins(e->ocp, 1);
    status = mhi_ocp_carry(e->ocp, e->window.guess_x, e->window.guess_u, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_pace_measure(e);
    memcpy(e->window.solution.x, e->window.guess_x,
           sizeof(double) * (size_t)((e->window.n + 1) * e->window.n_x));
    memcpy(e->window.solution.u, e->window.guess_u,
           sizeof(double) * (size_t)(e->window.n * e->n_u));
    e->window.solution.has_multipliers = 0;
    e->window.has_left = 0;
    mhi_phase_on(e, MHI_EVENT_BEGUN);
    e->begin.rounds = e->begin.steps = e->begin.stuck = e->begin.by_steps = 0;
    mhi_bands_forget(e->bands);
    mhi_window_set_bounds(e);
    if (e->window.solved == 0) {
        bound_first_state(e);
    }
    e->begin.restarted = e->window.solved > 0;
    e->window.prepared = 1;
    return MHE_OK;
}
