/* SPDX-License-Identifier: Apache-2.0 */
#include "dense_covariance.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define AT_BOUND 1e-5   /* so near to a bound ... */
#define MULTIPLIER 1e-5 /* ... that presses so hard a variable is none */

static ptrdiff_t place(const mhi_dense *d, int32_t row, int32_t column) {
    return (ptrdiff_t)row * d->n + column;
}

static int32_t at_x(const mhi_dense *d, int32_t k, int32_t i) {
    return k * d->n_z + d->n_u + i;
}

static void add_block(mhi_dense *d, int32_t row, int32_t column, const double *block, int32_t m,
                      int32_t n, int32_t transposed) {
    for (int32_t i = 0; i < m; i++) {
        for (int32_t j = 0; j < n; j++) {
            const int32_t r = transposed ? column + j : row + i,
                          c = transposed ? row + i : column + j;
            d->K[place(d, r, c)] += block[i * n + j];
        }
    }
}

/* What evaluate() gives at one node. */
typedef struct values {
    double *xx, *ux, *uu, *A, *B, *next;
    double *px, *pu, *pp, *P; /* NULL: no parameters */
} values;

static int32_t fill_node(mhi_dense *d, const mhe_stage_problem *p, const mhe_solution *at,
                         int32_t k, const values *v) {
    static const double minus = -1;
    const int32_t last = k == d->N, row = d->n_w + d->n_p + k * d->n_x;
    const mhe_stage_values out = {.size = sizeof out,
                                  .hess_xx = v->xx,
                                  .hess_ux = last ? NULL : v->ux,
                                  .hess_uu = last ? NULL : v->uu,
                                  .x_next = last ? NULL : v->next,
                                  .A = last ? NULL : v->A,
                                  .B = last ? NULL : v->B,
                                  .hess_px = v->px,
                                  .hess_pp = v->pp,
                                  .hess_pu = last ? NULL : v->pu,
                                  .P = last ? NULL : v->P};
    if (p->evaluate(p, 0, k, at->x + k * d->n_x, last ? NULL : at->u + k * d->n_u, &out, NULL) !=
        MHE_OK) {
        return 0;
    }
    add_block(d, at_x(d, k, 0), at_x(d, k, 0), v->xx, d->n_x, d->n_x, 0);
    add_block(d, d->n_w, d->n_w, v->pp, d->n_p, d->n_p, 0);
    add_block(d, d->n_w, at_x(d, k, 0), v->px, d->n_p, d->n_x, 0);
    add_block(d, d->n_w, at_x(d, k, 0), v->px, d->n_p, d->n_x, 1);
    if (last) {
        return 1;
    }
    add_block(d, k * d->n_z, k * d->n_z, v->uu, d->n_u, d->n_u, 0);
    for (int32_t transposed = 0; transposed < 2; transposed++) {
        add_block(d, k * d->n_z, at_x(d, k, 0), v->ux, d->n_u, d->n_x, transposed);
        add_block(d, row, at_x(d, k, 0), v->A, d->n_x, d->n_x, transposed);
        add_block(d, row, k * d->n_z, v->B, d->n_x, d->n_u, transposed);
        add_block(d, row, d->n_w, v->P, d->n_x, d->n_p, transposed);
        add_block(d, d->n_w, k * d->n_z, v->pu, d->n_p, d->n_u, transposed);
        for (int32_t i = 0; i < d->n_x; i++) {
            add_block(d, row + i, at_x(d, k + 1, i), &minus, 1, 1, transposed);
        }
    }
    return 1;
}

/* Hessians and constraints F_k w_k - x_{k+1}. */
static int32_t fill(mhi_dense *d, const mhe_stage_problem *p, const mhe_solution *at) {
    const int32_t n_x = d->n_x, n_u = d->n_u, n_p = d->n_p;
    const int32_t sizes[] = {n_x * n_x, n_x * n_x, n_u * n_x, n_u * n_x, n_u * n_u,
                             n_x,       n_p * n_x, n_p * n_u, n_p * n_p, n_p * n_x};
    values v = {0};
    double **const of[] = {&v.xx, &v.A, &v.ux, &v.B, &v.uu, &v.next, &v.px, &v.pu, &v.pp, &v.P};
    int32_t total = 0;
    for (int32_t i = 0; i < 10; i++) {
        total += sizes[i];
    }
    double *memory = calloc((size_t)total, sizeof(double)), *next = memory;
    if (memory == NULL) {
        return 0;
    }
    for (int32_t i = 0; i < 10; i++) {
        *of[i] = sizes[i] > 0 && (i < 6 || n_p > 0) ? next : NULL;
        next += sizes[i];
    }
    if (n_p > 0 && p->set_parameters(p, at->p, NULL) != MHE_OK) {
        free(memory);
        return 0;
    }
    int32_t known = 1;
    for (int32_t k = 0; k <= d->N && known; k++) {
        known = fill_node(d, p, at, k, &v);
    }
    free(memory);
    return known;
}

