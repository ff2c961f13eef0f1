/* SPDX-License-Identifier: Apache-2.0 */
/* statics.c: rigid tendons' forces are all but linear in activations, and so are accelerations:
 *
 *     vdot(a, r) = vdot(a0, 0) + J_a (a - a0) + J_r r,
 *
 * and with residual torques everywhere J_r = M^-1, which turns accelerations into moments. What is
 * minimised,
 *
 *     sum (a / SIGMA)^2 + sum ((B (a - a0) - needed)_i / (SHARE |B_i|))^2,   lower <= a <= upper,
 *
 * is so one activation after the other (Gauss-Seidel with bounds), which needs no matrix. */
#include "estimator/statics.h"

#include "base/cholesky.h"

#include <math.h>
#include <string.h>

#define SIGMA 0.3     /* of an activation */
#define SHARE 0.02    /* of the moment of all muscles at once, that may be missed */
#define NOTHING 1e-12 /* of the largest squared moment */
#define SWEEPS 40

mhe_status mhi_statics_create(mhi_statics *s, const mhi_system *system, mhi_arena *arena,
                              mhe_error *err) {
    const mhe_system *face = mhi_system_face(system);
    const mhe_block *block = mhe_layout_find(face->layout, MHE_ROLE_CONTROL, "residual_torque");
    *s = (mhi_statics){
        .system = system,
        .n_q = face->n_q,
        .n_m = face->n_a,
        .n_r = face->n_r,
        .residual = block != NULL && block->count == face->n_q ? block->first - face->n_m : -1,
        .vdot = MHI_TAKE(arena, double, face->n_q),
        .by_a = MHI_TAKE(arena, double, face->n_q * face->n_m),
        .by_r = MHI_TAKE(arena, double, face->n_q * face->n_r),
        .moments = MHI_TAKE(arena, double, face->n_q *(face->n_m + 1)),
        .weight = MHI_TAKE(arena, double, face->n_q)};
    if (!s->vdot || !s->by_a || !s->by_r || !s->moments || !s->weight) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (face->n_z > 0 || face->n_a != face->n_m) {
        s->n_m = 0;
    }
    return MHE_OK;
}

/* [B | needed] into s->moments, from accelerations; 0: done. */
static int moments_of(mhi_statics *s, const double *wanted) {
    const int32_t n = s->n_m + 1;
    for (int32_t i = 0; i < s->n_q; i++) {
        memcpy(s->moments + i * n, s->by_a + i * s->n_m, sizeof(double) * (size_t)s->n_m);
        s->moments[i * n + s->n_m] = wanted[i] - s->vdot[i];
    }
    if (s->residual < 0) {
        return 0;
    }
    double *inverse_mass = s->by_a; /* no longer needed; n_m may be less than n_q */
    if (s->n_m < s->n_q) {
        return -1;
    }
    for (int32_t i = 0; i < s->n_q; i++) {
        memcpy(inverse_mass + i * s->n_q, s->by_r + i * s->n_r + s->residual,
               sizeof(double) * (size_t)s->n_q);
    }
    if (mhi_cholesky_factor(inverse_mass, s->n_q) != 0) {
        return -1;
    }
    mhi_cholesky_solve(inverse_mass, s->n_q, s->moments, n);
    return 0;
}

/* 0: all is finite. Where no muscle acts, rounding is no moment. */
static int weigh(mhi_statics *s) {
    const int32_t n = s->n_m + 1;
    double whole = 0, largest = 0;
    for (int32_t i = 0; i < s->n_q; i++) {
        double square = 0;
        for (int32_t j = 0; j < s->n_m; j++) {
            square += s->moments[i * n + j] * s->moments[i * n + j];
        }
        s->weight[i] = square;
        largest = fmax(largest, square);
        whole += square + fabs(s->moments[i * n + s->n_m]);
    }
    for (int32_t i = 0; i < s->n_q; i++) {
        const double square = s->weight[i];
        s->weight[i] = square > NOTHING * largest ? 1 / (SHARE * SHARE * square) : 0;
    }
    return isfinite(whole) ? 0 : -1;
}

int mhi_statics_solve(mhi_statics *s, mhi_system_context *context, const double *q, const double *v,
                      const double *w, const double *wanted, const double *lower,
                      const double *upper, double *a, double *r) {
    const mhe_system *face = mhi_system_face(s->system);
    const int32_t n = s->n_m + 1;
    if (s->n_m == 0) {
        return -1;
    }
    memset(r, 0, sizeof *r * (size_t)s->n_r);
    const mhe_system_point at = {.size = sizeof at, .q = q, .v = v, .a = a, .c = a, .r = r, .w = w};
    const mhe_acceleration out = {
        .size = sizeof out, .vdot = s->vdot, .vdot_a = s->by_a, .vdot_r = s->by_r};
    if (face->acceleration(face, context, &at, &out, NULL) != MHE_OK ||
        moments_of(s, wanted) != 0 || weigh(s) != 0) {
        return -1;
    }
    double *left = s->moments + s->n_m; /* in steps of n: needed - B (a - a0) */
    for (int32_t sweep = 0; sweep < SWEEPS; sweep++) {
        for (int32_t j = 0; j < s->n_m; j++) {
            double slope = -a[j] / (SIGMA * SIGMA), curve = 1 / (SIGMA * SIGMA);
            for (int32_t i = 0; i < s->n_q; i++) {
                const double moment = s->moments[i * n + j];
                slope += s->weight[i] * moment * left[i * n];
                curve += s->weight[i] * moment * moment;
            }
            const double next = fmin(fmax(a[j] + slope / curve, lower[j]), upper[j]);
            for (int32_t i = 0; i < s->n_q; i++) {
                left[i * n] -= s->moments[i * n + j] * (next - a[j]);
            }
            a[j] = next;
        }
    }
    for (int32_t i = 0; i < s->n_q && s->residual >= 0; i++) {
        r[s->residual + i] = left[i * n];
    }
    return 0;
}
