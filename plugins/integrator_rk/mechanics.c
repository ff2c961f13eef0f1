/* SPDX-License-Identifier: Apache-2.0 */
/* mechanics.c: the stage accelerations of one step, and the derivatives of the step.
 *
 * Implicit schemes: one evaluation with derivatives at the start of the step gives a predictor, the
 * stages of the system linearised there. Simplified Newton iterations follow, on the Jacobian of
 * the middle stage (a hundredth to a thousandth of the error is left by each); where they are slow
 * the Jacobian is taken anew at all stages, and where that fails too refine.c halves the step. If
 * derivatives are wanted, a last evaluation with derivatives at the converged stages serves both a
 * last full Newton correction and the implicit function theorem.
 *
 * With a memory the start is the step as it was linearised last, moved to first order by what its
 * data have changed: one solve. What that leaves grows with the square of the move. With
 * derivatives wanted, full Newton iterations follow (between neighbouring iterates of an estimator
 * one, seldom two; behind a long move a simplified one goes first, which costs no derivatives),
 * else simplified ones on the factors that are there. A step that has not moved is linearised
 * already.
 *
 * States z of the muscles are stages beside the accelerations (states.c). They are too stiff for
 * one Jacobian to serve several stages: each iteration that takes a new one takes all. */
#include "rk.h"

#include <math.h>
#include <string.h>

/* A correction that shrinks the last by less than this makes a new Jacobian worth its price. */
#define RK_SLOW 0.25
/* A stalled iteration (a kink inside the step) is accepted below this. */
#define RK_STALLED 1e-7
/* Error left in the stages before, and largest size of, the last full correction: what it leaves is
 * of the order of its square, and the derivatives belong to stages that are off by no more. */
#define RK_BEFORE_LAST 1e-6
#define RK_LAST 1e-5
#define RK_LAST_ROUNDS 3
/* A move from the memory leaves about this, times its square (the arms here: 0.007 to 0.02). */
#define RK_BENT 0.02
/* Below this a step has not moved: its derivatives are off by as much. */
#define RK_UNMOVED 1e-9

void rk_stage(struct rk_context *c, double h, int32_t j) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_q = c->rk->system->n_q, s = t->stages;
    int32_t known = t->is_explicit ? j : s;
    for (int32_t i = 0; i < n_q; i++) {
        double dv = 0, dq = 0;
        for (int32_t k = 0; k < known; k++) {
            dv += t->A[j * s + k] * c->K[k * n_q + i];
            dq += t->AA[j * s + k] * c->K[k * n_q + i];
        }
        c->stage_v[i] = c->v[i] + h * dv;
        c->stage_q[i] = c->q[i] + h * (t->c[j] * c->v[i] + h * dq);
    }
}

mhe_status rk_accelerate(const struct rk_context *c, const double *q, const double *v,
                         const double *a, const double *z, const double *r,
                         const mhe_acceleration *out, mhe_error *err) {
    const mhe_system *system = c->rk->system;
    const mhe_system_point at = {.size = sizeof at,
                                 .q = q,
                                 .v = v,
                                 .a = system->n_a > 0 ? a : NULL,
                                 .z = z,
                                 .c = c->u,
                                 .r = r,
                                 .w = c->w};
    return system->acceleration(system, c->system_context, &at, out, err);
}

