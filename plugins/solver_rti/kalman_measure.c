/* SPDX-License-Identifier: Apache-2.0 */
/* kalman_measure.c: what the cost of a node's dense states does to their covariance. */
#include "kalman.h"

#include <math.h>
#include <string.h>

/* U of node k, and L = U^T, whose rows and columns behind the first n_b are a diagonal. */
static int32_t factor_cost(kalman *f, const qp_stage *stage, const double *d, int32_t n_b,
                           int32_t k) {
    const qp_shape *s = f->shape;
    const int32_t n = f->n, ld_d = f->ld_d;
    double *U = kalman_U_of(f, k), *inverse = kalman_of_d(f, f->U_inverse, k);
    int32_t positive = 1;
    for (int32_t i = 0; i < n; i++) {
        const double *from = stage->H + (s->n_u + i) * s->ld_z + s->n_u;
        double *row = U + i * ld_d;
        if (i < n_b) {
            memset(row, 0, sizeof(double) * (size_t)i);
            memcpy(row + i, from + i, sizeof(double) * (size_t)(n_b - i));
            row[i] += d[i];
        } else {
            row[i] = from[i] + d[i];
            positive &= row[i] > 0;
            inverse[i] = 1 / sqrt(row[i]);
            row[i] *= inverse[i];
        }
    }
    if (!positive || !s->kernels->factor(n_b, n_b, U, ld_d, inverse)) {
        return 0;
    }
    for (int32_t i = 0; i < n_b; i++) { /* blocks of four write beside the diagonal */
        for (int32_t j = i / 4 * 4; j < i; j++) {
            U[i * ld_d + j] = 0;
        }
        memset(U + i * ld_d + n_b, 0, sizeof(double) * (size_t)(KERNEL_LD(n_b) - n_b));
    }
    s->kernels->transpose(n_b, n_b, U, ld_d, f->L, ld_d);
    return 1;
}

/* to = factor * from, n doubles */
static void scale_row(int32_t n, double factor, const double *from, double *to) {
    for (int32_t j = 0; j < n; j++) {
        to[j] = factor * from[j];
    }
}

/* W = [I + U Sigma U^T, U Sigma]. */
static void weigh(kalman *f, int32_t n_b, int32_t width, int32_t k) {
    const qp_shape *s = f->shape;
    const int32_t n = f->n, ld_x = s->ld_x, ld_d = f->ld_d, ld_w = f->ld_w;
    const double *U = kalman_U_of(f, k);
    double *W = kalman_W_of(f, k);
    s->kernels->product(n, n_b, n_b, 1, f->before, ld_x, f->L, ld_d, NULL, f->T, ld_d, 0);
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = n_b; j < n; j++) {
            f->T[i * ld_d + j] = f->before[i * ld_x + j] * U[j * (ld_d + 1)];
        }
    }
    s->kernels->product(n_b, n, n_b, 1, f->L, ld_d, f->T, ld_d, NULL, W, ld_w, 1);
    for (int32_t i = n_b; i < n; i++) {
        scale_row(n - i, U[i * (ld_d + 1)], f->T + i * ld_d + i, W + i * ld_w + i);
    }
    for (int32_t i = 0; i < n; i++) {
        W[i * (ld_w + 1)] += 1;
    }
    s->kernels->product(n_b, width, n_b, 1, f->L, ld_d, f->before, ld_x, NULL, W + n, ld_w, 0);
    for (int32_t i = n_b; i < n; i++) {
        scale_row(width, U[i * (ld_d + 1)], f->before + i * ld_x, W + i * ld_w + n);
    }
}

/* Sigma' of node k from Sigma. */
int32_t kalman_measure(kalman *f, const qp_stage *stage, const double *diagonal, int32_t k) {
    const qp_shape *s = f->shape;
    const int32_t n = f->n, n_x = s->n_x, ld_x = s->ld_x, ld_w = f->ld_w;
    const int32_t last = k == s->N, width = last ? n : n_x, n_b = s->n_tied;
    double *W = kalman_W_of(f, k), *after = kalman_after(f, k);
    if (!factor_cost(f, stage, diagonal + (ptrdiff_t)k * s->ld_z + s->n_u, n_b, k)) {
        return 0;
    }
    weigh(f, n_b, width, k);
    if (!s->kernels->factor(n, n + width, W, ld_w, kalman_of_d(f, f->W_inverse, k))) {
        return 0;
    }
    if (!last) {
        s->kernels->product(n_x, n_x, n, -1, W + n, ld_w, W + n, ld_w, f->before, after, ld_x, 1);
        s->kernels->mirror(n_x, after, ld_x);
        if (f->m > 0) {
            memcpy(kalman_D_of(f, k), after, sizeof(double) * (size_t)(n * ld_x));
        }
    }
    return 1;
}
