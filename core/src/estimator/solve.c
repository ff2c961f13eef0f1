/* SPDX-License-Identifier: Apache-2.0 */
/* solve.c: solves a prepared window within its time, and says what came of it. */
#include "estimator/estimator_private.h"

#include "base/clock.h"
#include "base/values.h"

#include <stdio.h>
#include <string.h>

/* A window that begins, see settle(). */
#define FIRST_SOLVES 10    /* at most */
#define FIRST_WEIGHT 100.0 /* of the proximal term on velocities and activations */
#define FIRST_STEPS 10     /* iterations after which a motion cut short will do */
#define FIRST_MOVE 0.02    /* 1, rad/s: so near to its centre the term no longer matters */

/* An unfinished iterate is handed out only if something was done to it and it is a motion of the
 * model: largest jump between intervals that may remain, rad, rad/s, 1. Else its states would start
 * the next window and the error would stay. */
#define CONSISTENT 1e-2
#define ROUGHLY 10 /* times that: near enough for the steps of a settled window to close it */

static void take_back_guess(mhe_estimator *e) {
    memcpy(e->window.solution.x, e->window.guess_x,
           sizeof(double) * (size_t)(e->window.n + 1) * (size_t)e->window.n_x);
    memcpy(e->window.solution.u, e->window.guess_u,
           sizeof(double) * (size_t)e->window.n * (size_t)e->n_u);
    e->window.solution.has_multipliers = 0;
}

/* The model's own prediction from the first state under the guessed controls; where there is no
 * time left for it, the guess, which is the last solution or prediction moved on. */
static void predict(mhe_estimator *e) {
    int32_t late = mhi_pace_by_clock(e) && mhi_pace_over(e);
    take_back_guess(e);
    const mhi_window *w = &e->window;
    mhe_solution *s = &e->window.solution;
    memset(s->lambda, 0, sizeof(double) * (size_t)w->n * (size_t)w->n_x);
    memset(s->zx_lower, 0, sizeof(double) * (size_t)(w->n + 1) * (size_t)w->n_x);
    memset(s->zx_upper, 0, sizeof(double) * (size_t)(w->n + 1) * (size_t)w->n_x);
    memset(s->zu_lower, 0, sizeof(double) * (size_t)w->n * (size_t)e->n_u);
    memset(s->zu_upper, 0, sizeof(double) * (size_t)w->n * (size_t)e->n_u);
    s->has_multipliers = 1; /* it is near, if it is a motion: the next window's start */
    mhi_pace_predict(e);
    for (int32_t k = 0; k < e->window.n && !late; k++) {
        double *next = mhi_row(e->window.solution.x, k + 1, e->window.n_x);
        mhi_pace_tick(e);
        mhe_status status =
            mhi_ocp_predict(e->ocp, k, mhi_row(e->window.solution.x, k, e->window.n_x),
                            mhi_row(e->window.solution.u, k, e->n_u), next, NULL);
        if (status != MHE_OK || !mhi_all_finite(next, e->window.n_x)) {
            memcpy(next, mhi_row(e->window.guess_x, k + 1, e->window.n_x),
                   sizeof(double) * (size_t)e->window.n_x);
        }
    }
}

static mhe_status solve_once(mhe_estimator *e, mhe_solve_info *info, mhe_error *err) {
    const int32_t timed = mhi_pace_by_clock(e);
    const mhe_solve_control control = {
        .size = sizeof control,
        .deadline = timed && !e->pace.looks.obeys ? e->pace.arrival + e->pace.budget : 0,
        .budget = e,
        .spent = mhi_pace_spent,
        .late = timed ? mhi_pace_late : NULL,
        .one_step = !mhi_phase_settled(e) && e->begin.by_steps};
    *info = (mhe_solve_info){.size = sizeof *info};
    return e->solver->solve(e->solver_self, &control, &e->window.solution, info, err);
}

/* What a number of a block counts as, for the prior: velocities and activations as they are, what
 * muscles have more by its usual size; 0: positions, which the markers hold. */
