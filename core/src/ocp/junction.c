/* SPDX-License-Identifier: Apache-2.0 */
#include "ocp/junction.h"

#include <string.h>

/* Entries of a scalar equation of their own take their own control: A and B keep their pattern. */
static int32_t is_diagonal(const mhe_layout *l, int32_t i, int32_t *owner) {
    for (int32_t b = 0; b < l->n_blocks; b++) {
        const mhe_block *block = mhe_layout_at(l, b);
        if (block->role == MHE_ROLE_STATE && i >= block->first && i < block->first + block->count) {
            *owner = block->owner[i - block->first];
            return block->structure == MHE_STRUCTURE_DIAGONAL;
        }
    }
    return 0;
}

mhe_status mhi_junction_create(const mhi_system *system, const int32_t *place, mhi_arena *arena,
                               mhi_junction *j, mhe_error *err) {
    const mhe_system *f = mhi_system_face(system);
    int32_t n_dense = 0, n_diagonal = 0, owner = -1;
    for (int32_t i = 0; i < f->n_x; i++) {
        n_diagonal += is_diagonal(f->layout, i, &owner);
    }
    n_dense = f->n_x - n_diagonal;
    *j = (mhi_junction){.n = (n_dense + f->n_u - 1) / f->n_u + (n_diagonal > 0),
                        .n_x = f->n_x,
                        .n_all = f->n_x,
                        .n_u = f->n_u,
                        .place = place};
    j->control = MHI_TAKE(arena, int32_t, j->n * f->n_x);
    if (j->control == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t k = 0; k < j->n * f->n_x; k++) {
        j->control[k] = -1;
    }
    for (int32_t i = 0, dense = 0; i < f->n_x; i++) {
        if (is_diagonal(f->layout, i, &owner)) {
            j->control[(j->n - 1) * f->n_x + i] = owner;
        } else {
            j->control[dense / f->n_u * f->n_x + i] = dense % f->n_u;
            dense++;
        }
    }
    return MHE_OK;
}

void mhi_junction_step(const mhi_junction *j, int32_t number, const double *x, const double *u,
                       int32_t n_p, const mhe_stage_values *out) {
    const int32_t n_x = j->n_x, n_u = j->n_u, *control = j->control + number * n_x;
    const int32_t n_all = j->n_all;
    if (out->A != NULL) {
        memset(out->A, 0, sizeof(double) * (size_t)(n_all * n_all));
        memset(out->B, 0, sizeof(double) * (size_t)(n_all * n_u));
    }
    if (out->P != NULL) {
        memset(out->P, 0, sizeof(double) * (size_t)(n_all * n_p));
    }
    memset(out->x_next + n_x, 0, sizeof(double) * (size_t)(n_all - n_x));
    for (int32_t i = 0; i < n_x; i++) {
        const int32_t c = control[i];
        out->x_next[i] = c >= 0 ? u[c] : number > 0 ? x[i] : 0;
        if (out->A != NULL && c >= 0) {
            out->B[i * n_u + c] = 1;
        } else if (out->A != NULL && number > 0) {
            out->A[i * n_all + i] = 1;
        }
    }
}

void mhi_junction_cost(const mhi_junction *j, int32_t number, const double *u,
                       const mhe_stage_values *out) {
    const int32_t *control = j->control + number * j->n_x;
    double cost = 0;
    if (out->grad_u != NULL) {
        memset(out->grad_u, 0, sizeof(double) * (size_t)j->n_u);
    }
    if (out->hess_uu != NULL) {
        memset(out->hess_uu, 0, sizeof(double) * (size_t)(j->n_u * j->n_u));
    }
    if (out->hess_ux != NULL) {
        memset(out->hess_ux, 0, sizeof(double) * (size_t)(j->n_u * j->n_all));
    }
    for (int32_t c = 0; c < j->n_u; c++) {
        int32_t sets = 0;
        for (int32_t i = 0; i < j->n_x; i++) {
            sets |= control[i] == c;
        }
        if (sets) {
            continue;
        }
        cost += 0.5 * u[c] * u[c];
        if (out->grad_u != NULL) {
            out->grad_u[c] = u[c];
        }
        if (out->hess_uu != NULL) {
            out->hess_uu[c * j->n_u + c] = 1;
        }
    }
    if (out->cost != NULL) {
        *out->cost += cost;
    }
}
