/* SPDX-License-Identifier: Apache-2.0 */
/* sensitivity.c: derivatives of a step by the implicit function theorem.
 *
 * The stage equations K = f(stages) have the Jacobian J (factored). q+ and v+ are linear in K, so
 *     W = [h^2 b A; h b] J^-1   [2 n_q x s n_q]
 * turns any change of a right-hand side f_j into a change of (q+, v+): 2 n_q solves with J^T
 * instead of one a parameter. */
#include "lapack.h"
#include "rk.h"

#include <string.h>

/* W, row-major: its rows are the columns LAPACK solves for. */
static void rk_adjoint(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_q = c->rk->system->n_q, s = t->stages, n = s * n_q, two = 2 * n_q, info = 0;
    memset(c->adjoint, 0, sizeof(double) * (size_t)(two * n));
    for (int32_t i = 0; i < n_q; i++) {
        for (int32_t j = 0; j < s; j++) {
            c->adjoint[i * n + j * n_q + i] = h * h * t->bA[j];
            c->adjoint[(n_q + i) * n + j * n_q + i] = h * t->b[j];
        }
    }
    dgetrs_("N", &n, &two, c->jacobian, &n, c->pivots, c->adjoint, &n, &info);
}

/* carry = d(q+, v+)/d(q, v) of this step. */
static void rk_carry(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t n_q = c->rk->system->n_q, s = t->stages, n = s * n_q, two = 2 * n_q;
    for (int32_t i = 0; i < two; i++) {
        double *by_q = c->carry + i * two, *by_v = by_q + n_q;
        memset(by_q, 0, sizeof(double) * (size_t)two);
        by_q[i] = 1;
        if (i < n_q) {
            by_v[i] = h;
        }
        for (int32_t j = 0; j < s; j++) {
            const double *w = c->adjoint + i * n + j * n_q;
            const double *f_q = c->f_q + j * n_q * n_q, *f_v = c->f_v + j * n_q * n_q;
            for (int32_t k = 0; k < n_q; k++) {
                for (int32_t m = 0; m < n_q; m++) {
                    double wf = w[k] * f_q[k * n_q + m];
                    by_q[m] += wf;
                    by_v[m] += h * t->c[j] * wf + w[k] * f_v[k * n_q + m];
                }
            }
        }
    }
}

/* Adds the direct effect of stage activations and residual torques to sens_next. */
static void rk_direct(struct rk_context *c) {
    const mhe_system *system = c->rk->system;
    int32_t n_q = system->n_q, n_m = system->n_m, n_r = system->n_r, n_a = system->n_a;
    int32_t s = c->rk->mechanics.stages, n = s * n_q;
    for (int32_t i = 0; i < 2 * n_q; i++) {
        double *by_a = c->sens_next + i * c->columns + 2 * n_q;
        double *by_e = by_a + n_a, *by_r = by_e + n_m;
        for (int32_t j = 0; j < s; j++) {
            const double *w = c->adjoint + i * n + j * n_q;
            for (int32_t m = 0; m < n_m; m++) {
                double wf = 0;
                for (int32_t k = 0; k < n_q; k++) {
                    wf += w[k] * c->f_a[(j * n_q + k) * n_m + m];
                }
                if (n_a > 0) {
                    by_a[m] += wf * c->stage_a_a[j * n_m + m];
                }
                by_e[m] += wf * c->stage_a_e[j * n_m + m];
            }
            for (int32_t k = 0; k < n_q; k++) {
                for (int32_t m = 0; m < n_r; m++) {
                    by_r[m] += w[k] * c->f_r[(j * n_q + k) * n_r + m];
                }
            }
        }
    }
}

void rk_chain(struct rk_context *c, double h) {
    int32_t two = 2 * c->rk->system->n_q, columns = c->columns;
    rk_adjoint(c, h);
    rk_carry(c, h);
    for (int32_t i = 0; i < two; i++) {
        double *next = c->sens_next + i * columns;
        memset(next, 0, sizeof(double) * (size_t)columns);
        for (int32_t k = 0; k < two; k++) {
            double by = c->carry[i * two + k];
            for (int32_t m = 0; m < columns; m++) {
                next[m] += by * c->sens[k * columns + m];
            }
        }
    }
    rk_direct(c);
    double *swap = c->sens;
    c->sens = c->sens_next;
    c->sens_next = swap;
}