/* f at stage j, with its derivatives if wanted. */
static mhe_status rk_evaluate(struct rk_context *c, const double *r, double h, int32_t j,
                              int32_t derivatives, mhe_error *err) {
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q, n_m = system->n_m, n_r = system->n_r, n_z = system->n_z;
    int32_t n_p = system->n_p;
    mhe_acceleration out = {.size = sizeof out, .vdot = c->f + j * n_q};
    if (derivatives) {
        out.vdot_q = c->at->f_q + j * n_q * n_q;
        out.vdot_v = c->at->f_v + j * n_q * n_q;
        out.vdot_a = c->at->f_a + j * n_q * n_m;
        out.vdot_r = n_r > 0 ? c->at->f_r + j * n_q * n_r : NULL;
        out.vdot_p = n_p > 0 ? c->at->f_p + j * n_q * n_p : NULL;
    }
    rk_stage(c, h, j);
    if (n_z == 0) {
        return rk_accelerate(c, c->stage_q, c->stage_v, c->stage_a + j * n_m, NULL, r, &out, err);
    }
    out.zdot = c->H + j * n_z;
    if (derivatives) {
        out.vdot_a = system->n_a > 0 ? out.vdot_a : NULL;
        out.vdot_z = c->at->f_z + j * n_q * n_z;
        out.zdot_q = c->at->h_q + j * n_z * n_q;
        out.zdot_v = c->at->h_v + j * n_z * n_q;
        out.zdot_a = system->n_a > 0 ? c->at->h_a + j * n_z : NULL;
        out.zdot_c = c->at->h_c + j * n_z;
        out.zdot_z = c->at->h_z + j * n_z * system->n_k;
        out.zdot_p = n_p > 0 ? c->at->h_p + j * n_z * n_p : NULL;
    }
    return rk_accelerate(c, c->stage_q, c->stage_v, c->stage_a + j * n_m, c->Z + j * n_z, r, &out,
                         err);
}

/* Where an iteration takes its Jacobian from. */
enum { RK_JACOBIAN_KEPT, RK_JACOBIAN_MIDDLE, RK_JACOBIAN_ALL };

static mhe_status rk_evaluate_all(struct rk_context *c, const double *r, double h, int jacobian,
                                  mhe_error *err) {
    int32_t s = c->rk->mechanics.stages;
    mhe_status status = MHE_OK;
    for (int32_t j = 0; j < s && status == MHE_OK; j++) {
        int32_t derivatives =
            jacobian == RK_JACOBIAN_ALL || (jacobian == RK_JACOBIAN_MIDDLE && j == s / 2);
        status = rk_evaluate(c, r, h, j, derivatives, err);
    }
    return status;
}

mhe_status rk_factor(struct rk_context *c, double h, int32_t only, mhe_error *err) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_q = c->rk->system->n_q, s = t->stages, n = s * n_q;
    for (int32_t j = 0; j < s; j++) {
        int32_t from = (only < 0 ? j : only) * n_q * n_q;
        const double *f_q = c->at->f_q + from, *f_v = c->at->f_v + from;
        for (int32_t k = 0; k < s; k++) {
            double by_q = h * h * t->AA[j * s + k], by_v = h * t->A[j * s + k];
            for (int32_t i = 0; i < n_q; i++) {
                double *row = c->at->lu + (j * n_q + i) * n + k * n_q;
                for (int32_t m = 0; m < n_q; m++) {
                    row[m] = -by_q * f_q[i * n_q + m] - by_v * f_v[i * n_q + m];
                }
                row[i] += j == k ? 1.0 : 0.0;
            }
        }
    }
    return (c->rk->system->n_z == 0 || rk_states_factor(c, h)) &&
                   rk_lu_factor(c->at->lu, n, c->at->pivots)
               ? MHE_OK
               : mhe_fail(err, MHE_RETRY, "a stage system over %g s has no solution", h);
}

double rk_correct(struct rk_context *c, double h) {
    int32_t n_q = c->rk->system->n_q, n = c->rk->mechanics.stages * n_q;
    int32_t n_z = c->rk->system->n_z;
    rk_lu_solve(c->at->lu, n, c->at->pivots, c->residual);
    double largest = 0, speed = 0, sum = 0, states = n_z > 0 ? rk_states_after(c) : 0;
    for (int32_t i = 0; i < n; i++) {
        double size = fabs(c->residual[i]);
        largest = size > largest ? size : largest;
        sum += size; /* not finite if one is not */
        c->K[i] += c->residual[i];
    }
    if (!isfinite(sum + states)) {
        return NAN;
    }
    for (int32_t i = 0; i < n_q; i++) {
        double size = fabs(c->v[i]);
        speed = size > speed ? size : speed;
    }
    double change = h * largest / (1 + speed);
    return states > change ? states : change;
}

