/* SPDX-License-Identifier: Apache-2.0 */
/* sensitivity.c: derivatives of a step by the implicit function theorem.
 *
 * The stage equations K = f(stages) have the Jacobian J (factored). q+ and v+ are linear in K, so
 *     W = [h^2 b A; h b] J^-1   [2 n_q x s n_q]
 * turns any change of a right-hand side f_j into a change of (q+, v+): 2 n_q solves with J^T
 * instead of one a parameter, n_q of one stage. All loops run along rows that the compiler
 * vectorises. */
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

/* Of one stage what it does to q+ is a share of what it does to v+: the latter alone, [n_q x n_q].
 * Returns the share. */
static double rk_adjoint_of_one(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_q = c->rk->system->n_q;
    memset(c->adjoint, 0, sizeof(double) * (size_t)(n_q * n_q));
    for (int32_t i = 0; i < n_q; i++) {
        c->adjoint[i * (n_q + 1)] = h * t->b[0];
    }
    rk_lu_solve_transposed(c->at->lu, n_q, c->at->pivots, c->adjoint, n_q);
    return h * t->bA[0] / t->b[0];
}

static void rk_add_identity(const struct rk_context *c, double h) {
    int32_t n_q = c->rk->system->n_q, two = c->rk->system->first_d;
    double *by_q = c->carry, *by_v = by_q + n_q * two;
    for (int32_t i = 0; i < n_q; i++) {
        by_q[i * two + i] += 1;
        by_v[i * two + n_q + i] += 1;
        by_v[i * two + i] += h;
    }
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
    rk_add_identity(c, h);
}

/* The same of one stage. */
static void rk_carry_of_one(struct rk_context *c, double h, double share) {
    int32_t n_q = c->rk->system->n_q, two = c->rk->system->first_d;
    double *by_q = c->carry, *by_v = by_q + n_q * two, ch = h * c->rk->mechanics.c[0];
    const double *w = c->adjoint;
    rk_product(n_q, n_q, 1, n_q, c->at->f_q, n_q, w, n_q, by_q + n_q, two);
    rk_product(n_q, n_q, 1, n_q, c->at->f_v, n_q, w, n_q, by_v + n_q, two);
    for (int32_t i = 0; i < n_q; i++) {
        double *q = by_q + i * two, *v = by_v + i * two;
        for (int32_t k = n_q; k < two; k++) {
            v[k] += ch * q[k];
        }
        for (int32_t k = 0; k < n_q; k++) {
            q[k] = share * q[n_q + k];
            v[k] = share * v[n_q + k];
        }
    }
    rk_add_identity(c, h);
}

/* Rows of (q+, v+) that the direct effects of a step go to. */
struct rk_rows {
    const double *w; /* [n_q x n] of a stage */
    double *to;      /* [n] rows of sens_next */
    int32_t n;
    int set; /* or added to it */
};

/* The direct effect of the activations of stage j. */
static void rk_direct_activations(struct rk_context *c, int32_t j, const struct rk_rows *rows) {
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q, n_m = system->n_m, n_d = system->n_d, n = rows->n;
    int32_t columns = c->columns, of_a = system->first_d, of_e = of_a + n_d;
    const double *stage_a_a = c->stage_a_a + j * n_m, *stage_a_e = c->stage_a_e + j * n_m;
    const double *f_a = c->at->f_a + j * n_q * n_m;
    if (n_d == 0) { /* they are the controls */
        rk_product(n, n_m, rows->set, n_q, rows->w, n, f_a, n_m, rows->to + of_e, columns);
        return;
    }
    rk_product(n, n_m, 1, n_q, rows->w, n, f_a, n_m, c->direct, n_m);
    for (int32_t i = 0; i < n; i++) {
        const double *row = c->direct + i * n_m;
        double *by_a = rows->to + i * columns + of_a, *by_e = rows->to + i * columns + of_e;
        if (rows->set) {
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

/* The same of all that acts on stage j. */
static void rk_direct_stage(struct rk_context *c, int32_t j, const struct rk_rows *rows) {
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q, n_r = system->n_r, n_p = system->n_p, columns = c->columns;
    int32_t of_r = system->first_d + system->n_d + system->n_m, of_p = of_r + n_r;
    rk_direct_activations(c, j, rows);
    if (n_r > 0) {
        rk_product(rows->n, n_r, rows->set, n_q, rows->w, rows->n, c->at->f_r + j * n_q * n_r, n_r,
                   rows->to + of_r, columns);
    }
    if (n_p > 0) {
        rk_product(rows->n, n_p, rows->set, n_q, rows->w, rows->n, c->at->f_p + j * n_q * n_p, n_p,
                   rows->to + of_p, columns);
    }
}

/* `set`: of the first stage there is nothing before it. */
static void rk_direct(struct rk_context *c, int set) {
    int32_t n_q = c->rk->system->n_q, two = c->rk->system->first_d;
    for (int32_t j = 0; j < c->rk->mechanics.stages; j++) {
        const struct rk_rows rows = {c->adjoint + j * n_q * two, c->sens_next, two, set && j == 0};
        rk_direct_stage(c, j, &rows);
    }
}

static void rk_direct_of_one(struct rk_context *c, double share) {
    int32_t n_q = c->rk->system->n_q, two = c->rk->system->first_d, columns = c->columns;
    const struct rk_rows rows = {c->adjoint, c->sens_next + n_q * columns, n_q, 1};
    rk_direct_stage(c, 0, &rows);
    for (int32_t i = 0; i < n_q; i++) {
        const double *v = rows.to + i * columns;
        double *q = c->sens_next + i * columns;
        for (int32_t k = two; k < columns; k++) {
            q[k] = share * v[k];
        }
    }
}

CLONES static void rk_chain_rows(struct rk_context *c, double h) {
    int32_t two = c->rk->system->first_d, columns = c->columns;
    const int one = c->rk->mechanics.stages == 1 && c->step == 0;
    const double share = one ? rk_adjoint_of_one(c, h) : 0;
    if (one) {
        rk_carry_of_one(c, h, share);
    } else {
        rk_adjoint(c, h);
        rk_carry(c, h);
    }
    for (int32_t i = 0; i < two && c->step == 0; i++) { /* sens is the identity */
        for (int32_t k = 0; k < two; k++) {
            c->sens_next[i * columns + k] = c->carry[k * two + i];
        }
    }
    if (c->step > 0) {
        rk_product(two, columns, 1, two, c->carry, two, c->sens, columns, c->sens_next, columns);
    }
    if (one) {
        rk_direct_of_one(c, share);
    } else {
        rk_direct(c, c->step == 0);
    }
    double *swap = c->sens;
    c->sens = c->sens_next;
    c->sens_next = swap;
}

void rk_chain(struct rk_context *c, double h) {
    rk_chain_rows(c, h);
}
