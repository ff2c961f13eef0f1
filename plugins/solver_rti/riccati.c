/* SPDX-License-Identifier: Apache-2.0 */
#include "riccati.h"

#include <string.h>

size_t riccati_size(const qp_shape *s) {
    const size_t N = (size_t)s->N, n_x = (size_t)s->n_x, n_z = (size_t)s->n_z;
    const size_t ld_x = (size_t)s->ld_x, ld_z = (size_t)s->ld_z;
    return N * (n_z * ld_z + ld_z) + (N + 2) * n_x * ld_x + ld_x + n_x * ld_z + size_x(s) +
           size_z(s) + ld_x;
}

void riccati_place(riccati *r, const qp_shape *s, const uint8_t *fixed, double *memory) {
    memset(memory, 0, sizeof(double) * riccati_size(s));
    *r = (riccati){.shape = s, .fixed = fixed, .M = memory};
    r->P = r->M + (ptrdiff_t)s->N * s->n_z * s->ld_z;
    r->inverse = r->P + (ptrdiff_t)(s->N + 1) * s->n_x * s->ld_x;
    r->first = r->inverse + (ptrdiff_t)s->N * s->ld_z;
    r->first_inverse = r->first + s->n_x * s->ld_x;
    r->T = r->first_inverse + s->ld_x;
    r->p = r->T + s->n_x * s->ld_z;
    r->y = r->p + size_x(s);
    r->v = r->y + size_z(s);
}

void riccati_read_fixed(riccati *r) {
    r->first_is_fixed = 1;
    for (int32_t i = 0; i < r->shape->n_x; i++) {
        r->first_is_fixed &= r->fixed[r->shape->n_u + i];
    }
}

static double *M_of(const riccati *r, int32_t k) {
    return r->M + (ptrdiff_t)k * r->shape->n_z * r->shape->ld_z;
}

static double *P_of(const riccati *r, int32_t k) {
    return r->P + (ptrdiff_t)k * r->shape->n_x * r->shape->ld_x;
}

static double *inverse_of(const riccati *r, int32_t k) {
    return r->inverse + (ptrdiff_t)k * r->shape->ld_z;
}

/* T = P F, first n columns. */
static void multiply_cost(riccati *r, const qp_stage *stage, const double *P, int32_t n) {
    const qp_shape *s = r->shape;
    /* P is symmetric: its first columns are its first rows, transposed. */
    s->kernels->product(s->n_x, n, s->n_dense, 1, P, s->ld_x, stage->F, s->ld_z, NULL, r->T,
                        s->ld_z, 0);
    if (s->in_order) {
        const int32_t m = s->n_x - s->n_dense, u = s->control_of[s->n_dense];
        s->kernels->add_columns(s->n_x, m, P + s->n_dense, s->ld_x, stage->by_control + s->n_dense,
                                r->T + u, s->ld_z);
        if (n > s->n_u) {
            s->kernels->add_columns(s->n_x, m, P + s->n_dense, s->ld_x,
                                    stage->by_state + s->n_dense, r->T + s->n_u + s->n_dense,
                                    s->ld_z);
        }
        return;
    }
    for (int32_t i = 0; i < s->n_x; i++) {
        const double *row = P + i * s->ld_x;
        double *t = r->T + i * s->ld_z;
        for (int32_t j = s->n_dense; j < s->n_x; j++) {
            if (s->control_of[j] >= 0) {
                t[s->control_of[j]] += row[j] * stage->by_control[j];
            }
        }
        for (int32_t j = s->n_dense; j < s->n_x && n > s->n_u; j++) {
            t[s->n_u + j] += row[j] * stage->by_state[j];
        }
    }
}

/* y [from..n) += a x */
static void add_row(int32_t from, int32_t n, double a, const double *x, double *y) {
    for (int32_t j = from; j < n; j++) {
        y[j] += a * x[j];
    }
}