/* One iteration, with a new Jacobian or the one in place; `change` is the size of the correction.
 */
static mhe_status rk_iterate(struct rk_context *c, const double *r, double h, int jacobian,
                             double *change, mhe_error *err) {
    int32_t s = c->rk->mechanics.stages, n = s * c->rk->system->n_q;
    int32_t states = c->rk->system->n_z > 0;
    if (states && jacobian == RK_JACOBIAN_MIDDLE) {
        jacobian = RK_JACOBIAN_ALL;
    }
    if (jacobian != RK_JACOBIAN_KEPT && !c->keeps) {
        c->at = &c->own;
    }
    mhe_status status = rk_evaluate_all(c, r, h, jacobian, err);
    if (status == MHE_OK && jacobian != RK_JACOBIAN_KEPT) {
        status = rk_factor(c, h, jacobian == RK_JACOBIAN_ALL ? -1 : s / 2, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    for (int32_t i = 0; i < n; i++) {
        c->residual[i] = c->f[i] - c->K[i];
    }
    if (states) {
        rk_states_offset(c, h);
        rk_states_before(c);
    }
    *change = rk_correct(c, h);
    return isfinite(*change) ? MHE_OK
                             : mhe_fail(err, MHE_RETRY, "a step of %g s left the finite", h);
}

/* Iterates until the error left in the stages is estimated below `goal`. `shrink`: what the first
 * iteration is known to leave of its correction at most. */
static mhe_status rk_newton(struct rk_context *c, const double *r, double h, int jacobian,
                            double shrink, double goal, mhe_error *err) {
    double change = 0, last = 0;
    for (int32_t iteration = 0; iteration < c->rk->config.max_newton; iteration++) {
        mhe_status status = rk_iterate(c, r, h, jacobian, &change, err);
        if (status != MHE_OK) {
            return status;
        }
        shrink = iteration > 0 ? last > 0 ? change / last : 1 : shrink;
        double left = shrink < 0.5 ? change * shrink / (1 - shrink) : change;
        if (left < goal) {
            return MHE_OK;
        }
        jacobian = iteration > 0 && shrink > RK_SLOW ? RK_JACOBIAN_ALL : RK_JACOBIAN_KEPT;
        last = change;
    }
    return change < RK_STALLED ? MHE_OK
                               : mhe_fail(err, MHE_RETRY, "no stages found for a step of %g s", h);
}

/* Full Newton iterations until one is as small as the derivatives that it leaves behind need. */
static mhe_status rk_linearise(struct rk_context *c, const double *r, double h, mhe_error *err) {
    double change = INFINITY;
    mhe_status status = MHE_OK;
    for (int32_t i = 0; status == MHE_OK && !(change < RK_LAST); i++) {
        if (i == RK_LAST_ROUNDS) {
            return mhe_fail(err, MHE_RETRY, "no stages found for a step of %g s", h);
        }
        status = rk_iterate(c, r, h, RK_JACOBIAN_ALL, &change, err);
    }
    return status;
}

/* Whether the size of the move tells all that can have changed: inputs are compared, parameters
 * have other values without a word. */
static int rk_is_kept_whole(const struct rk_context *c) {
    const mhe_system *system = c->rk->system;
    return system->n_z == 0 && system->n_p == 0 &&
           (system->n_w == 0 || memcmp(c->w, c->kept.w, sizeof(double) * (size_t)system->n_w) == 0);
}

/* Stages behind a move from the memory. The Jacobian there is off by the order of the move, and so
 * is what a simplified iteration leaves. */
static mhe_status rk_move_on(struct rk_context *c, const double *r, double h, double moved,
                             int32_t derivatives, mhe_error *err) {
    double change = 0;
    mhe_status status = MHE_OK;
    if (!derivatives) {
        return rk_newton(c, r, h, RK_JACOBIAN_KEPT, fmin(1, moved), c->rk->config.newton_tolerance,
                         err);
    }
    if (moved < RK_UNMOVED && rk_is_kept_whole(c)) {
        return MHE_OK;
    }
    if (RK_BENT * moved * moved > RK_LAST && c->rk->system->n_z == 0) {
        status = rk_iterate(c, r, h, RK_JACOBIAN_KEPT, &change, err);
    }
    return status == MHE_OK ? rk_linearise(c, r, h, err) : status;
}

/* Stages of an implicit scheme; from nothing where what is known does not lead there. */
static mhe_status rk_implicit(struct rk_context *c, const double *r, double h, int32_t derivatives,
                              mhe_error *err) {
    double tolerance = c->rk->config.newton_tolerance, moved = rk_recall(c, r, h);
    if (isfinite(moved)) {
        mhe_status status = rk_move_on(c, r, h, moved, derivatives, err);
        if (status <= MHE_OK) {
            return status;
        }
    }
    c->at = c->keeps ? &c->kept : &c->own;
    mhe_status status =
        c->rk->system->n_z > 0 ? rk_predict_states(c, r, err) : rk_predict(c, r, h, err);
    if (status == MHE_OK) { /* the middle stage is nearer to all than the start is */
        status = rk_newton(c, r, h, RK_JACOBIAN_MIDDLE, 1,
                           derivatives ? fmax(tolerance, RK_BEFORE_LAST) : tolerance, err);
    }
    return status == MHE_OK && derivatives ? rk_linearise(c, r, h, err) : status;
}

/* Stages of an explicit scheme; its stage equations are factored too where derivatives are wanted.
 */
static mhe_status rk_explicit(struct rk_context *c, const double *r, double h, int32_t derivatives,
                              mhe_error *err) {
    int32_t n_q = c->rk->system->n_q;
    for (int32_t j = 0; j < c->rk->mechanics.stages; j++) {
        mhe_status status = rk_evaluate(c, r, h, j, derivatives, err);
        if (status != MHE_OK) {
            return status;
        }
        for (int32_t i = 0; i < n_q; i++) {
            double f = c->K[j * n_q + i] = c->f[j * n_q + i];
            if (!isfinite(f)) {
                return mhe_fail(err, MHE_RETRY, "a step of %g s left the finite", h);
            }
        }
    }
    return derivatives ? rk_factor(c, h, -1, err) : MHE_OK;
}

mhe_status rk_mechanics(struct rk_context *c, const double *r, double h, int32_t derivatives,
                        mhe_error *err) {
    c->at = &c->own;
    c->keeps = 0;
    if (c->rk->mechanics.is_explicit) {
        return rk_explicit(c, r, h, derivatives, err);
    }
    c->keeps = derivatives && rk_memory_slot(c, &c->kept);
    mhe_status status = rk_implicit(c, r, h, derivatives, err);
    if (c->keeps) {
        if (status == MHE_OK) {
            rk_keep(c, r, h);
        } else {
            *c->kept.step = 0;
        }
    }
    return status;
}

mhe_status rk_advance(struct rk_context *c, double h, int32_t derivatives, mhe_error *err) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_q = c->rk->system->n_q;
    if (derivatives && c->rk->system->n_z > 0) {
        rk_states_chain(c, h);
    } else if (derivatives) {
        rk_chain(c, h);
    }
    for (int32_t i = 0; i < n_q; i++) {
        double dv = 0, dq = 0;
        for (int32_t k = 0; k < t->stages; k++) {
            dv += t->b[k] * c->K[k * n_q + i];
            dq += t->bA[k] * c->K[k * n_q + i];
        }
        c->q[i] += h * (c->v[i] + h * dq);
        c->v[i] += h * dv;
        if (!isfinite(c->q[i]) || !isfinite(c->v[i])) {
            return mhe_fail(err, MHE_RETRY, "a step of %g s left the finite", h);
        }
    }
    if (c->rk->system->n_z > 0 && !rk_states_advance(c)) {
        return mhe_fail(err, MHE_RETRY, "a step of %g s left the finite", h);
    }
    c->step++;
    return MHE_OK;
}
