/* SPDX-License-Identifier: Apache-2.0 */
/* covariance.c: how well the costs determine the solution. */
#include "rti.h"

#include <math.h>
#include <string.h>

/* Weight that holds a later state at its bound, beside the largest curvature of the costs. */
#define STIFF 1e10

/* Is the variable at a bound that its multiplier keeps it at? Of the two, at a solution the one
 * that is 0 is the smaller. */
static int32_t at_bound(const rti_solver *s, ptrdiff_t i) {
    const double below = s->result[i] - s->lower[i], above = s->upper[i] - s->result[i];
    return s->lower[i] == s->upper[i] || s->scale * s->z_lower[i] > below ||
           s->scale * s->z_upper[i] > above;
}

static double largest_curvature(const rti_solver *s) {
    double largest = 0;
    for (int32_t k = 0; k <= s->shape.N; k++) {
        for (int32_t i = 0; i < s->shape.n_z; i++) {
            largest = fmax(largest, s->trial.stages[k].H[i * s->shape.ld_z + i]);
        }
    }
    return largest;
}

/* What is at its bound is no variable: controls and the first state are constants, later states are
 * held. The diagonal that does so. */
static void hold(rti_solver *s) {
    const qp_shape *shape = &s->shape;
    qp *q = &s->qp;
    const double stiff = STIFF * largest_curvature(s);
    memset(q->diagonal, 0, sizeof(double) * size_z(shape));
    memset(q->fixed, 0, size_z(shape));
    for (int32_t k = 0; k <= shape->N; k++) {
        for (int32_t i = k < shape->N ? 0 : shape->n_u; i < shape->n_z; i++) {
            const ptrdiff_t at = (ptrdiff_t)k * shape->ld_z + i;
            if (!at_bound(s, at)) {
                continue;
            }
            if (k == 0 || i < shape->n_u) {
                q->fixed[at] = 1;
            } else {
                q->diagonal[at] = stiff;
            }
        }
    }
    for (int32_t i = 0; i < shape->n_p; i++) {
        const ptrdiff_t at = (ptrdiff_t)(shape->N + 1) * shape->ld_z + i;
        q->fixed[at] = (uint8_t)at_bound(s, at);
    }
    qp_use(q, QP_RICCATI);
    q->riccati.fixed = q->fixed;
    riccati_read_fixed(&q->riccati);
}

/* Covariance of (u_k, x_k) from that of x_k -> s->joint. */
static void join(rti_solver *s, int32_t k) {
    const qp_shape *shape = &s->shape;
    const int32_t n_x = shape->n_x, n_u = shape->n_u, ld = shape->ld_z, ld_x = shape->ld_x;
    const double *xx = s->spread + (ptrdiff_t)k * n_x * ld_x;
    riccati_gain(&s->qp.riccati, k, s->gain, s->rest);
    memset(s->joint, 0, sizeof(double) * (size_t)(shape->n_z * ld));
    for (int32_t i = 0; i < n_x; i++) {
        memcpy(s->joint + (n_u + i) * ld + n_u, xx + i * ld_x, sizeof(double) * (size_t)n_x);
    }
    for (int32_t i = 0; i < n_u; i++) {
        for (int32_t j = 0; j < n_x; j++) { /* K xx */
            double sum = 0;
            for (int32_t l = 0; l < n_x; l++) {
                sum += s->gain[i * ld_x + l] * xx[l * ld_x + j];
            }
            s->joint[i * ld + n_u + j] = s->joint[(n_u + j) * ld + i] = sum;
        }
    }
    for (int32_t i = 0; i < n_u; i++) {
        for (int32_t j = 0; j <= i; j++) { /* K xx K^T + M_uu^-1 */
            double sum = s->rest[i * ld + j];
            for (int32_t l = 0; l < n_x; l++) {
                sum += s->joint[i * ld + n_u + l] * s->gain[j * ld_x + l];
            }
            s->joint[i * ld + j] = s->joint[j * ld + i] = sum;
        }
    }
}

/* Covariance of x_{k+1} = F_k w_k from s->joint, which becomes F joint row by row. */
static void carry_on(rti_solver *s, int32_t k) {
    const qp_shape *shape = &s->shape;
    const qp_stage *stage = &s->trial.stages[k];
    const int32_t n_x = shape->n_x, n_z = shape->n_z;
    double *next = s->spread + (ptrdiff_t)(k + 1) * n_x * shape->ld_x;
    double *column = s->gaps, *rows = s->qp.rest_w; /* [n_x], [n_x x ld_z] a row at a time */
    for (int32_t i = 0; i < n_z; i++) {             /* joint F^T, in the first n_x columns */
        double *row = s->joint + i * shape->ld_z;
        memset(column, 0, sizeof(double) * (size_t)shape->ld_x);
        qp_forward(shape, stage, row, column);
        memcpy(row, column, sizeof(double) * (size_t)n_x);
    }
    for (int32_t j = 0; j < n_x; j++) {
        memset(rows, 0, sizeof(double) * (size_t)shape->ld_z);
        for (int32_t i = 0; i < n_z; i++) {
            rows[i] = s->joint[i * shape->ld_z + j];
        }
        memset(next + j * shape->ld_x, 0, sizeof(double) * (size_t)shape->ld_x);
        qp_forward(shape, stage, rows, next + j * shape->ld_x);
    }
}