static uint8_t is_gone(double w, double lower, double upper, double z_lower, double z_upper) {
    return lower == upper || (z_lower > MULTIPLIER && w - lower < AT_BOUND) ||
           (z_upper > MULTIPLIER && upper - w < AT_BOUND);
}

static void find_gone(mhi_dense *d, const mhe_stage_problem *p, const mhe_solution *at) {
    for (int32_t k = 0; k <= d->N; k++) {
        for (int32_t i = 0; i < d->n_x; i++) {
            const int32_t j = k * d->n_x + i;
            d->gone[at_x(d, k, i)] =
                is_gone(at->x[j], p->x_lower[j], p->x_upper[j], at->zx_lower[j], at->zx_upper[j]);
            d->n_gone_x += k > 0 && d->gone[at_x(d, k, i)];
        }
        for (int32_t i = 0; i < d->n_u; i++) { /* the last node has none */
            const int32_t j = k * d->n_u + i;
            d->gone[k * d->n_z + i] = k == d->N ? 1
                                                : is_gone(at->u[j], p->u_lower[j], p->u_upper[j],
                                                          at->zu_lower[j], at->zu_upper[j]);
            d->n_gone_u += k < d->N && d->gone[k * d->n_z + i];
        }
    }
    for (int32_t i = 0; i < d->n_p; i++) {
        d->gone[d->n_w + i] =
            is_gone(at->p[i], p->p_lower[i], p->p_upper[i], at->zp_lower[i], at->zp_upper[i]);
        d->n_gone_p += d->gone[d->n_w + i];
    }
    for (int32_t i = 0; i < d->n_w + d->n_p; i++) {
        for (int32_t j = 0; j < d->n && d->gone[i]; j++) {
            d->K[place(d, i, j)] = d->K[place(d, j, i)] = 0;
        }
        d->K[place(d, i, i)] = d->gone[i] ? 1 : d->K[place(d, i, i)];
    }
}

static void swap_rows(const mhi_dense *d, double *matrix, int32_t a, int32_t b) {
    for (int32_t j = 0; j < d->n && a != b; j++) {
        const double value = matrix[place(d, a, j)];
        matrix[place(d, a, j)] = matrix[place(d, b, j)];
        matrix[place(d, b, j)] = value;
    }
}

/* Row a becomes `scale` times itself less `factor` times row b. */
static void combine(const mhi_dense *d, double *matrix, int32_t a, double scale, int32_t b,
                    double factor) {
    for (int32_t j = 0; j < d->n; j++) {
        matrix[place(d, a, j)] = scale * matrix[place(d, a, j)] - factor * matrix[place(d, b, j)];
    }
}

/* Gauss and Jordan, with pivots of the largest rows. */
static int32_t invert(mhi_dense *d) {
    for (int32_t i = 0; i < d->n; i++) {
        d->inverse[place(d, i, i)] = 1;
    }
    for (int32_t c = 0; c < d->n; c++) {
        int32_t pivot = c;
        for (int32_t i = c; i < d->n; i++) {
            pivot = fabs(d->K[place(d, i, c)]) > fabs(d->K[place(d, pivot, c)]) ? i : pivot;
        }
        if (d->K[place(d, pivot, c)] == 0) {
            return 0;
        }
        swap_rows(d, d->K, c, pivot);
        swap_rows(d, d->inverse, c, pivot);
        const double scale = 1 / d->K[place(d, c, c)];
        combine(d, d->K, c, scale, c, 0);
        combine(d, d->inverse, c, scale, c, 0);
        for (int32_t i = 0; i < d->n; i++) {
            const double factor = d->K[place(d, i, c)];
            if (i != c && factor != 0) {
                combine(d, d->K, i, 1, c, factor);
                combine(d, d->inverse, i, 1, c, factor);
            }
        }
    }
    return 1;
}