/* M += F^T T, upper triangle, of the rows of F behind the dense ones. */
static void add_simple_rows(const riccati *r, const qp_stage *stage, int32_t n, double *M) {
    const qp_shape *s = r->shape;
    const int32_t m = s->n_x - s->n_dense;
    const double *T = r->T + s->n_dense * s->ld_z;
    if (s->in_order) {
        const int32_t u = s->control_of[s->n_dense], x = s->n_u + s->n_dense;
        s->kernels->add_rows(m, n, u, stage->by_control + s->n_dense, T, s->ld_z, M + u * s->ld_z,
                             s->ld_z);
        if (n > s->n_u) {
            s->kernels->add_rows(m, n, x, stage->by_state + s->n_dense, T, s->ld_z, M + x * s->ld_z,
                                 s->ld_z);
        }
        return;
    }
    for (int32_t i = 0; i < m; i++) {
        const double *t = T + i * s->ld_z;
        const int32_t u = s->control_of[s->n_dense + i], x = s->n_u + s->n_dense + i;
        if (u >= 0) {
            add_row(u, n, stage->by_control[s->n_dense + i], t, M + u * s->ld_z);
        }
        if (x < n) {
            add_row(x, n, stage->by_state[s->n_dense + i], t, M + x * s->ld_z);
        }
    }
}

/* M = H + diag d + F^T P F, upper triangle of the first n rows and columns. */
static void build(riccati *r, const qp_stage *stage, const double *diagonal, int32_t k, int32_t n) {
    const qp_shape *s = r->shape;
    double *M = M_of(r, k);
    multiply_cost(r, stage, P_of(r, k + 1), n);
    s->kernels->product(n, n, s->n_dense, 1, stage->F, s->ld_z, r->T, s->ld_z, stage->H, M, s->ld_z,
                        1);
    add_simple_rows(r, stage, n, M);
    for (int32_t i = 0; i < n; i++) {
        M[i * s->ld_z + i] += diagonal[(ptrdiff_t)k * s->ld_z + i];
    }
}
/* Replaces the rows and columns of fixed variables by those of the unit matrix. */
static void pin(const uint8_t *fixed, int32_t n_rows, int32_t n, double *M, int32_t ld) {
    for (int32_t i = 0; i < n_rows; i++) {
        if (!fixed[i]) {
            continue;
        }
        for (int32_t j = 0; j < i; j++) {
            M[j * ld + i] = 0;
        }
        memset(M + i * ld + i, 0, sizeof(double) * (size_t)(n - i));
        M[i * ld + i] = 1;
    }
}

/* P [n_x x ld_x] = the upper triangle at `from`, mirrored. */
static void mirror(const qp_shape *s, const double *from, int32_t ld, double *P) {
    for (int32_t i = 0; i < s->n_x; i++) {
        memcpy(P + i * s->ld_x + i, from + i * ld + i, sizeof(double) * (size_t)(s->n_x - i));
        for (int32_t j = i + 1; j < s->n_x; j++) {
            P[j * s->ld_x + i] = from[i * ld + j];
        }
    }
}

static int32_t factor_first(riccati *r) {
    const qp_shape *s = r->shape;
    memcpy(r->first, r->P, sizeof(double) * (size_t)(s->n_x * s->ld_x));
    pin(r->fixed + s->n_u, s->n_x, s->n_x, r->first, s->ld_x);
    return s->kernels->factor(s->n_x, s->n_x, r->first, s->ld_x, r->first_inverse);
}

