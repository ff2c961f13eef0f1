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

/* The transpose of W: row j n_q + k holds what a change of the k-th right-hand side of stage j does
 * to (q+, v+). */
static void rk_adjoint(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_q = c->rk->system->n_q, s = t->stages, n = s * n_q, two = c->rk->system->first_d;
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
    int32_t n_q = c->rk->system->n_q, s = t->stages, two = c->rk->system->first_d;
    double *by_q = c->carry, *by_v = by_q + n_q * two;
    for (int32_t j = 0; j < s; j++) {
        const double *w = c->adjoint + j * n_q * two;
        double ch = h * t->c[j];
        double *part = j == 0 ? by_q : c->direct;
        rk_product(n_q, two, 1, n_q, c->at->f_q + j * n_q * n_q, n_q, w, two, part, two);
        rk_product(n_q, two, j == 0, n_q, c->at->f_v + j * n_q * n_q, n_q, w, two, by_v, two);
        for (int32_t i = 0; i < n_q * two; i++) {
            by_v[i] += ch * part[i];
        }
        for (int32_t i = 0; i < n_q * two && j > 0; i++) {
            by_q[i] += part[i];
        }
    }
    for (int32_t i = 0; i < n_q; i++) {
        by_q[i * two + i] += 1;
        by_v[i * two + n_q + i] += 1;
        by_v[i * two + i] += h;
    }
}

/* The direct effect of the activations of stage j on (q+, v+), by w [n_q x 2 n_q], set in sens_next
 * or added to it. */
static void rk_direct_activations(struct rk_context *c, int32_t j, int set, const double *w) {
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q, n_m = system->n_m, n_d = system->n_d;
    int32_t two = system->first_d, columns = c->columns, of_a = two, of_e = of_a + n_d;
    const double *stage_a_a = c->stage_a_a + j * n_m, *stage_a_e = c->stage_a_e + j * n_m;
    const double *f_a = c->at->f_a + j * n_q * n_m;
    if (n_d == 0) { /* they are the controls */
        rk_product(two, n_m, set, n_q, w, two, f_a, n_m, c->sens_next + of_e, columns);
        return;
    }
    rk_product(two, n_m, 1, n_q, w, two, f_a, n_m, c->direct, n_m);
    for (int32_t i = 0; i < two; i++) {
        const double *row = c->direct + i * n_m;
        double *by_a = c->sens_next + i * columns + of_a;
        double *by_e = c->sens_next + i * columns + of_e;
        if (set) {
            memset(by_a, 0, sizeof *by_a * (size_t)(n_d + n_m));
        }
        for (int32_t m = 0; m < n_d; m++) {
            by_a[m] += row[m] * stage_a_a[m];
        }
        for (int32_t m = 0; m < n_m; m++) {
            by_e[m] += row[m] * stage_a_e[m];
        }
    }
}

/* The same of stage activations, residual torques and parameters of all stages; `set`: of the
 * first there is nothing before it. */
static void rk_direct(struct rk_context *c, int set) {
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q, n_r = system->n_r, n_p = system->n_p;
    int32_t two = system->first_d, columns = c->columns;
    int32_t of_r = two + system->n_d + system->n_m, of_p = of_r + n_r;
    for (int32_t j = 0; j < c->rk->mechanics.stages; j++) {
        const double *w = c->adjoint + j * n_q * two;
        const int first = set && j == 0;
        rk_direct_activations(c, j, first, w);
        if (n_r > 0) {
            rk_product(two, n_r, first, n_q, w, two, c->at->f_r + j * n_q * n_r, n_r,
                       c->sens_next + of_r, columns);
        }
        if (n_p > 0) {
            rk_product(two, n_p, first, n_q, w, two, c->at->f_p + j * n_q * n_p, n_p,
                       c->sens_next + of_p, columns);
        }
    }
}

CLONES static void rk_chain_rows(struct rk_context *c, double h) {
    int32_t two = c->rk->system->first_d, columns = c->columns;
    rk_adjoint(c, h);
    rk_carry(c, h);
    for (int32_t i = 0; i < two && c->step == 0; i++) { /* sens is the identity */
        for (int32_t k = 0; k < two; k++) {
            c->sens_next[i * columns + k] = c->carry[k * two + i];
        }
    }
    if (c->step > 0) {
        rk_product(two, columns, 1, two, c->carry, two, c->sens, columns, c->sens_next, columns);
    }
    rk_direct(c, c->step == 0);
    double *swap = c->sens;
    c->sens = c->sens_next;
    c->sens_next = swap;
}

void rk_chain(struct rk_context *c, double h) {
    rk_chain_rows(c, h);
}
