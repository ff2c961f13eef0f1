/* SPDX-License-Identifier: Apache-2.0 */
#include "control/feedback.h"

#include "base/cholesky.h"

#include <math.h>
#include <string.h>

typedef struct riccati {
    int32_t n_x, n_u;
    double *P;      /* [n_x x n_x] cost to go */
    double *PA;     /* [n_x x n_x] */
    double *PB;     /* [n_x x n_u] */
    double *S;      /* [n_u x n_u] R + B^T P B, then its Cholesky factor */
    double *closed; /* [n_x x n_x] A - B K */
    mhi_arena arena;
} riccati;

/* out [m x n] = a [m x l] b [l x n] */
static void multiply(const double *a, const double *b, int32_t m, int32_t l, int32_t n,
                     double *out) {
    memset(out, 0, sizeof(double) * (size_t)(m * n));
    for (int32_t i = 0; i < m; i++) {
        for (int32_t k = 0; k < l; k++) {
            for (int32_t j = 0; j < n; j++) {
                out[i * n + j] += a[i * l + k] * b[k * n + j];
            }
        }
    }
}

/* out [m x n] = a^T b, a [l x m], b [l x n] */
static void multiply_transposed(const double *a, const double *b, int32_t m, int32_t l, int32_t n,
                                double *out) {
    memset(out, 0, sizeof(double) * (size_t)(m * n));
    for (int32_t k = 0; k < l; k++) {
        for (int32_t i = 0; i < m; i++) {
            for (int32_t j = 0; j < n; j++) {
                out[i * n + j] += a[k * m + i] * b[k * n + j];
            }
        }
    }
}

/* K = (R + B^T P B)^-1 B^T P A; then P = Q + A^T P (A - B K). */
static mhe_status step_back(riccati *w, const double *A, const double *B, const double *q_weight,
                            const double *r_weight, double *K, mhe_error *err) {
    const int32_t n_x = w->n_x, n_u = w->n_u;
    multiply(w->P, A, n_x, n_x, n_x, w->PA);
    multiply(w->P, B, n_x, n_x, n_u, w->PB);
    multiply_transposed(B, w->PB, n_u, n_x, n_u, w->S);
    multiply_transposed(B, w->PA, n_u, n_x, n_x, K);
    for (int32_t i = 0; i < n_u; i++) {
        w->S[i * n_u + i] += r_weight[i];
    }
    int failed = mhi_cholesky_factor(w->S, n_u) != 0;
    if (!failed) {
        mhi_cholesky_solve(w->S, n_u, K, n_x);
    }
    for (int32_t i = 0; i < n_u * n_x; i++) {
        failed |= !isfinite(K[i]);
    }
    if (failed) {
        return mhe_fail(err, MHE_E_NUMERIC, "the feedback along the motion is not finite");
    }
    multiply(B, K, n_x, n_u, n_x, w->closed);
    for (int32_t i = 0; i < n_x * n_x; i++) {
        w->closed[i] = A[i] - w->closed[i];
    }
    multiply_transposed(w->PA, w->closed, n_x, n_x, n_x, w->P); /* P is symmetric: (PA)^T = A^T P */
    for (int32_t i = 0; i < n_x; i++) {
        for (int32_t j = 0; j < i; j++) { /* rounding must not build up */
            const double mean = 0.5 * (w->P[i * n_x + j] + w->P[j * n_x + i]);
            w->P[i * n_x + j] = w->P[j * n_x + i] = mean;
        }
        w->P[i * n_x + i] += q_weight[i];
    }
    return MHE_OK;
}

mhe_status mhi_feedback_gains(const mhi_feedback_setup *s, double *gain, mhe_error *err) {
    const int32_t n_x = s->n_x, n_u = s->n_u;
    riccati w = {.n_x = n_x, .n_u = n_u};
    w.P = MHI_TAKE(&w.arena, double, n_x *n_x);
    w.PA = MHI_TAKE(&w.arena, double, n_x *n_x);
    w.PB = MHI_TAKE(&w.arena, double, n_x *n_u);
    w.S = MHI_TAKE(&w.arena, double, n_u *n_u);
    w.closed = MHI_TAKE(&w.arena, double, n_x *n_x);
    mhe_status status = MHE_OK;
    if (!w.P || !w.PA || !w.PB || !w.S || !w.closed) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < n_x && status == MHE_OK; i++) {
        w.P[i * n_x + i] = s->q_weight[i];
    }
    for (int32_t k = s->n - 1; k >= 0 && status == MHE_OK; k--) {
        status = step_back(&w, s->A + (ptrdiff_t)k * n_x * n_x, s->B + (ptrdiff_t)k * n_x * n_u,
                           s->q_weight, s->r_weight + (ptrdiff_t)k * n_u,
                           gain + (ptrdiff_t)k * n_u * n_x, err);
    }
    mhi_arena_free(&w.arena);
    return status;
}

void mhi_feedback_apply(const double *gain, int32_t n_x, int32_t n_u, const double *x,
                        const double *x_track, double *u) {
    for (int32_t i = 0; i < n_u; i++) {
        for (int32_t j = 0; j < n_x; j++) {
            u[i] -= gain[i * n_x + j] * (x[j] - x_track[j]);
        }
    }
}