int32_t riccati_factor(riccati *r, const qp_stage *stages, const double *diagonal) {
    const qp_shape *s = r->shape;
    double *P = P_of(r, s->N);
    for (int32_t i = 0; i < s->n_x; i++) {
        memcpy(P + i * s->ld_x, stages[s->N].H + (s->n_u + i) * s->ld_z + s->n_u,
               sizeof(double) * (size_t)s->n_x);
        P[i * s->ld_x + i] += diagonal[(ptrdiff_t)s->N * s->ld_z + s->n_u + i];
    }
    for (int32_t k = s->N - 1; k >= 0; k--) {
        double *M = M_of(r, k);
        const int32_t n = k == 0 && r->first_is_fixed ? s->n_u : s->n_z;
        build(r, &stages[k], diagonal, k, n);
        pin(r->fixed + (ptrdiff_t)k * s->ld_z, s->n_u, n, M, s->ld_z);
        if (!s->kernels->factor(s->n_u, n, M, s->ld_z, inverse_of(r, k))) {
            return 0;
        }
        if (n > s->n_u) {
            double *M_xx = M + s->n_u * s->ld_z + s->n_u, *L = M + s->n_u;
            s->kernels->product(s->n_x, s->n_x, s->n_u, -1, L, s->ld_z, L, s->ld_z, M_xx, M_xx,
                                s->ld_z, 1);
            mirror(s, M_xx, s->ld_z, P_of(r, k));
        }
    }
    return r->first_is_fixed || factor_first(r);
}

/* p_k, and y_k = U^-T m_u. */
static void sweep_back(riccati *r, const qp_stage *stages, const double *g, const double *b) {
    const qp_shape *s = r->shape;
    const size_t bytes = sizeof(double) * (size_t)s->n_x;
    memcpy(row_x(s, r->p, s->N), g + (ptrdiff_t)s->N * s->ld_z + s->n_u, bytes);
    for (int32_t k = s->N - 1; k >= 0; k--) {
        double *m = row_z(s, r->y, k);
        memcpy(r->v, row_x(s, r->p, k + 1), bytes);
        s->kernels->add_transposed(s->n_x, s->n_x, 1, P_of(r, k + 1), s->ld_x,
                                   b + (ptrdiff_t)k * s->ld_x, r->v);
        memcpy(m, g + (ptrdiff_t)k * s->ld_z, sizeof(double) * (size_t)s->ld_z);
        qp_backward(s, &stages[k], 1, r->v, m);
        for (int32_t i = 0; i < s->n_u; i++) {
            m[i] = r->fixed[(ptrdiff_t)k * s->ld_z + i] ? 0 : m[i];
        }
        const int32_t n = k == 0 && r->first_is_fixed ? s->n_u : s->n_z;
        s->kernels->substitute(s->n_u, n, M_of(r, k), s->ld_z, inverse_of(r, k), m);
        memcpy(row_x(s, r->p, k), m + s->n_u, bytes);
    }
}

static void solve_first(riccati *r, double *x) {
    const qp_shape *s = r->shape;
    if (r->first_is_fixed) {
        memset(x, 0, sizeof(double) * (size_t)s->n_x);
        return;
    }
    for (int32_t i = 0; i < s->n_x; i++) {
        r->v[i] = r->fixed[s->n_u + i] ? 0 : r->p[i];
    }
    s->kernels->substitute(s->n_x, s->n_x, r->first, s->ld_x, r->first_inverse, r->v);
    s->kernels->substitute_back(s->n_x, r->first, s->ld_x, r->first_inverse, r->v, x);
}

void riccati_solve(riccati *r, const qp_stage *stages, const double *g, const double *b, double *w,
                   double *lambda) {
    const qp_shape *s = r->shape;
    const size_t bytes = sizeof(double) * (size_t)s->n_x;
    sweep_back(r, stages, g, b);
    solve_first(r, w + s->n_u);
    for (int32_t k = 0; k < s->N; k++) {
        double *now = row_z(s, w, k), *next = row_z(s, w, k + 1) + s->n_u, *y = row_z(s, r->y, k);
        double *multiplier = row_x(s, lambda, k);
        const double *M = M_of(r, k);
        s->kernels->add(s->n_u, k == 0 && r->first_is_fixed ? 0 : s->n_x, 1, M + s->n_u, s->ld_z,
                        now + s->n_u, y);
        s->kernels->substitute_back(s->n_u, M, s->ld_z, inverse_of(r, k), y, now);
        memcpy(next, b + (ptrdiff_t)k * s->ld_x, bytes);
        qp_forward(s, &stages[k], now, next);
        memset(multiplier, 0, bytes); /* -(P x + p) of the next stage */
        s->kernels->add_transposed(s->n_x, s->n_x, -1, P_of(r, k + 1), s->ld_x, next, multiplier);
        add_row(0, s->n_x, -1, row_x(s, r->p, k + 1), multiplier);
    }
    memset(row_z(s, w, s->N), 0, sizeof(double) * (size_t)s->n_u);
}