static double prior_unit(const mhe_block *block, int32_t i) {
    if (strcmp(block->name, "q") == 0) {
        return 0;
    }
    const int32_t more = strcmp(block->name, "qdot") != 0 && strcmp(block->name, "activation") != 0;
    return more ? 1 / block->scale[i] : 1;
}

/* Largest change of what the prior holds of the first state. */
static double first_state_move(const mhe_estimator *e, const double *before) {
    const mhe_layout *layout = mhi_ocp_problem(e->ocp)->layout;
    double move = 0;
    for (int32_t b = 0; b < layout->n_blocks; b++) {
        const mhe_block *block = mhe_layout_at(layout, b);
        for (int32_t i = 0; i < block->count && block->role == MHE_ROLE_STATE; i++) {
            const int32_t at = block->first + i;
            const double change = fabs(e->window.solution.x[at] - before[at]);
            move = fmax(move, prior_unit(block, i) * change);
        }
    }
    return move;
}

static void set_proximal_weight(mhe_estimator *e, double factor) {
    const mhe_layout *layout = mhi_ocp_problem(e->ocp)->layout;
    for (int32_t b = 0; b < layout->n_blocks; b++) {
        const mhe_block *block = mhe_layout_at(layout, b);
        for (int32_t i = 0; i < block->count && block->role == MHE_ROLE_STATE; i++) {
            double *weight = &e->window.prior_weight[block->first + i];
            const double unit = prior_unit(block, i);
            *weight = factor == 0            ? 0
                      : e->begin.rounds == 0 ? FIRST_WEIGHT * unit * unit
                                             : factor * *weight;
        }
    }
    mhi_ocp_set_prior(e->ocp, e->window.prior_centre, e->window.prior_weight);
}

/* With its first state free the window hardly determines the first activations: full Gauss-Newton
 * steps then run to and fro. A proximal term, whose centre follows the solution until both agree,
 * makes each solve well posed and vanishes from the last (proximal point method: Rockafellar 1976,
 * doi:10.1137/0314056). Where the time is over before, the next frame's window goes on from there,
 * its first state still free: so the deadline holds for these frames, too. */
static mhe_status settle(mhe_estimator *e, mhe_solve_info *info, mhe_error *err) {
    mhe_status status = MHE_OK;
    int32_t iterations = 0, programs = 0, fallbacks = 0, cut = 0;
    double factor = 1, evaluation_time = 0;
    while (!mhi_phase_settled(e) && !cut && status == MHE_OK) {
        memcpy(e->window.prior_centre, e->window.solution.x,
               sizeof(double) * (size_t)e->window.n_x);
        set_proximal_weight(e, factor);
        status = solve_once(e, info, err);
        iterations += info->iterations;
        programs += info->programs;
        fallbacks += info->fallbacks;
        evaluation_time += info->evaluation_time;
        const int32_t converged = status == MHE_OK && info->outcome == MHE_SOLVE_CONVERGED;
        const int32_t over = status == MHE_OK && (info->outcome == MHE_SOLVE_DEADLINE ||
                                                  (!converged && mhi_pace_over(e)));
        /* A motion that came of steps, though not of all: the frames after it go on from it. */
        const int32_t moved = info->iterations > 0 && info->primal_residual <= ROUGHLY * CONSISTENT;
        e->begin.steps += info->iterations;
        e->begin.rounds += over ? moved : 1;
        factor = converged || over || e->begin.by_steps ? 1 : 10;
        cut = over || e->begin.by_steps || mhi_pace_over(e);
        if ((converged && first_state_move(e, e->window.prior_centre) < FIRST_MOVE) ||
            (over && moved && e->begin.steps >= FIRST_STEPS) || e->begin.rounds >= FIRST_SOLVES ||
            status != MHE_OK) {
            mhi_phase_on(e, MHI_EVENT_SETTLED);
        }
    }
    if (cut && !mhi_phase_settled(e) && info->outcome <= MHE_SOLVE_ITERATION_LIMIT) {
        info->outcome = MHE_SOLVE_DEADLINE; /* of what is not yet the last round */
    }
    if (mhi_phase_settled(e)) {
        set_proximal_weight(e, 0);
    }
    info->iterations = iterations;
    info->programs = programs;
    info->fallbacks = fallbacks;
    info->evaluation_time = evaluation_time;
    return status;
}

