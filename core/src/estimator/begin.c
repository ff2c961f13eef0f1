/* SPDX-License-Identifier: Apache-2.0 */
/* begin.c: a full window from its measurements alone: at the start of a run, and where the motion
 * was lost. */
#include "estimator/estimator_private.h"

#include <string.h>

/* Muscle controls of node k to start from: the EMG where there is one. */
static void guess_controls(mhe_estimator *e, int32_t k, double *a) {
    const double *emg = mhi_row(e->emg, k, e->n_m);
    for (int32_t i = 0; i < e->n_m; i++) {
        a[i] = mhi_clip(isnan(emg[i]) ? 0.1 : emg[i], e->run->bounds.activation_min + 0.01,
                        e->run->bounds.activation_max - 0.01);
    }
}

/* Measured angles of node k in the place of what q says. */
static void take_angles(const mhe_estimator *e, int32_t k, double *q) {
    for (int32_t i = 0; i < e->n_q; i++) {
        const double angle = mhi_row(e->angles, k, e->n_q)[i];
        const mhe_coordinate *c = &e->description->coordinates[i];
        q[i] = isnan(angle) ? q[i] : mhi_clip(angle, c->lower, c->upper);
    }
}

/* Inverse kinematics node by node -> q of guess_x, `distance` [n+1] of the markers, NaN without. A
 * node without markers takes the posture before it; measured angles stand for themselves. */
static mhe_status guess_postures(mhe_estimator *e, double *distance, double *nearest,
                                 mhe_error *err) {
    double *q = e->out_q; /* the last estimate, near where there was one */
    int32_t n_seen = 0;
    for (int32_t i = 0; i < e->n_q && e->solved == 0; i++) {
        q[i] = isnan(e->start_q[i]) ? e->description->coordinates[i].value : e->start_q[i];
    }
    *nearest = INFINITY;
    for (int32_t k = 0; k <= e->n; k++) {
        mhe_status status = (n_seen == 0 ? mhi_start_search : mhi_start_posture)(
            e->start, mhi_row(e->trusted, k, 3 * e->n_k), q, &distance[k], err);
        if (status != MHE_OK) {
            return status;
        }
        take_angles(e, k, q);
        n_seen += !isnan(distance[k]);
        *nearest = fmin(*nearest, distance[k]);
        memcpy(mhi_row(e->guess_x, k, e->n_x), q, sizeof(double) * (size_t)e->n_q);
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
    for (int32_t k = 0; k <= e->n && e->outlier > 0; k++) {
        if (!(distance[k] > nearest + e->outlier)) {
            continue;
        }
        for (int32_t i = 0; i < 3 * e->n_k; i++) {
            mhi_row(e->trusted, k, 3 * e->n_k)[i] = NAN;
        }
        int32_t good = k;
        while (good > 0 && distance[good] > nearest + e->outlier) {
            good--;
        }
        while (good < e->n && distance[good] > nearest + e->outlier) {
            good++;
        }
        memcpy(mhi_row(e->guess_x, k, e->n_x), mhi_row(e->guess_x, good, e->n_x), bytes);
    }
}

/* Velocities of node k to start from: the least-squares slopes of the postures of up to three nodes
 * to each side, since the markers' noise over a single interval makes a large velocity. */
static void guess_velocities(mhe_estimator *e, int32_t k, double *v) {
    const int32_t from = k < 3 ? 0 : k - 3, to = k + 3 > e->n ? e->n : k + 3;
    double mean = 0, squares = 0;
    for (int32_t j = from; j <= to; j++) {
        mean += e->times[j] / (to - from + 1);
    }
    for (int32_t j = from; j <= to; j++) {
        squares += (e->times[j] - mean) * (e->times[j] - mean);
    }
    for (int32_t i = 0; i < e->n_q; i++) {
        double sum = 0;
        for (int32_t j = from; j <= to; j++) {
            sum += (e->times[j] - mean) * mhi_row(e->guess_x, j, e->n_x)[i];
        }
        v[i] = sum / squares;
    }
}

/* Velocities by slopes, muscles by the EMG. */
static void guess_rest(mhe_estimator *e) {
    for (int32_t k = 0; k <= e->n; k++) {
        double *x = mhi_row(e->guess_x, k, e->n_x);
        guess_velocities(e, k, x + e->n_q);
        if (e->n_x > 2 * e->n_q) {
            guess_controls(e, k, x + 2 * e->n_q);
        }
        if (k < e->n) {
            double *u = mhi_row(e->guess_u, k, e->n_u);
            guess_controls(e, k, u);
            memset(u + e->n_m, 0, sizeof(double) * (size_t)e->n_r);
        }
    }
}

/* At the start of a run: q and qdot near what is known, where something is. */
static void bound_first_state(mhe_estimator *e) {
    double *lower = mhi_ocp_x_lower(e->ocp, 0), *upper = mhi_ocp_x_upper(e->ocp, 0);
    const double width = e->run->initial.tolerance;
    for (int32_t i = 0; i < e->n_q; i++) {
        const double known[2] = {e->start_q[i], e->start_v[i]};
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
    mhi_recover_begun(e);
    mhe_status status = guess_postures(e, e->distance, &nearest, err);
    if (status != MHE_OK) {
        return status;
    }
    drop_outliers(e, e->distance, nearest);
    guess_rest(e);
    memcpy(e->solution.x, e->guess_x, sizeof(double) * (size_t)((e->n + 1) * e->n_x));
    memcpy(e->solution.u, e->guess_u, sizeof(double) * (size_t)(e->n * e->n_u));
    e->solution.has_multipliers = 0;
    e->settled = 0;
    e->rounds = 0;
    mhi_window_set_bounds(e);
    if (e->solved == 0) {
        bound_first_state(e);
    }
    e->restarted = e->solved > 0;
    e->begun = e->prepared = 1;
    return MHE_OK;
}
