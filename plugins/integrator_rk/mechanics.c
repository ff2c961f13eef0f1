/* SPDX-License-Identifier: Apache-2.0 */
/* mechanics.c: the stage accelerations of one step, and the derivatives of the step.
 *
 * Implicit schemes: one evaluation with derivatives at the start of the step gives a predictor, the
 * stages of the system linearised there. Simplified Newton iterations follow, on the Jacobian of
 * the middle stage (a hundredth to a thousandth of the error is left by each); where they are slow
 * the Jacobian is taken anew at all stages, and where that fails too rk_step halves the step. If
 * derivatives are wanted, a last evaluation with derivatives at the converged stages serves both a
 * last full Newton correction and the implicit function theorem. */
#include "lapack.h"
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

/* Stage position and velocity from the stage accelerations. */
static void rk_stage(struct rk_context *c, double h, int32_t j) {
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

/* f at stage j, with its derivatives if wanted. */
static mhe_status rk_evaluate(struct rk_context *c, const double *r, double h, int32_t j,
                              int32_t derivatives, mhe_error *err) {
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q, n_m = system->n_m, n_r = system->n_r;
    mhe_acceleration out = {.size = sizeof out, .vdot = c->f + j * n_q};
    if (derivatives) {
        out.vdot_q = c->f_q + j * n_q * n_q;
        out.vdot_v = c->f_v + j * n_q * n_q;
        out.vdot_a = c->f_a + j * n_q * n_m;
        out.vdot_r = n_r > 0 ? c->f_r + j * n_q * n_r : NULL;
    }
    rk_stage(c, h, j);
    return system->acceleration(system, c->system_context, c->stage_q, c->stage_v,
                                c->stage_a + j * n_m, r, &out, err);
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

/* LU of I - h^2 (A A) f_q - h A f_v; `only` is the stage whose derivatives serve all, -1: each its
 * own. Row-major: to LAPACK it is the transpose. */
static mhe_status rk_factor(struct rk_context *c, double h, int32_t only, mhe_error *err) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_q = c->rk->system->n_q, s = t->stages, n = s * n_q, info = 0;
    for (int32_t j = 0; j < s; j++) {
        int32_t from = (only < 0 ? j : only) * n_q * n_q;
        const double *f_q = c->f_q + from, *f_v = c->f_v + from;
        for (int32_t k = 0; k < s; k++) {
            double by_q = h * h * t->AA[j * s + k], by_v = h * t->A[j * s + k];
            for (int32_t i = 0; i < n_q; i++) {
                double *row = c->jacobian + (j * n_q + i) * n + k * n_q;
                for (int32_t m = 0; m < n_q; m++) {
                    row[m] = -by_q * f_q[i * n_q + m] - by_v * f_v[i * n_q + m];
                }
                row[i] += j == k ? 1.0 : 0.0;
            }
        }
    }
    dgetrf_(&n, &n, c->jacobian, &n, c->pivots, &info);
    return info == 0 ? MHE_OK
                     : mhe_fail(err, MHE_RETRY, "a stage system over %g s has no solution", h);
}

/* Adds the solution of J x = residual to K. Returns its size as a velocity, in units of 1 + |v|;
 * NaN where it has none. */
static double rk_correct(struct rk_context *c, double h) {
    int32_t n_q = c->rk->system->n_q, n = c->rk->mechanics.stages * n_q, one = 1, info = 0;
    dgetrs_("T", &n, &one, c->jacobian, &n, c->pivots, c->residual, &n, &info);
    double largest = 0, speed = 0;
    for (int32_t i = 0; i < n; i++) {
        if (!isfinite(c->residual[i])) {
            return NAN;
        }
        largest = fmax(largest, fabs(c->residual[i]));
        c->K[i] += c->residual[i];
    }
    for (int32_t i = 0; i < n_q; i++) {
        speed = fmax(speed, fabs(c->v[i]));
    }
    return h * largest / (1 + speed);
}

/* Stage accelerations of the system linearised at the start of the step, from one evaluation there;
 * leaves its Jacobian factored. */
static mhe_status rk_predict(struct rk_context *c, const double *r, double h, mhe_error *err) {
    const struct rk_tableau *t = &c->rk->mechanics;
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q, n_m = system->n_m;
    const mhe_acceleration out = {
        .size = sizeof out, .vdot = c->f, .vdot_q = c->f_q, .vdot_v = c->f_v, .vdot_a = c->f_a};
    mhe_status status =
        system->acceleration(system, c->system_context, c->q, c->v, c->a_start, r, &out, err);
    if (status == MHE_OK) {
        status = rk_factor(c, h, 0, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    for (int32_t j = 0; j < t->stages; j++) {
        memcpy(c->K + j * n_q, c->f, sizeof(double) * (size_t)n_q);
    }
    for (int32_t j = 0; j < t->stages; j++) {
        const double *a = c->stage_a + j * n_m;
        rk_stage(c, h, j);
        for (int32_t i = 0; i < n_q; i++) {
            double sum = 0;
            for (int32_t m = 0; m < n_q; m++) {
                sum += c->f_q[i * n_q + m] * (c->stage_q[m] - c->q[m]) +
                       c->f_v[i * n_q + m] * (c->stage_v[m] - c->v[m]);
            }
            for (int32_t m = 0; m < n_m; m++) {
                sum += c->f_a[i * n_m + m] * (a[m] - c->a_start[m]);
            }
            c->residual[j * n_q + i] = sum;
        }
    }
    (void)rk_correct(c, h);
    return MHE_OK;
}

/* One iteration, with a new Jacobian or the one in place; `change` is the size of the correction.
 */
static mhe_status rk_iterate(struct rk_context *c, const double *r, double h, int jacobian,
                             double *change, mhe_error *err) {
    int32_t s = c->rk->mechanics.stages, n = s * c->rk->system->n_q;
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
    *change = rk_correct(c, h);
    return isfinite(*change) ? MHE_OK
                             : mhe_fail(err, MHE_RETRY, "a step of %g s left the finite", h);
}

/* Iterates until the error left in the stages is estimated below `goal`. */
static mhe_status rk_newton(struct rk_context *c, const double *r, double h, double goal,
                            mhe_error *err) {
    double change = 0, last = 0, shrink = 1;
    int jacobian = RK_JACOBIAN_MIDDLE; /* nearer to all stages than the start's */
    for (int32_t iteration = 0; iteration < c->rk->config.max_newton; iteration++) {
        mhe_status status = rk_iterate(c, r, h, jacobian, &change, err);
        if (status != MHE_OK) {
            return status;
        }
        shrink = iteration > 0 && last > 0 ? change / last : 1;
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

/* Stages of an implicit scheme. */
static mhe_status rk_implicit(struct rk_context *c, const double *r, double h, int32_t derivatives,
                              mhe_error *err) {
    double tolerance = c->rk->config.newton_tolerance, change = INFINITY;
    mhe_status status = rk_predict(c, r, h, err);
    if (status == MHE_OK) {
        status = rk_newton(c, r, h, derivatives ? fmax(tolerance, RK_BEFORE_LAST) : tolerance, err);
    }
    for (int32_t i = 0; derivatives && status == MHE_OK && !(change < RK_LAST); i++) {
        if (i == RK_LAST_ROUNDS) {
            return mhe_fail(err, MHE_RETRY, "no stages found for a step of %g s", h);
        }
        status = rk_iterate(c, r, h, RK_JACOBIAN_ALL, &change, err);
    }
    return status;
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
        memcpy(c->K + j * n_q, c->f + j * n_q, sizeof(double) * (size_t)n_q);
    }
    return derivatives ? rk_factor(c, h, -1, err) : MHE_OK;
}

mhe_status rk_mechanics(struct rk_context *c, const double *r, double h, int32_t derivatives,
                        mhe_error *err) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_q = c->rk->system->n_q;
    mhe_status status = (t->is_explicit ? rk_explicit : rk_implicit)(c, r, h, derivatives, err);
    if (status != MHE_OK) {
        return status;
    }
    if (derivatives) {
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
    return MHE_OK;
}
