/* SPDX-License-Identifier: Apache-2.0 */
/* window.c: the moving window: targets, bounds, warm start, solve (Algorithm 1 of Bailly et al.
 * 2021). */
#include "estimator/estimator_private.h"

#include <math.h>
#include <string.h>

/* The first window, see solve_first(). */
#define FIRST_SOLVES 10    /* at most */
#define FIRST_WEIGHT 100.0 /* of the proximal term on velocities and activations */
#define FIRST_MOVE 0.02    /* 1, rad/s: so near to its centre the term no longer matters */

/* An unfinished iterate is handed out only if it is a motion of the model: largest jump between
 * intervals that may remain, rad, rad/s, 1. Else its states would start the next window and the
 * error would stay. */
#define CONSISTENT 1e-2

static void *row(double *array, int32_t k, int32_t width) {
    return array + (ptrdiff_t)k * width;
}

void mhi_window_append(mhe_estimator *e, double time, const double *markers, const double *emg) {
    const int32_t k = e->filled++;
    e->times[k] = time;
    memcpy(row(e->markers, k, 3 * e->n_k), markers, sizeof(double) * (size_t)(3 * e->n_k));
    memcpy(row(e->emg, k, e->n_m), emg, sizeof(double) * (size_t)e->n_m);
}

/* Drops the first of n rows of an array, keeping the last one twice. */
static void shift_rows(double *array, int32_t n, int32_t width) {
    memmove(array, array + width, sizeof(double) * (size_t)(n - 1) * (size_t)width);
}

static double clip(double value, double lower, double upper) {
    return fmin(fmax(value, lower), upper);
}

/* General bounds of every node: coordinate ranges, velocities, activations, controls. */
static void set_bounds(mhe_estimator *e) {
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
            mhi_ocp_u_lower(e->ocp, k)[i] = i < e->n_m ? low : -b->residual_torque_max;
            mhi_ocp_u_upper(e->ocp, k)[i] = i < e->n_m ? high : b->residual_torque_max;
        }
    }
}

/* First window: q and qdot near what is known, where something is. */
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
            const double centre = clip(known[part], lower[j], upper[j]);
            lower[j] = fmax(lower[j], centre - width);
            upper[j] = fmin(upper[j], centre + width);
        }
    }
}

static void fix_first_state(mhe_estimator *e) {
    const size_t bytes = sizeof(double) * (size_t)e->n_x;
    memcpy(mhi_ocp_x_lower(e->ocp, 0), e->solution.x, bytes);
    memcpy(mhi_ocp_x_upper(e->ocp, 0), e->solution.x, bytes);
}

static void set_targets(mhe_estimator *e) {
    const int32_t control = e->n_x > 2 * e->n_q ? MHI_SIGNAL_EXCITATION : MHI_SIGNAL_ACTIVATION;
    for (int32_t k = 0; k <= e->n; k++) {
        mhi_ocp_set_time(e->ocp, k, e->times[k]);
        double *markers = mhi_ocp_target(e->ocp, MHI_SIGNAL_MARKERS, k);
        double *controls = mhi_ocp_target(e->ocp, control, k);
        if (markers != NULL) {
            memcpy(markers, row(e->markers, k, 3 * e->n_k), sizeof(double) * (size_t)(3 * e->n_k));
        }
        if (controls != NULL) {
            memcpy(controls, row(e->emg, k, e->n_m), sizeof(double) * (size_t)e->n_m);
        }
    }
}

/* Muscle controls of node k to start from: the EMG where there is one. */
static void guess_controls(mhe_estimator *e, int32_t k, double *a) {
    const double *emg = row(e->emg, k, e->n_m);
    for (int32_t i = 0; i < e->n_m; i++) {
        a[i] = clip(isnan(emg[i]) ? 0.1 : emg[i], e->run->bounds.activation_min + 0.01,
                    e->run->bounds.activation_max - 0.01);
    }
}

