/* SPDX-License-Identifier: Apache-2.0 */
#include "qp.h"

#include <math.h>
#include <string.h>

size_t border_size(const qp_shape *s) {
    const size_t n_p = (size_t)s->n_p;
    return n_p * (size_z(s) + size_x(s)) + (n_p * n_p + 7) / 8 * 8 + (size_t)s->ld_p;
}

void border_place(qp_border *b, const qp_shape *s, double *memory) {
    b->W = memory;
    b->Lambda = b->W + (size_t)s->n_p * size_z(s);
    b->dp = b->Lambda + (size_t)s->n_p * size_x(s);
    b->S = b->dp + s->ld_p;
}

static double *answer(const qp *q, int32_t j) {
    return q->border->W + (size_t)j * size_z(q->shape);
}

static double *multipliers(const qp *q, int32_t j) {
    return q->border->Lambda + (size_t)j * size_x(q->shape);
}

/* Position of p_i in a vector of all w. */
static ptrdiff_t place(const qp *q, int32_t i) {
    return (ptrdiff_t)(q->shape->N + 1) * q->shape->ld_z + i;
}

/* W_j and Lambda_j: the stages' answer to p_j = 1. */
static void solve_column(qp *q, int32_t j) {
    const qp_shape *s = q->shape;
    double *g = q->rest_w, *b = q->rest_x;
    memset(g, 0, sizeof(double) * size_z(s));
    memset(b, 0, sizeof(double) * size_x(s));
    for (int32_t k = 0; k <= s->N; k++) {
        memcpy(row_z(s, g, k), q->stages[k].C + j * s->ld_z, sizeof(double) * (size_t)s->n_z);
        memcpy(row_x(s, b, k), q->stages[k].Pt + j * s->ld_x,
               sizeof(double) * (size_t)(k < s->N ? s->n_x : 0));
    }
    riccati_solve(&q->riccati, q->stages, g, b, answer(q, j), multipliers(q, j));
    memset(row_p(s, answer(q, j)), 0, sizeof(double) * (size_t)s->ld_p);
    row_p(s, answer(q, j))[j] = 1;
}

/* S = L L^T, in place. */
static int32_t factor(double *S, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = 0; j <= i; j++) {
            double sum = S[i * n + j];
            for (int32_t l = 0; l < j; l++) {
                sum -= S[i * n + l] * S[j * n + l];
            }
            if (i == j && !(sum > 0)) {
                return 0;
            }
            S[i * n + j] = i == j ? sqrt(sum) : sum / S[j * n + j];
        }
    }
    return 1;
}

int32_t border_factor(qp *q) {
    const qp_shape *s = q->shape;
    const int32_t n = s->n_p;
    for (int32_t j = 0; j < n; j++) {
        double *column = q->border->dp;
        solve_column(q, j);
        memset(column, 0, sizeof(double) * (size_t)s->ld_p);
        qp_sum_p(s, q->stages, answer(q, j), multipliers(q, j), column);
        for (int32_t i = 0; i < n; i++) {
            q->border->S[i * n + j] = column[i] + (i == j ? q->diagonal[place(q, i)] : 0);
        }
    }
    for (int32_t i = 0; i < n; i++) { /* what is fixed is no variable */
        for (int32_t j = 0; j < n && q->fixed[place(q, i)]; j++) {
            q->border->S[i * n + j] = q->border->S[j * n + i] = i == j;
        }
    }
    return factor(q->border->S, n);
}

void border_solve(const qp *q, double *p) {
    const int32_t n = q->shape->n_p;
    const double *L = q->border->S;
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = 0; j < i; j++) {
            p[i] -= L[i * n + j] * p[j];
        }
        p[i] /= L[i * n + i];
    }
    for (int32_t i = n - 1; i >= 0; i--) {
        for (int32_t j = i + 1; j < n; j++) {
            p[i] -= L[j * n + i] * p[j];
        }
        p[i] /= L[i * n + i];
    }
}

void border_newton(qp *q, const double *g, const double *b, double *w, double *lambda) {
    const qp_shape *s = q->shape;
    double *dp = s->n_p > 0 ? q->border->dp : NULL;
    riccati_solve(&q->riccati, q->stages, g, b, w, lambda);
    if (s->n_p == 0) {
        return;
    }
    memset(row_p(s, w), 0, sizeof(double) * (size_t)s->ld_p);
    memset(dp, 0, sizeof(double) * (size_t)s->ld_p);
    qp_sum_p(s, q->stages, w, lambda, dp);
    for (int32_t i = 0; i < s->n_p; i++) {
        dp[i] = q->fixed[place(q, i)] ? 0 : -(dp[i] + g[place(q, i)]);
    }
    border_solve(q, dp);
    for (int32_t j = 0; j < s->n_p; j++) {
        for (size_t i = 0; i < size_z(s); i++) {
            w[i] += dp[j] * answer(q, j)[i];
        }
        for (size_t i = 0; i < size_x(s); i++) {
            lambda[i] += dp[j] * multipliers(q, j)[i];
        }
    }
}
