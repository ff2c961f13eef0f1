/* SPDX-License-Identifier: Apache-2.0 */
/* constant_rows.h: equations of a stage problem in which nothing is free.
 *
 * Where bounds leave an activation and its excitation one value each, x_{k+1} = F(x_k, u_k) of that
 * activation holds or does not, whatever the solver does: it takes no variable away from the
 * others. */
#ifndef CONSTANT_ROWS_H
#define CONSTANT_ROWS_H

#include <mhe/solver.h>

#include <stddef.h>

/* Is one of the variables free that the row's derivatives may be other than 0 in? */
static inline int32_t row_has_free(const uint8_t *pattern, const double *lower, const double *upper,
                                   int32_t n) {
    for (int32_t j = 0; j < n; j++) {
        if (pattern[j] && lower[j] < upper[j]) {
            return 1;
        }
    }
    return 0;
}

/* Their number; `constant` [N x n_x] says which they are (NULL: is not asked). */
static inline int32_t constant_rows(const mhe_stage_problem *p, uint8_t *constant) {
    const int32_t n_x = p->n_x, n_u = p->n_u;
    int32_t n = 0, parameters = 0;
    for (int32_t i = 0; i < p->n_p; i++) {
        parameters |= p->p_lower[i] < p->p_upper[i];
    }
    for (int32_t k = 0; k < p->n_intervals; k++) {
        const double *x_lower = p->x_lower + (ptrdiff_t)k * n_x;
        const double *x_upper = p->x_upper + (ptrdiff_t)k * n_x;
        const double *u_lower = p->u_lower + (ptrdiff_t)k * n_u;
        const double *u_upper = p->u_upper + (ptrdiff_t)k * n_u;
        for (int32_t i = 0; i < n_x; i++) {
            const int32_t is_free =
                parameters || x_lower[n_x + i] < x_upper[n_x + i] ||
                row_has_free(p->A_pattern + (ptrdiff_t)i * n_x, x_lower, x_upper, n_x) ||
                row_has_free(p->B_pattern + (ptrdiff_t)i * n_u, u_lower, u_upper, n_u);
            n += !is_free;
            if (constant != NULL) {
                constant[(ptrdiff_t)k * n_x + i] = (uint8_t)!is_free;
            }
        }
    }
    return n;
}

#endif