/* Inverse kinematics node by node, velocities by differences, activations from the EMG. */
static mhe_status guess_first_window(mhe_estimator *e, mhe_error *err) {
    double nearest = INFINITY, rms = 0;
    double *q = e->out_q; /* free as scratch before the first estimate */
    int32_t n_seen = 0;
    for (int32_t i = 0; i < e->n_q; i++) {
        q[i] = isnan(e->start_q[i]) ? e->description->coordinates[i].value : e->start_q[i];
    }
    for (int32_t k = 0; k <= e->n; k++) {
        mhe_status status = (n_seen == 0 ? mhi_start_search : mhi_start_posture)(
            e->start, row(e->markers, k, 3 * e->n_k), q, &rms, err);
        if (status != MHE_OK) {
            return status;
        }
        n_seen += !isnan(rms);
        nearest = fmin(nearest, rms);
        memcpy(row(e->solution.x, k, e->n_x), q, sizeof(double) * (size_t)e->n_q);
    }
    if (n_seen > 0 && nearest > 1.0) {
        return mhe_fail(
            err, MHE_E_INPUT,
            "the markers do not fit the model within a metre (%.3g m at best): is their unit "
            "right, and is this the model of that person?",
            nearest);
    }
    for (int32_t k = 0; k <= e->n; k++) {
        double *x = row(e->solution.x, k, e->n_x);
        const int32_t from = k == 0 ? 0 : k - 1, to = k == e->n ? k : k + 1;
        const double *before = row(e->solution.x, from, e->n_x);
        const double *after = row(e->solution.x, to, e->n_x);
        for (int32_t i = 0; i < e->n_q; i++) {
            x[e->n_q + i] = (after[i] - before[i]) / (e->times[to] - e->times[from]);
        }
        if (e->n_x > 2 * e->n_q) {
            guess_controls(e, k, x + 2 * e->n_q);
        }
        if (k < e->n) {
            double *u = row(e->solution.u, k, e->n_u);
            guess_controls(e, k, u);
            memset(u + e->n_m, 0, sizeof(double) * (size_t)e->n_r);
        }
    }
    e->solution.has_multipliers = 0;
    return MHE_OK;
}

mhe_status mhi_window_prepare(mhe_estimator *e, mhe_error *err) {
    mhe_status status = MHE_OK;
    set_targets(e);
    if (e->solved == 0) {
        mhi_ocp_set_interval(e->ocp, (e->times[e->n] - e->times[0]) / e->n);
        set_bounds(e);
        bound_first_state(e);
        status = guess_first_window(e, err);
    } else {
        fix_first_state(e);
    }
    memcpy(e->guess_x, e->solution.x, sizeof(double) * (size_t)(e->n + 1) * (size_t)e->n_x);
    memcpy(e->guess_u, e->solution.u, sizeof(double) * (size_t)e->n * (size_t)e->n_u);
    return status;
}

static int all_finite(const double *values, ptrdiff_t n) {
    for (ptrdiff_t i = 0; i < n; i++) {
        if (!isfinite(values[i])) {
            return 0;
        }
    }
    return 1;
}

/* The model's own prediction from the first state under the guessed controls. */
static void predict(mhe_estimator *e) {
    memcpy(e->solution.x, e->guess_x, sizeof(double) * (size_t)(e->n + 1) * (size_t)e->n_x);
    memcpy(e->solution.u, e->guess_u, sizeof(double) * (size_t)e->n * (size_t)e->n_u);
    for (int32_t k = 0; k < e->n; k++) {
        double *next = row(e->solution.x, k + 1, e->n_x);
        mhe_status status = mhi_ocp_predict(e->ocp, row(e->solution.x, k, e->n_x),
                                            row(e->solution.u, k, e->n_u), next, NULL);
        if (status != MHE_OK || !all_finite(next, e->n_x)) {
            memcpy(next, row(e->guess_x, k + 1, e->n_x), sizeof(double) * (size_t)e->n_x);
        }
    }
    e->solution.has_multipliers = 0;
}