/* A solver that cannot compute at all (its linear solver is not installed) does so at every frame:
 * it is told once. */
static void tell_failure(mhe_estimator *e, const char *why) {
    if (!e->failure_told) {
        char line[MHE_ERROR_TEXT + 64];
        (void)snprintf(line, sizeof line, "%s: from %g s on: %s", e->run->solver.plugin->id,
                       e->window.times[0], why);
        e->host->log(e->host, MHE_LOG_WARNING, line);
        e->failure_told = 1;
    }
}

static int32_t status_of(const mhe_estimator *e, int32_t outcome) {
    switch (outcome) {
    case MHE_SOLVE_CONVERGED:
        return e->begin.restarted ? MHE_FRAME_RESTARTED : MHE_FRAME_OK;
    case MHE_SOLVE_ITERATION_LIMIT:
        return e->begin.restarted ? MHE_FRAME_RESTARTED : MHE_FRAME_ITERATION_LIMIT;
    case MHE_SOLVE_DEADLINE:
        return e->begin.restarted     ? MHE_FRAME_RESTARTED
               : mhi_pace_by_clock(e) ? MHE_FRAME_DEADLINE
                                      : MHE_FRAME_ITERATION_LIMIT;
    default:
        return MHE_FRAME_PREDICTED;
    }
}

mhe_status mhi_window_solve(mhe_estimator *e, mhe_solve_info *info, int32_t *frame_status,
                            mhe_error *err) {
    mhe_error why = {0};
    memcpy(e->window.guess_x, e->window.solution.x,
           sizeof(double) * (size_t)(e->window.n + 1) * (size_t)e->window.n_x);
    memcpy(e->window.guess_u, e->window.solution.u,
           sizeof(double) * (size_t)e->window.n * (size_t)e->n_u);
    const int32_t begins = !mhi_phase_settled(e);
    const mhe_status status = (begins ? settle : solve_once)(e, info, &why);
    if (e->stop != NULL && atomic_load_explicit(e->stop, memory_order_relaxed)) {
        return mhe_fail(err, MHE_E_INTERRUPTED, "interrupted");
    }
    if (status != MHE_OK) {
        tell_failure(e, why.text);
    }
    const int32_t none =
        !mhi_phase_settled(e) && info->outcome == MHE_SOLVE_DEADLINE && info->iterations == 0;
    e->begin.stuck = none ? e->begin.stuck + 1 : 0;
    e->begin.by_steps |= none;
    const int finite =
        mhi_all_finite(e->window.solution.x, (ptrdiff_t)(e->window.n + 1) * e->window.n_x) &&
        mhi_all_finite(e->window.solution.u, (ptrdiff_t)e->window.n * e->n_u);
    const int begun = info->iterations > 0 || info->outcome == MHE_SOLVE_CONVERGED;
    const int usable = status == MHE_OK && finite && begun && info->primal_residual <= CONSISTENT;
    const int rough = status == MHE_OK && finite && info->primal_residual <= ROUGHLY * CONSISTENT;
    *frame_status = usable ? status_of(e, info->outcome) : MHE_FRAME_PREDICTED;
    mhi_unmet_solved(e, *frame_status == MHE_FRAME_PREDICTED && finite);
    if (*frame_status != MHE_FRAME_PREDICTED) {
        e->begin.restarted = 0;
    } else if (mhi_phase_settled(e) && !(begins && rough)) {
        predict(e);
    } else if (!finite) { /* else what was reached in the time starts the next frame's solve */
        take_back_guess(e);
    }
    e->window.solved++;
    return MHE_OK;
}
