/* SPDX-License-Identifier: Apache-2.0 */
/* window.c: the moving window: measurements, targets, bounds, and the shift that starts the next
 * solve (Algorithm 1 of Bailly et al. 2021). */
#include "estimator/estimator_private.h"

#include <string.h>

void mhi_window_append(mhe_estimator *e, double time, const double *markers, const double *emg,
                       const double *angles) {
    const int32_t k = e->filled++;
    const size_t bytes = sizeof(double) * (size_t)(3 * e->n_k);
    e->times[k] = time;
    memcpy(mhi_row(e->markers, k, 3 * e->n_k), markers, bytes);
    memcpy(mhi_row(e->trusted, k, 3 * e->n_k), markers, bytes);
    memcpy(mhi_row(e->emg, k, e->n_m), emg, sizeof(double) * (size_t)e->n_m);
    memcpy(mhi_row(e->angles, k, e->n_q), angles, sizeof(double) * (size_t)e->n_q);
}

void mhi_window_skip(mhe_estimator *e, double time) {
    mhi_window_append(e, time, e->no_markers, e->no_emg, e->no_angles);
    if (e->filled > e->n) {
        if (e->begun) {
            mhi_window_follow(e);
        }
        mhi_window_advance(e);
    }
}

void mhi_window_clear(mhe_estimator *e) {
    e->filled = e->n_counted = 0;
    e->interval = 0;
    e->begun = e->settled = e->prepared = 0;
    e->implausible = e->predicted = e->railed = 0;
    mhi_estimator_forget_start(e);
}

/* Drops the first of n rows of an array, keeping the last one twice. */
static void shift_rows(double *array, int32_t n, int32_t width) {
    memmove(array, array + width, sizeof(double) * (size_t)(n - 1) * (size_t)width);
}

/* Coordinate ranges, velocities, activations, controls. */
static void set_general_bounds(mhe_estimator *e) {
    const mhi_bounds_section *b = &e->run->bounds;
    const int32_t n_a = e->n_x - 2 * e->n_q;
    const double low = n_a > 0 ? b->excitation_min : b->activation_min;
    const double high = n_a > 0 ? b->excitation_max : b->activation_max;
    for (int32_t k = 0; k <= e->n; k++) {
        double *lower = mhi_ocp_x_lower(e->ocp, k), *upper = mhi_ocp_x_upper(e->ocp, k);
        for (int32_t i = 0; i < e->n_q; i++) {
            lower[i] = e->description->coordinates[i].lower;
            upper[i] = e->description->coordinates[i].upper;
            lower[e->n_q + i] = -b->velocity_max;
            upper[e->n_q + i] = b->velocity_max;
        }
        for (int32_t i = 0; i < n_a; i++) {
            lower[2 * e->n_q + i] = b->activation_min;
            upper[2 * e->n_q + i] = b->activation_max;
        }
        for (int32_t i = 0; i < e->n_u && k < e->n; i++) {
            mhi_ocp_u_lower(e->ocp, k)[i] = i < e->n_m ? low : -e->torque_max[i - e->n_m];
            mhi_ocp_u_upper(e->ocp, k)[i] = i < e->n_m ? high : e->torque_max[i - e->n_m];
        }
    }
}

void mhi_window_set_bounds(mhe_estimator *e) {
    const size_t bytes = sizeof(double) * (size_t)e->n_x;
    set_general_bounds(e);
    if (e->settled) {
        memcpy(mhi_ocp_x_lower(e->ocp, 0), e->solution.x, bytes);
        memcpy(mhi_ocp_x_upper(e->ocp, 0), e->solution.x, bytes);
    }
}

void mhi_window_set_targets(mhe_estimator *e) {
    const int32_t control = e->n_x > 2 * e->n_q ? MHI_SIGNAL_EXCITATION : MHI_SIGNAL_ACTIVATION;
    for (int32_t k = 0; k <= e->n; k++) {
        mhi_ocp_set_time(e->ocp, k, e->times[k]);
        double *markers = mhi_ocp_target(e->ocp, MHI_SIGNAL_MARKERS, k);
        double *controls = mhi_ocp_target(e->ocp, control, k);
        double *angles = mhi_ocp_target(e->ocp, MHI_SIGNAL_Q, k);
        if (markers != NULL) {
            memcpy(markers, mhi_row(e->trusted, k, 3 * e->n_k),
                   sizeof(double) * (size_t)(3 * e->n_k));
        }
        if (angles != NULL) {
            memcpy(angles, mhi_row(e->angles, k, e->n_q), sizeof(double) * (size_t)e->n_q);
        }
        if (controls != NULL) {
            memcpy(controls, mhi_row(e->emg, k, e->n_m), sizeof(double) * (size_t)e->n_m);
        }
    }
}

/* The newest state, which no solve has seen: where the last control leads. */
static void extend(mhe_estimator *e) {
    double *x = mhi_row(e->solution.x, e->n, e->n_x);
    const double *before = mhi_row(e->solution.x, e->n - 1, e->n_x);
    const double *u = mhi_row(e->solution.u, e->n - 1, e->n_u);
    mhe_status status = mhi_ocp_predict(e->ocp, before, u, x, NULL);
    for (int32_t i = 0; i < e->n_x; i++) {
        const double value = status == MHE_OK && isfinite(x[i]) ? x[i] : before[i];
        x[i] = mhi_clip(value, mhi_ocp_x_lower(e->ocp, e->n)[i], mhi_ocp_x_upper(e->ocp, e->n)[i]);
    }
}

void mhi_window_follow(mhe_estimator *e) {
    if (e->prepared) {
        return;
    }
    mhi_window_set_bounds(e);
    extend(e);
    if (e->outlier > 0 &&
        mhi_system_markers(mhi_ocp_context(e->ocp), mhi_row(e->solution.x, e->n, e->n_x),
                           e->expected, NULL, NULL) != MHE_OK) {
        memcpy(e->expected, e->no_markers, sizeof(double) * (size_t)(3 * e->n_k));
    }
    e->prepared = 1;
}

void mhi_window_advance(mhe_estimator *e) {
    const int32_t n = e->n;
    shift_rows(e->times, n + 1, 1);
    shift_rows(e->markers, n + 1, 3 * e->n_k);
    shift_rows(e->trusted, n + 1, 3 * e->n_k);
    shift_rows(e->angles, n + 1, e->n_q);
    shift_rows(e->emg, n + 1, e->n_m);
    e->filled--;
    e->prepared = 0;
    mhe_solution *s = &e->solution;
    shift_rows(s->x, n + 1, e->n_x);
    shift_rows(s->zx_lower, n + 1, e->n_x);
    shift_rows(s->zx_upper, n + 1, e->n_x);
    shift_rows(s->u, n, e->n_u);
    shift_rows(s->zu_lower, n, e->n_u);
    shift_rows(s->zu_upper, n, e->n_u);
    shift_rows(s->lambda, n, e->n_x);
    mhi_ocp_shift(e->ocp);
}
