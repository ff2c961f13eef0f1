/* SPDX-License-Identifier: Apache-2.0 */
/* sensitivity.c: derivatives of a step by the implicit function theorem.
 *
 * The stage equations K = f(stages) have the Jacobian J (factored). q+ and v+ are linear in K, so
 *     W = [h^2 b A; h b] J^-1   [2 n_q x s n_q]
 * turns any change of a right-hand side f_j into a change of (q+, v+): 2 n_q solves with J^T
 * instead of one a parameter. All loops run along rows that the compiler vectorises. */
#include "../clones.h"
#include "rk.h"

#include <string.h>

/* to [n] += factor * from [n] */
static inline void rk_add(double *restrict to, double factor, const double *restrict from,
                          int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        to[i] += factor * from[i];
    }
}

/* The transpose of W: row j n_q + k holds what a change of the k-th right-hand side of stage j does
 * to (q+, v+). */
static void rk_adjoint(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_q = c->rk->system->n_q, s = t->stages, n = s * n_q, two = 2 * n_q;
    memset(c->adjoint, 0, sizeof(double) * (size_t)(n * two));
    for (int32_t j = 0; j < s; j++) {
        for (int32_t i = 0; i < n_q; i++) {
            double *row = c->adjoint + (j * n_q + i) * two;
            row[i] = h * h * t->bA[j];
            row[n_q + i] = h * t->b[j];
        }
    }
    rk_lu_solve_transposed(c->at->lu, n, c->at->pivots, c->adjoint, two);
}

/* The transpose of d(q+, v+)/d(q, v) of this step. */
static void rk_carry(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_q = c->rk->system->n_q, s = t->stages, two = 2 * n_q;
    double *by_q = c->carry, *by_v = by_q + n_q * two;
    memset(c->carry, 0, sizeof(double) * (size_t)(two * two));
    for (int32_t i = 0; i < n_q; i++) {
        by_q[i * two + i] = by_v[i * two + n_q + i] = 1;
        by_v[i * two + i] = h;
    }
    for (int32_t k = 0; k < s * n_q; k++) {
        const double *w = c->adjoint + k * two;
        double ch = h * t->c[k / n_q];
        const double *f_q = c->at->f_q + k * n_q, *f_v = c->at->f_v + k * n_q;
        for (int32_t m = 0; m < n_q; m++) {
            rk_add(by_q + m * two, f_q[m], w, two);
            rk_add(by_v + m * two, ch * f_q[m] + f_v[m], w, two);
        }
    }
}

/* Adds the direct effect of stage activations and residual torques on (q+, v+)_i to `next`, its row
 * of sens_next. */
static void rk_direct(struct rk_context *c, int32_t i, double *next) {
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q, n_m = system->n_m, n_r = system->n_r, n_d = system->n_d;
    double *by_a = next + 2 * n_q, *by_e = by_a + n_d, *by_r = by_e + n_m, *row = c->row;
    double *by_p = by_r + n_r;
    int32_t n_p = system->n_p;
    for (int32_t j = 0; j < c->rk->mechanics.stages; j++) {
        const double *stage_a_a = c->stage_a_a + j * n_m, *stage_a_e = c->stage_a_e + j * n_m;
        memset(row, 0, sizeof(double) * (size_t)n_m);
        for (int32_t k = j * n_q; k < (j + 1) * n_q; k++) {
            double w = c->adjoint[k * 2 * n_q + i];
            rk_add(row, w, c->at->f_a + k * n_m, n_m);
            rk_add(by_r, w, c->at->f_r + k * n_r, n_r);
            if (n_p > 0) {
                rk_add(by_p, w, c->at->f_p + k * n_p, n_p);
            }
        }
        for (int32_t m = 0; m < n_d; m++) {
            by_a[m] += row[m] * stage_a_a[m];
        }
        for (int32_t m = 0; m < n_m; m++) {
            by_e[m] += row[m] * stage_a_e[m];
        }
    }
}

CLONES static void rk_chain_rows(struct rk_context *c, double h) {
    int32_t two = 2 * c->rk->system->n_q, columns = c->columns;
    rk_adjoint(c, h);
    rk_carry(c, h);
    for (int32_t i = 0; i < two; i++) {
        double *next = c->sens_next + i * columns;
        memset(next, 0, sizeof(double) * (size_t)columns);
        for (int32_t k = 0; k < two; k++) {
            if (c->step == 0) { /* sens is the identity */
                next[k] = c->carry[k * two + i];
            } else {
                rk_add(next, c->carry[k * two + i], c->sens + k * columns, columns);
            }
        }
        rk_direct(c, i, next);
    }
    double *swap = c->sens;
    c->sens = c->sens_next;
    c->sens_next = swap;
}

void rk_chain(struct rk_context *c, double h) {
    rk_chain_rows(c, h);
}