#define ROUNDING 1e-13 /* of a pivot, part of what its row and column began with */

/* U [n x ld] of a Cholesky factorisation, with the inverse of its diagonal. */
static int32_t is_rounding(const uint8_t *fixed, int32_t n, const double *U, int32_t ld,
                           const double *inverse) {
    for (int32_t i = 0; i < n; i++) {
        double diagonal = 0;
        for (int32_t j = 0; j < i; j++) {
            diagonal += U[j * ld + i] * U[j * ld + i];
        }
        const double pivot = 1 / (inverse[i] * inverse[i]);
        if (!fixed[i] && !(pivot > ROUNDING * (diagonal + pivot))) {
            return 1;
        }
    }
    return 0;
}

int32_t riccati_is_singular(const riccati *r) {
    const qp_shape *s = r->shape;
    for (int32_t k = 0; k < s->N; k++) {
        if (is_rounding(r->fixed + (ptrdiff_t)k * s->ld_z, s->n_u, M_of(r, k), s->ld_z,
                        inverse_of(r, k))) {
            return 1;
        }
    }
    return !r->first_is_fixed &&
           is_rounding(r->fixed + s->n_u, s->n_x, r->first, s->ld_x, r->first_inverse);
}

/* Column i of (U^T U)^-1, in w; m is scratch, both with room for a row. */
static void inverse_column(const qp_shape *s, int32_t i, int32_t n, const double *U, int32_t ld,
                           const double *inverse, double *m, double *w) {
    memset(m, 0, sizeof(double) * (size_t)ld);
    m[i] = -1;
    s->kernels->substitute(n, n, U, ld, inverse, m);
    s->kernels->substitute_back(n, U, ld, inverse, m, w);
}

void riccati_gain(riccati *r, int32_t k, double *K, double *rest) {
    const qp_shape *s = r->shape;
    const double *M = M_of(r, k), *inverse = inverse_of(r, k);
    const uint8_t *fixed = r->fixed + (ptrdiff_t)k * s->ld_z;
    double *m = row_z(s, r->y, 0), *w = row_z(s, r->y, 1);
    memset(K, 0, sizeof(double) * (size_t)(s->n_u * s->ld_x));
    memset(rest, 0, sizeof(double) * (size_t)(s->n_u * s->ld_z));
    for (int32_t j = 0; j < s->n_x && !(k == 0 && r->first_is_fixed); j++) {
        memset(m, 0, sizeof(double) * (size_t)s->ld_z);
        for (int32_t i = 0; i < s->n_u; i++) {
            m[i] = M[i * s->ld_z + s->n_u + j];
        }
        s->kernels->substitute_back(s->n_u, M, s->ld_z, inverse, m, w);
        for (int32_t i = 0; i < s->n_u; i++) {
            K[i * s->ld_x + j] = w[i];
        }
    }
    for (int32_t j = 0; j < s->n_u; j++) {
        if (!fixed[j]) {
            inverse_column(s, j, s->n_u, M, s->ld_z, inverse, m, w);
            memcpy(rest + j * s->ld_z, w, sizeof(double) * (size_t)s->n_u);
        }
    }
}

void riccati_first(riccati *r, double *covariance) {
    const qp_shape *s = r->shape;
    double *m = row_z(s, r->y, 0), *w = row_z(s, r->y, 1);
    memset(covariance, 0, sizeof(double) * (size_t)(s->n_x * s->ld_x));
    for (int32_t j = 0; j < s->n_x && !r->first_is_fixed; j++) {
        if (!r->fixed[s->n_u + j]) {
            inverse_column(s, j, s->n_x, r->first, s->ld_x, r->first_inverse, m, w);
            memcpy(covariance + j * s->ld_x, w, sizeof(double) * (size_t)s->n_x);
        }
    }
}