static mhe_status find(rti_solver *s, mhe_error *err) {
    const qp_shape *shape = &s->shape;
    s->err = err;
    memcpy(s->trial.w, s->result, sizeof(double) * size_z(shape));
    if (!rti_evaluate(s, &s->trial, RTI_ALL)) {
        return s->failure != MHE_OK
                   ? s->failure
                   : mhe_fail(err, MHE_E_NUMERIC, "the result of the solve has no value");
    }
    hold(s);
    s->qp.stages = s->trial.stages;
    if (shape->n_p > 0) {
        border_begin(&s->qp);
    }
    if (!riccati_factor(&s->qp.riccati, s->trial.stages, s->qp.diagonal) ||
        riccati_is_singular(&s->qp.riccati) ||
        (shape->n_p > 0 && !border_factor(&s->qp, s->qp.fixed))) {
        return mhe_fail(err, MHE_E_NUMERIC,
                        "the costs do not determine the solution: their Hessian is singular");
    }
    if (shape->n_p > 0) {
        border_answers(&s->qp);
    }
    riccati_first(&s->qp.riccati, s->spread);
    for (int32_t k = 0; k < shape->N; k++) {
        join(s, k);
        carry_on(s, k);
    }
    s->has_result = 2;
    return MHE_OK;
}

/* [rows x columns] of a block of s->joint, of the caller's objective. */
static void give(const rti_solver *s, const double *from, int32_t ld, int32_t rows, int32_t columns,
                 double *to) {
    for (int32_t i = 0; i < rows && to != NULL; i++) {
        for (int32_t j = 0; j < columns; j++) {
            to[i * columns + j] = s->scale * from[i * ld + j];
        }
    }
}

/* Answer of entry i of node k to parameter j, W of border.c. */
static double answer(const rti_solver *s, int32_t j, int32_t k, int32_t i) {
    return s->qp.border->W[(size_t)j * size_z(&s->shape) + (size_t)(k * s->shape.ld_z + i)];
}

/* Column j of the parameters' covariance -> border->dp. */
static const double *covariance_p(const rti_solver *s, int32_t j) {
    double *column = s->qp.border->dp;
    const ptrdiff_t at = (ptrdiff_t)(s->shape.N + 1) * s->shape.ld_z;
    memset(column, 0, sizeof(double) * (size_t)s->shape.ld_p);
    if (!s->qp.fixed[at + j]) {
        column[j] = 1;
        border_solve(&s->qp, column);
    }
    return column;
}

/* What is left where p is known, and what p brings: cov(p, w) = pp W^T, cov(w) += W pp W^T. Rows
 * from `row`, columns from `column` of (u, x). */
static void add_parameters(const rti_solver *s, int32_t k, int32_t row, int32_t column,
                           int32_t n_rows, int32_t n_columns, double *to) {
    for (int32_t l = 0; l < s->shape.n_p && to != NULL; l++) {
        const double *pp = covariance_p(s, l);
        for (int32_t i = 0; i < n_rows; i++) {
            double of_row = 0;
            for (int32_t j = 0; j < s->shape.n_p; j++) {
                of_row += pp[j] * answer(s, j, k, row + i);
            }
            for (int32_t j = 0; j < n_columns; j++) {
                to[i * n_columns + j] += s->scale * of_row * answer(s, l, k, column + j);
            }
        }
    }
}

/* cov(p, w) of n entries from `first` of (u, x) of node k. */
static void give_parameters(const rti_solver *s, int32_t k, int32_t first, int32_t n, double *to) {
    for (int32_t j = 0; j < s->shape.n_p && to != NULL; j++) {
        const double *pp = covariance_p(s, j);
        for (int32_t i = 0; i < n; i++) {
            double sum = 0;
            for (int32_t l = 0; l < s->shape.n_p; l++) {
                sum += pp[l] * answer(s, l, k, first + i);
            }
            to[j * n + i] = s->scale * sum;
        }
    }
}

mhe_status rti_covariance(void *self, const mhe_covariance *out, mhe_error *err) {
    rti_solver *s = self;
    const int32_t n_x = s->shape.n_x, n_u = s->shape.n_u, n_p = s->shape.n_p, k = out->node;
    const int32_t ld = s->shape.ld_z, ld_x = s->shape.ld_x;
    if (!s->has_result || k < 0 || k > s->shape.N) {
        return mhe_fail(err, MHE_E_ARGUMENT,
                        s->has_result ? "there is no such node" : "there is no result of a solve");
    }
    const mhe_status status = s->has_result == 2 ? MHE_OK : find(s, err);
    if (status != MHE_OK) {
        return status;
    }
    give(s, s->spread + (ptrdiff_t)k * n_x * ld_x, ld_x, n_x, n_x, out->xx);
    add_parameters(s, k, n_u, n_u, n_x, n_x, out->xx);
    give_parameters(s, k, n_u, n_x, out->px);
    if (k < s->shape.N && (out->ux != NULL || out->uu != NULL)) {
        join(s, k);
        give(s, s->joint + n_u, ld, n_u, n_x, out->ux);
        give(s, s->joint, ld, n_u, n_u, out->uu);
        add_parameters(s, k, 0, n_u, n_u, n_x, out->ux);
        add_parameters(s, k, 0, 0, n_u, n_u, out->uu);
    }
    if (k < s->shape.N) {
        give_parameters(s, k, 0, n_u, out->pu);
    }
    for (int32_t j = 0; j < n_p && out->pp != NULL; j++) {
        give(s, covariance_p(s, j), 0, 1, n_p, out->pp + j * n_p);
    }
    return MHE_OK;
}