static mhe_status solve_once(mhe_estimator *e, mhe_solve_info *info, mhe_error *err) {
    *info = (mhe_solve_info){.size = sizeof *info};
    return e->solver->solve(e->solver_self, NULL, &e->solution, info, err);
}

/* Largest change of a velocity or activation of the first state. */
static double first_state_move(const mhe_estimator *e, const double *before) {
    double move = 0;
    for (int32_t i = e->n_q; i < e->n_x; i++) {
        move = fmax(move, fabs(e->solution.x[i] - before[i]));
    }
    return move;
}

/* With its first state free the window hardly determines the first activations: full Gauss-Newton
 * steps then run to and fro. A proximal term, whose centre follows the solution until both agree,
 * makes each solve well posed and vanishes from the last (proximal point method: Rockafellar 1976,
 * doi:10.1137/0314056). */
static mhe_status solve_first(mhe_estimator *e, mhe_solve_info *info, mhe_error *err) {
    double *weight = e->prior_weight, *centre = e->prior_centre;
    mhe_status status = MHE_OK;
    int32_t iterations = 0;
    for (int32_t i = e->n_q; i < e->n_x; i++) {
        weight[i] = FIRST_WEIGHT;
    }
    for (int32_t round = 0; round < FIRST_SOLVES && status == MHE_OK; round++) {
        memcpy(centre, e->solution.x, sizeof(double) * (size_t)e->n_x);
        mhi_ocp_set_prior(e->ocp, centre, weight);
        status = solve_once(e, info, err);
        iterations += info->iterations;
        if (status == MHE_OK && info->outcome == MHE_SOLVE_CONVERGED) {
            if (first_state_move(e, centre) < FIRST_MOVE) {
                break;
            }
        } else {
            for (int32_t i = e->n_q; i < e->n_x; i++) {
                weight[i] *= 10;
            }
        }
    }
    memset(weight, 0, sizeof(double) * (size_t)e->n_x);
    mhi_ocp_set_prior(e->ocp, centre, weight);
    info->iterations = iterations;
    return status;
}

/* A solver that cannot compute at all (its linear solver is not installed) does so at every frame:
 * it is told once. */
static void tell_failure(mhe_estimator *e, const char *why) {
    if (!e->failure_told) {
        char line[MHE_ERROR_TEXT + 64];
        (void)snprintf(line, sizeof line, "%s: from %g s on: %s", e->run->solver.plugin->id,
                       e->times[0], why);
        e->host->log(e->host, MHE_LOG_WARNING, line);
        e->failure_told = 1;
    }
}

void mhi_window_solve(mhe_estimator *e, mhe_solve_info *info, int32_t *frame_status) {
    mhe_error why = {0};
    const mhe_status status = (e->solved == 0 ? solve_first : solve_once)(e, info, &why);
    if (status != MHE_OK) {
        tell_failure(e, why.text);
    }
    const int usable = status == MHE_OK && info->primal_residual <= CONSISTENT &&
                       all_finite(e->solution.x, (ptrdiff_t)(e->n + 1) * e->n_x) &&
                       all_finite(e->solution.u, (ptrdiff_t)e->n * e->n_u);
    if (usable && info->outcome == MHE_SOLVE_CONVERGED) {
        *frame_status = MHE_FRAME_OK;
    } else if (usable && info->outcome == MHE_SOLVE_ITERATION_LIMIT) {
        *frame_status = MHE_FRAME_ITERATION_LIMIT;
    } else if (usable && info->outcome == MHE_SOLVE_DEADLINE) {
        *frame_status = MHE_FRAME_DEADLINE;
    } else {
        predict(e);
        *frame_status = MHE_FRAME_PREDICTED;
    }
    e->solved++;
}

void mhi_window_advance(mhe_estimator *e) {
    const int32_t n = e->n;
    shift_rows(e->times, n + 1, 1);
    shift_rows(e->markers, n + 1, 3 * e->n_k);
    shift_rows(e->emg, n + 1, e->n_m);
    e->filled--;
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
