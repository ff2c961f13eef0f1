/* SPDX-License-Identifier: Apache-2.0 */
/* border.c: the parameters, as a border of the recursion (qp.h).
 *
 * The cost to go of a stage is quadratic in the state and in p. Carried backwards with the
 * recursion of the states, whose factors are there, it leaves S at the first stage: for all
 * parameters at once, a stage at a time, so that what a stage holds is read from memory once. */
#include "qp.h"

#include <math.h>
#include <string.h>

/* Rows of p of a stage's matrices: as many as there are variables, transposed. */
static size_t room(const qp_shape *s) {
    return (size_t)(2 * s->n_z + 3 * s->n_x) * (size_t)s->ld_p;
}

size_t border_size(const qp_shape *s) {
    const size_t n_p = (size_t)s->n_p, ld = (size_t)s->ld_p;
    return n_p * size_z(s) + size_z(s) + size_x(s) + 2 * n_p * ld + (n_p * n_p + 7) / 8 * 8 + ld +
           room(s);
}

void border_place(qp_border *b, const qp_shape *s, double *memory) {
    const size_t square = (size_t)s->n_p * (size_t)s->ld_p;
    b->W = memory;
    b->g = b->W + (size_t)s->n_p * size_z(s);
    b->b = b->g + size_z(s);
    b->D = b->b + size_x(s);
    b->sum = b->D + square;
    b->dp = b->sum + square;
    b->room = b->dp + s->ld_p;
    b->S = b->room + room(s);
}

/* Position of p_i in a vector of all w. */
static ptrdiff_t place(const qp *q, int32_t i) {
    return (ptrdiff_t)(q->shape->N + 1) * q->shape->ld_z + i;
}

void border_begin(qp *q) {
    const qp_shape *s = q->shape;
    double *D = q->border->D;
    memset(D, 0, sizeof(double) * (size_t)(s->n_p * s->ld_p));
    for (int32_t k = 0; k <= s->N; k++) {
        const qp_stage *stage = &q->stages[k];
        for (int32_t i = 0; i < stage->n_costly; i++) {
            const int32_t row = stage->costly[i];
            for (int32_t j = 0; j < stage->n_costly; j++) {
                const int32_t at = stage->costly[j];
                D[row * s->ld_p + at] += stage->D[row * s->n_p + at];
            }
        }
    }
}

/* y [n] += a x */
static void add_row(int32_t n, double a, const double *x, double *y) {
    for (int32_t j = 0; j < n; j++) {
        y[j] += a * x[j];
    }
}

/* U^T Y = M, rows of M [n x n_p] become those of Y. */
static void substitute(const qp_shape *s, int32_t n, const double *U, int32_t ld,
                       const double *inverse, double *M) {
    for (int32_t i = 0; i < n; i++) {
        double *row = M + (ptrdiff_t)i * s->ld_p;
        for (int32_t j = 0; j < i; j++) {
            add_row(s->ld_p, -U[j * ld + i], M + (ptrdiff_t)j * s->ld_p, row);
        }
        for (int32_t j = 0; j < s->ld_p; j++) {
            row[j] *= inverse[i];
        }
    }
}

/* The scratch, in rows of ld_p. */
typedef struct columns {
    double *P, *V, *p; /* [n_x] of the dynamics; P_{k+1} P + p_{k+1}; of the cost to go */
    double *G, *m;     /* [n_z] of the costs, and with what follows */
} columns;

static columns columns_of(const qp *q) {
    const qp_shape *s = q->shape;
    const ptrdiff_t x = (ptrdiff_t)s->n_x * s->ld_p, z = (ptrdiff_t)s->n_z * s->ld_p;
    double *m = q->border->room;
    return (columns){m, m + x, m + 2 * x, m + 3 * x, m + 3 * x + z};
}

/* C^T of n variables from `first` on. */
static void read_costs(const qp_shape *s, const qp_stage *stage, int32_t first, int32_t n,
                       double *to) {
    memset(to, 0, sizeof(double) * (size_t)(n * s->ld_p));
    for (int32_t i = 0; i < stage->n_costly; i++) {
        const double *row = stage->C + (ptrdiff_t)stage->costly[i] * s->ld_z + first;
        for (int32_t j = 0; j < n; j++) {
            to[j * s->ld_p + stage->costly[i]] = row[j];
        }
    }
}

/* m = G + F^T V */
static void carry(const qp_shape *s, const qp_stage *stage, const columns *c) {
    const int32_t ld = s->ld_p;
    s->kernels->product(s->n_z, s->n_p, s->n_dense, 1, stage->F, s->ld_z, c->V, ld, c->G, c->m, ld,
                        0);
    for (int32_t i = s->n_dense; i < s->n_x; i++) {
        const double *v = c->V + (ptrdiff_t)i * ld;
        const int32_t u = s->control_of[i];
        add_row(s->n_p, stage->by_state[i], v, c->m + (ptrdiff_t)(s->n_u + i) * ld);
        if (u >= 0) {
            add_row(s->n_p, stage->by_control[i], v, c->m + (ptrdiff_t)u * ld);
        }
    }
}

