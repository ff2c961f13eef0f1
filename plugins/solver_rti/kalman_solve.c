/* SPDX-License-Identifier: Apache-2.0 */
/* kalman_solve.c: solutions with the factors. */
#include "kalman.h"

#include <string.h>

/* Slopes of the costs to go of simple states -> s, and what controls do without any pull -> v. */
static void sweep_simple(kalman *f, const qp_stage *stages, const double *g, const double *b) {
    const qp_shape *s = f->shape;
    const ptrdiff_t u = kalman_first_control(f), a = s->n_u + f->n;
    for (int32_t k = s->N; k >= 0; k--) {
        const double *slope = g + (ptrdiff_t)k * s->ld_z;
        double *to_go = f->s + (ptrdiff_t)k * s->ld_x + f->n;
        if (k == s->N) {
            memcpy(to_go, slope + a, sizeof(double) * (size_t)f->m);
            continue;
        }
        const double *alpha = stages[k].by_state + f->n, *beta = stages[k].by_control + f->n;
        const double *inverse = f->inverse + (ptrdiff_t)k * s->ld_z,
                     *K = kalman_simple_x(f, f->K, k);
        const double *p_next = kalman_simple_x(f, f->p, k + 1),
                     *s_next = kalman_simple_x(f, f->s, k + 1);
        const double *c = kalman_simple_x(f, b, k);
        double *v = f->v + (ptrdiff_t)k * s->ld_z;
        for (int32_t i = 0; i < s->n_u; i++) {
            v[i] = -inverse[i] * slope[i];
        }
        for (int32_t j = 0; j < f->m; j++) {
            const double t = p_next[j] * c[j] + s_next[j], e = slope[u + j] + beta[j] * t;
            v[u + j] = -inverse[u + j] * e;
            to_go[j] = slope[a + j] + alpha[j] * t - K[j] * e;
        }
    }
}

/* Mean of a free first state: simple states at the least of their costs to go. */
static void begin_mean(kalman *f, const double *g) {
    const qp_shape *s = f->shape;
    const double *D = kalman_D_of(f, 0);
    for (int32_t i = 0; i < s->n_x; i++) {
        double mean = 0;
        for (int32_t j = 0; j < f->n && i < f->n; j++) {
            mean -= D[i * s->ld_x + j] * g[s->n_u + j];
        }
        f->x[i] = i < f->n ? mean : f->held[s->n_u + i] ? 0 : -f->s[i] / f->p[i];
    }
}

/* Means behind each measurement. */
static void sweep_forward(kalman *f, const qp_stage *stages, const double *g, const double *b) {
    const qp_shape *s = f->shape;
    const int32_t n = f->n, n_b = s->n_tied, ld_d = f->ld_d;
    const ptrdiff_t u = kalman_first_control(f);
    if (f->free) {
        begin_mean(f, g);
    }
    for (int32_t k = 0; k < s->N; k++) {
        const int32_t moves = k > 0 || f->free;
        const double *beta = stages[k].by_control + n, *closed = kalman_simple_x(f, f->closed, k);
        const double *v = f->v + (ptrdiff_t)k * s->ld_z, *x = f->x + (ptrdiff_t)k * s->ld_x;
        const double *U = kalman_U_of(f, k + 1), *U_inverse = kalman_of_d(f, f->U_inverse, k + 1);
        double *y = f->row, *m = f->next, *z = kalman_of_d(f, f->z, k + 1);
        memcpy(m, b + (ptrdiff_t)k * s->ld_x, sizeof(double) * (size_t)s->ld_x);
        for (int32_t j = 0; j < f->m; j++) {
            m[n + j] += beta[j] * v[u + j] + (moves ? closed[j] * x[n + j] : 0);
        }
        memset(z, 0, sizeof(double) * (size_t)ld_d);
        memcpy(z, m, sizeof(double) * (size_t)n);
        s->kernels->add_transposed(s->n_u, n, 1, kalman_FT_of(f, k), ld_d, v, z);
        if (moves) {
            s->kernels->add_transposed(s->n_x, n, 1, kalman_C_of(f, k), ld_d, x, z);
        }
        memcpy(m, z, sizeof(double) * (size_t)n);
        /* U m + U^-T g, then the factor's row of S^-1 and what it takes off m */
        const int32_t width = k + 1 == s->N ? n : s->n_x;
        memset(y, 0, sizeof(double) * (size_t)f->ld_w);
        memcpy(y, g + (ptrdiff_t)(k + 1) * s->ld_z + s->n_u, sizeof(double) * (size_t)n);
        s->kernels->substitute(n_b, n_b, U, ld_d, U_inverse, y);
        s->kernels->add(n_b, n_b, 1, U, ld_d, z, y);
        for (int32_t i = n_b; i < n; i++) {
            y[i] = U_inverse[i] * y[i] + U[i * (ld_d + 1)] * z[i];
        }
        memcpy(y + n, m, sizeof(double) * (size_t)width);
        memset(y + n + width, 0, sizeof(double) * (size_t)(f->ld_w - n - width));
        s->kernels->substitute(n, n + width, kalman_W_of(f, k + 1), f->ld_w,
                               kalman_of_d(f, f->W_inverse, k + 1), y);
        memset(z, 0, sizeof(double) * (size_t)ld_d);
        memcpy(z, y, sizeof(double) * (size_t)n);
        memcpy(f->x + (ptrdiff_t)(k + 1) * s->ld_x, y + n, sizeof(double) * (size_t)width);
    }
}