int32_t mhi_dense_make(const mhe_stage_problem *p, const mhe_solution *at, mhi_dense *d) {
    *d = (mhi_dense){
        .n_x = p->n_x, .n_u = p->n_u, .n_p = p->n_p, .n_z = p->n_x + p->n_u, .N = p->n_intervals};
    d->n_w = (d->N + 1) * d->n_z;
    d->n = d->n_w + d->n_p + d->N * d->n_x;
    d->K = calloc((size_t)d->n * (size_t)d->n, sizeof(double));
    d->inverse = calloc((size_t)d->n * (size_t)d->n, sizeof(double));
    d->gone = calloc((size_t)(d->n_w + d->n_p), 1);
    if (d->K == NULL || d->inverse == NULL || d->gone == NULL || !fill(d, p, at)) {
        return 0;
    }
    find_gone(d, p, at);
    return invert(d);
}

void mhi_dense_free(mhi_dense *d) {
    free(d->K);
    free(d->inverse);
    free(d->gone);
}

static double compare(const mhi_dense *d, const double *block, int32_t row, int32_t column,
                      int32_t m, int32_t n) {
    double worst = 0, largest = 0;
    for (int32_t i = 0; i < d->n_w + d->n_p; i++) {
        largest = fmax(largest, d->gone[i] ? 0 : fabs(d->inverse[place(d, i, i)]));
    }
    for (int32_t i = 0; i < m; i++) {
        for (int32_t j = 0; j < n; j++) {
            const int32_t r = row + i, c = column + j;
            const double expected = d->gone[r] || d->gone[c] ? 0 : d->inverse[place(d, r, c)];
            const double size = sqrt(fabs(d->inverse[place(d, r, r)] * d->inverse[place(d, c, c)]));
            const double off = fabs(block[i * n + j] - expected) / (size + 1e-6 * largest);
            worst = off <= worst ? worst : off; /* NaN stays */
        }
    }
    return worst;
}

/* Blocks of node k. NaN: covariance() failed. */
static double compare_node(const mhi_dense *d, const mhe_solver_ops *ops, void *solver, int32_t k,
                           double *memory, mhe_error *err) {
    const int32_t n_x = d->n_x, n_u = d->n_u, n_p = d->n_p, last = k == d->N;
    double *xx = memory, *ux = xx + n_x * n_x, *uu = ux + n_u * n_x, *px = uu + n_u * n_u;
    double *pu = px + n_p * n_x, *pp = pu + n_p * n_u;
    const int32_t x = at_x(d, k, 0), u = k * d->n_z;
    const mhe_covariance out = {.size = sizeof out,
                                .node = k,
                                .xx = xx,
                                .ux = last ? NULL : ux,
                                .uu = last ? NULL : uu,
                                .pp = n_p > 0 ? pp : NULL,
                                .px = n_p > 0 ? px : NULL,
                                .pu = n_p > 0 && !last ? pu : NULL};
    if (ops->covariance(solver, &out, err) != MHE_OK) {
        return NAN;
    }
    double worst = compare(d, xx, x, x, n_x, n_x);
    worst = fmax(worst, compare(d, px, d->n_w, x, n_p, n_x));
    worst = fmax(worst, compare(d, pp, d->n_w, d->n_w, n_p, n_p));
    if (!last) {
        worst = fmax(worst, compare(d, ux, u, x, n_u, n_x));
        worst = fmax(worst, compare(d, uu, u, u, n_u, n_u));
        worst = fmax(worst, compare(d, pu, d->n_w, u, n_p, n_u));
    }
    return worst;
}

double mhi_dense_compare(const mhi_dense *d, const mhe_solver_ops *ops, void *solver,
                         mhe_error *err) {
    const int32_t n = d->n_z + d->n_p;
    double *memory = calloc((size_t)(n * n), sizeof(double)), worst = memory == NULL ? NAN : 0;
    for (int32_t k = 0; k <= d->N && !isnan(worst); k++) {
        const double off = compare_node(d, ops, solver, k, memory, err);
        worst = off <= worst ? worst : off; /* NaN stays */
    }
    free(memory);
    return worst;
}