/* One stage backwards: `sum` and p. */
static void step_back(qp *q, int32_t k, const columns *c) {
    const qp_shape *s = q->shape;
    const qp_stage *stage = &q->stages[k];
    const riccati *r = &q->riccati;
    const kernels *const use = s->kernels;
    const int32_t ld = s->ld_p, n = s->n_p, n_rows = stage->n_reached;
    const double *next = r->P + (ptrdiff_t)(k + 1) * s->n_x * s->ld_x;
    const double *M = r->M + (ptrdiff_t)k * s->n_z * s->ld_z;
    double *sum = q->border->sum;
    use->transpose(n, n_rows, stage->Pt, s->ld_x, c->P, ld);
    read_costs(s, stage, 0, s->n_z, c->G);
    use->product(s->n_x, n, n_rows, 1, next, s->ld_x, c->P, ld, c->p, c->V, ld, 0);
    use->product(n, n, n_rows, 1, c->P, ld, c->V, ld, sum, sum, ld, 1);
    use->product(n, n, n_rows, 1, c->p, ld, c->P, ld, sum, sum, ld, 1);
    carry(s, stage, c);
    for (int32_t i = 0; i < s->n_u; i++) {
        if (r->fixed[(ptrdiff_t)k * s->ld_z + i]) {
            memset(c->m + (ptrdiff_t)i * ld, 0, sizeof(double) * (size_t)ld);
        }
    }
    substitute(s, s->n_u, M, s->ld_z, r->inverse + (ptrdiff_t)k * s->ld_z, c->m);
    use->product(n, n, s->n_u, -1, c->m, ld, c->m, ld, sum, sum, ld, 1);
    if (k > 0 || !r->first_is_fixed) {
        use->product(s->n_x, n, s->n_u, -1, M + s->n_u, s->ld_z, c->m, ld,
                     c->m + (ptrdiff_t)s->n_u * ld, c->p, ld, 0);
    }
}

/* What a free first state leaves. */
static void end_first(qp *q, const columns *c) {
    const qp_shape *s = q->shape;
    const riccati *r = &q->riccati;
    double *sum = q->border->sum;
    for (int32_t i = 0; i < s->n_x; i++) {
        if (r->fixed[s->n_u + i]) {
            memset(c->p + (ptrdiff_t)i * s->ld_p, 0, sizeof(double) * (size_t)s->ld_p);
        }
    }
    substitute(s, s->n_x, r->first, s->ld_x, r->first_inverse, c->p);
    s->kernels->product(s->n_p, s->n_p, s->n_x, -1, c->p, s->ld_p, c->p, s->ld_p, sum, sum, s->ld_p,
                        1);
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

int32_t border_factor(qp *q, const uint8_t *held) {
    const qp_shape *s = q->shape;
    const int32_t n = s->n_p;
    const columns c = columns_of(q);
    double *S = q->border->S;
    q->border->held = held;
    memcpy(q->border->sum, q->border->D, sizeof(double) * (size_t)(n * s->ld_p));
    read_costs(s, &q->stages[s->N], s->n_u, s->n_x, c.p);
    for (int32_t k = s->N - 1; k >= 0; k--) {
        step_back(q, k, &c);
    }
    if (!q->riccati.first_is_fixed) {
        end_first(q, &c);
    }
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = 0; j <= i; j++) {
            const int32_t constant = held[place(q, i)] || held[place(q, j)];
            S[i * n + j] = constant ? i == j : q->border->sum[j * s->ld_p + i];
        }
        S[i * n + i] += q->diagonal[place(q, i)];
    }
    return factor(S, n);
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

/* The stages' own answer to p, on top of g and b. */
static void solve_with(qp *q, const double *p, const double *g, const double *b, double *w,
                       double *lambda) {
    const qp_shape *s = q->shape;
    memcpy(q->border->g, g, sizeof(double) * size_z(s));
    memcpy(q->border->b, b, sizeof(double) * size_x(s));
    for (int32_t k = 0; k <= s->N; k++) {
        qp_backward_p(s, &q->stages[k], p, row_z(s, q->border->g, k));
        if (k < s->N) {
            qp_forward_p(s, &q->stages[k], p, row_x(s, q->border->b, k));
        }
    }
    riccati_solve(&q->riccati, q->stages, q->border->g, q->border->b, w, lambda);
    memcpy(row_p(s, w), p, sizeof(double) * (size_t)s->ld_p);
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
        dp[i] = q->border->held[place(q, i)] ? 0 : -(dp[i] + g[place(q, i)]);
    }
    border_solve(q, dp);
    solve_with(q, dp, g, b, w, lambda);
}

void border_answers(qp *q) {
    const qp_shape *s = q->shape;
    double *zero_g = q->rest_w, *zero_b = q->rest_x, *lambda = q->dlambda, *p = q->border->dp;
    memset(zero_g, 0, sizeof(double) * size_z(s));
    memset(zero_b, 0, sizeof(double) * size_x(s));
    for (int32_t j = 0; j < s->n_p; j++) {
        memset(p, 0, sizeof(double) * (size_t)s->ld_p);
        p[j] = 1;
        solve_with(q, p, zero_g, zero_b, q->border->W + (size_t)j * size_z(s), lambda);
    }
}