/* Pulls: dense states, multipliers of the closed loop, controls of the closed loop -> v. */
static void sweep_back(kalman *f, const qp_stage *stages, double *w, double *lambda) {
    const qp_shape *s = f->shape;
    const int32_t n = f->n, n_b = s->n_tied, n_x = s->n_x, ld_d = f->ld_d;
    const ptrdiff_t u = kalman_first_control(f);
    memset(f->eta, 0, sizeof(double) * (size_t)s->ld_x);
    for (int32_t k = s->N; k > 0; k--) {
        const int32_t last = k == s->N;
        const double *U = kalman_U_of(f, k);
        double *x = row_z(s, w, k) + s->n_u, *y = kalman_of_d(f, f->z, k),
               *out = row_x(s, lambda, k - 1);
        memcpy(x, f->x + (ptrdiff_t)k * s->ld_x, sizeof(double) * (size_t)n);
        if (!last) {
            s->kernels->add(n, n_x, 1, kalman_D_of(f, k), s->ld_x, f->eta, x);
            s->kernels->add(n, n_x, 1, kalman_W_of(f, k) + n, f->ld_w, f->eta, y);
        }
        s->kernels->substitute_back(n, kalman_W_of(f, k), f->ld_w, kalman_of_d(f, f->W_inverse, k),
                                    y, f->row);
        memset(f->lambda, 0, sizeof(double) * (size_t)ld_d);
        memcpy(f->lambda, f->eta, sizeof(double) * (size_t)n);
        s->kernels->add_transposed(n_b, n_b, 1, U, ld_d, f->row, f->lambda);
        for (int32_t i = n_b; i < n; i++) {
            f->lambda[i] += U[i * (ld_d + 1)] * f->row[i];
        }
        memcpy(out, f->eta, sizeof(double) * (size_t)s->ld_x);
        memcpy(out, f->lambda, sizeof(double) * (size_t)n);
        const double *beta = stages[k - 1].by_control + n,
                     *closed = kalman_simple_x(f, f->closed, k - 1);
        const double *inverse = f->inverse + (ptrdiff_t)(k - 1) * s->ld_z;
        double *v = f->v + (ptrdiff_t)(k - 1) * s->ld_z;
        memset(f->pull, 0, sizeof(double) * (size_t)s->n_u);
        s->kernels->add(s->n_u, n, 1, kalman_FT_of(f, k - 1), ld_d, f->lambda, f->pull);
        for (int32_t j = 0; j < f->m; j++) {
            f->pull[u + j] += beta[j] * out[n + j];
        }
        for (int32_t i = 0; i < s->n_u; i++) {
            v[i] += inverse[i] * f->pull[i];
        }
        for (int32_t j = 0; j < f->m; j++) {
            f->eta[n + j] = closed[j] * out[n + j];
        }
        memset(f->eta, 0, sizeof(double) * (size_t)n);
        s->kernels->add(k > 1 || f->free ? n_x : 0, n, 1, kalman_C_of(f, k - 1), ld_d, f->lambda,
                        f->eta);
    }
    if (f->free) {
        double *x = row_z(s, w, 0) + s->n_u;
        memcpy(x, f->x, sizeof(double) * (size_t)n);
        s->kernels->add(n, n_x, 1, kalman_D_of(f, 0), s->ld_x, f->eta, x);
    }
}

/* Simple states and controls, and the multipliers of the former as they are with their costs. */
static void follow_simple(kalman *f, const qp_stage *stages, const double *b, double *w,
                          double *lambda) {
    const qp_shape *s = f->shape;
    const ptrdiff_t u = kalman_first_control(f), a = s->n_u + f->n;
    double *first = row_z(s, w, 0) + s->n_u;
    for (int32_t i = f->free ? f->n : 0; i < s->n_x; i++) { /* the pull of the others on each */
        const int32_t held = !f->free || f->held[s->n_u + i];
        first[i] = held ? 0 : (f->eta[i] - f->s[i]) / f->p[i];
    }
    for (int32_t k = 0; k < s->N; k++) {
        const double *alpha = stages[k].by_state + f->n, *beta = stages[k].by_control + f->n;
        const double *K = kalman_simple_x(f, f->K, k), *c = kalman_simple_x(f, b, k);
        const double *p_next = kalman_simple_x(f, f->p, k + 1),
                     *s_next = kalman_simple_x(f, f->s, k + 1);
        double *now = row_z(s, w, k), *next = row_z(s, w, k + 1);
        double *multiplier = row_x(s, lambda, k) + f->n;
        memcpy(now, f->v + (ptrdiff_t)k * s->ld_z, sizeof(double) * (size_t)s->n_u);
        for (int32_t j = 0; j < f->m; j++) {
            now[u + j] -= K[j] * now[a + j];
            next[a + j] = alpha[j] * now[a + j] + beta[j] * now[u + j] + c[j];
            multiplier[j] -= p_next[j] * next[a + j] + s_next[j];
        }
    }
    memset(row_z(s, w, s->N), 0, sizeof(double) * (size_t)s->n_u);
}

void kalman_solve(kalman *f, const qp_stage *stages, const double *g, const double *b, double *w,
                  double *lambda) {
    sweep_simple(f, stages, g, b);
    sweep_forward(f, stages, g, b);
    sweep_back(f, stages, w, lambda);
    follow_simple(f, stages, b, w, lambda);
}
