/* SPDX-License-Identifier: Apache-2.0 */
/* states.c: the muscles' states z (fibre lengths) beside the stage accelerations.
 *
 * z is stiff (1e4 1/s and more), so it is a part of the stage equations:
 *     Z_j = z + h sum_k A_jk h(q_k, v_k, a_k, Z_k, c),     K_j = f(q_j, v_j, a_j, Z_j, r)
 * A muscle's states see those of no other, so that Newton's equations for Z are a small block a
 * muscle, P^-1 = I - h A h_z. With g what the equations for Z are off by,
 *     dZ = P g + E dK,   E = P h A (h_q dq/dK + h_v dv/dK)
 * which leaves the n_q stage accelerations, (J - f_z E) dK = residual + f_z P g, J as without z.
 *
 * The scheme ends in its last stage (Radau IIA), and that is z at the end: a start off the slow
 * motion is forgotten, which Gauss schemes do not do. */
#include "../clones.h"
#include "rk.h"

#include <math.h>
#include <string.h>

/* What an error in z counts against one in v / (1 + |v|): tendons turn a fibre length into about
 * this many times the force. */
#define RK_STATE_WEIGHT 30

/* to [n] += factor * from [n] */
static inline void rk_add(double *restrict to, double factor, const double *restrict from,
                          int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        to[i] += factor * from[i];
    }
}

static int32_t rk_states_of(const mhe_system *system, int32_t m, const int32_t **z_of) {
    int32_t n = 0;
    *z_of = system->z_of + m * system->n_k;
    while (n < system->n_k && (*z_of)[n] >= 0) {
        n++;
    }
    return n;
}

/* a [n x n] becomes its inverse, by Gauss and Jordan with row pivots; 0: singular. */
static int rk_invert(double *a, int32_t n) {
    int32_t swapped[RK_MAX_STAGES * RK_MAX_STATES];
    for (int32_t k = 0; k < n; k++) {
        int32_t p = k;
        for (int32_t i = k + 1; i < n; i++) {
            p = fabs(a[i * n + k]) > fabs(a[p * n + k]) ? i : p;
        }
        swapped[k] = p;
        for (int32_t j = 0; p != k && j < n; j++) {
            double swap = a[k * n + j];
            a[k * n + j] = a[p * n + j];
            a[p * n + j] = swap;
        }
        if (!(fabs(a[k * n + k]) > 0)) {
            return 0;
        }
        double inverse = 1 / a[k * n + k];
        a[k * n + k] = 1;
        for (int32_t j = 0; j < n; j++) {
            a[k * n + j] *= inverse;
        }
        for (int32_t i = 0; i < n; i++) {
            double factor = a[i * n + k];
            if (i == k) {
                continue;
            }
            a[i * n + k] = 0;
            for (int32_t j = 0; j < n; j++) {
                a[i * n + j] -= factor * a[k * n + j];
            }
        }
    }
    for (int32_t k = n - 1; k >= 0; k--) {
        for (int32_t i = 0; swapped[k] != k && i < n; i++) {
            double swap = a[i * n + k];
            a[i * n + k] = a[i * n + swapped[k]];
            a[i * n + swapped[k]] = swap;
        }
    }
    return 1;
}

/* The blocks P. */
static int rk_state_blocks(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    const mhe_system *system = c->rk->system;
    int32_t s = t->stages, n_z = system->n_z, n_k = system->n_k;
    for (int32_t m = 0; m < system->n_m; m++) {
        const int32_t *z_of;
        int32_t k = rk_states_of(system, m, &z_of), n = s * k;
        double *p = c->at->P + m * s * n_k * s * n_k;
        for (int32_t row = 0; row < n; row++) {
            for (int32_t column = 0; column < n; column++) {
                int32_t j = row / k, l = column / k;
                const double *h_z = c->at->h_z + (l * n_z + z_of[row % k]) * n_k;
                p[row * n + column] =
                    (row == column ? 1.0 : 0.0) - h * t->A[j * s + l] * h_z[column % k];
            }
        }
        if (!rk_invert(p, n)) {
            return 0;
        }
    }
    return 1;
}

/* x [s n_z x m], row-major: the blocks P times it; `from` another array of that size. */
CLONES static void rk_state_solve(struct rk_context *c, const double *from, double *x, int32_t m) {
    const mhe_system *system = c->rk->system;
    int32_t s = c->rk->mechanics.stages, n_z = system->n_z, n_k = system->n_k;
    for (int32_t muscle = 0; muscle < system->n_m; muscle++) {
        const int32_t *z_of;
        int32_t k = rk_states_of(system, muscle, &z_of), n = s * k;
        const double *p = c->at->P + muscle * s * n_k * s * n_k;
        for (int32_t row = 0; row < n; row++) {
            double *to = x + (row / k * n_z + z_of[row % k]) * m;
            memset(to, 0, sizeof(double) * (size_t)m);
            for (int32_t column = 0; column < n; column++) {
                rk_add(to, p[row * n + column], from + (column / k * n_z + z_of[column % k]) * m,
                       m);
            }
        }
    }
}

/* E [s n_z x s n_q]. */
static void rk_state_response(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    const mhe_system *system = c->rk->system;
    int32_t s = t->stages, n_q = system->n_q, n_z = system->n_z, n = s * n_q;
    memset(c->by_K, 0, sizeof(double) * (size_t)(s * n_z * n));
    for (int32_t l = 0; l < s; l++) {
        const double *h_q = c->at->h_q + l * n_z * n_q, *h_v = c->at->h_v + l * n_z * n_q;
        for (int32_t k = 0; k < s; k++) {
            double by_q = h * h * t->AA[l * s + k], by_v = h * t->A[l * s + k];
            for (int32_t j = 0; j < s; j++) {
                double a = h * t->A[j * s + l];
                for (int32_t p = 0; p < n_z; p++) {
                    double *row = c->by_K + (j * n_z + p) * n + k * n_q;
                    for (int32_t i = 0; i < n_q; i++) {
                        row[i] += a * (by_q * h_q[p * n_q + i] + by_v * h_v[p * n_q + i]);
                    }
                }
            }
        }
    }
    rk_state_solve(c, c->by_K, c->at->E, n);
}

int rk_states_factor(struct rk_context *c, double h) {
    const mhe_system *system = c->rk->system;
    int32_t s = c->rk->mechanics.stages, n_q = system->n_q, n_z = system->n_z, n = s * n_q;
    if (!rk_state_blocks(c, h)) {
        return 0;
    }
    rk_state_response(c, h);
    for (int32_t j = 0; j < s; j++) {
        for (int32_t i = 0; i < n_q; i++) {
            double *row = c->at->lu + (j * n_q + i) * n;
            const double *f_z = c->at->f_z + (j * n_q + i) * n_z;
            for (int32_t p = 0; p < n_z; p++) {
                rk_add(row, -f_z[p], c->at->E + (j * n_z + p) * n, n);
            }
        }
    }
    return 1;
}

void rk_states_offset(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    int32_t s = t->stages, n_z = c->rk->system->n_z;
    for (int32_t j = 0; j < s; j++) {
        double *g = c->offset + j * n_z;
        for (int32_t p = 0; p < n_z; p++) {
            g[p] = c->z[p] - c->Z[j * n_z + p];
        }
        for (int32_t k = 0; k < s; k++) {
            rk_add(g, h * t->A[j * s + k], c->H + k * n_z, n_z);
        }
    }
}

/* to [s n_q x m] += f_z of each stage times its rows of z [s n_z x m] */
CLONES static void rk_state_push(const struct rk_context *c, const double *z, double *to,
                                 int32_t m) {
    int32_t n_z = c->rk->system->n_z, n_q = c->rk->system->n_q;
    for (int32_t k = 0; k < c->rk->mechanics.stages * n_q; k++) {
        const double *f_z = c->at->f_z + k * n_z;
        for (int32_t p = 0; p < n_z; p++) {
            rk_add(to + k * m, f_z[p], z + (k / n_q * n_z + p) * m, m);
        }
    }
}

void rk_states_before(struct rk_context *c) {
    rk_state_solve(c, c->offset, c->dz, 1);
    rk_state_push(c, c->dz, c->residual, 1);
}

double rk_states_after(struct rk_context *c) {
    int32_t n_q = c->rk->system->n_q, s = c->rk->mechanics.stages, n = s * n_q;
    double largest = 0, sum = 0;
    for (int32_t p = 0; p < s * c->rk->system->n_z; p++) {
        double change = c->dz[p];
        for (int32_t i = 0; i < n; i++) {
            change += c->at->E[p * n + i] * c->residual[i];
        }
        c->Z[p] += change;
        largest = fmax(largest, fabs(change));
        sum += change;
    }
    return isfinite(sum) ? RK_STATE_WEIGHT * largest : NAN;
}

void rk_states_recall(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    const mhe_system *system = c->rk->system;
    const struct rk_slot *at = c->at;
    int32_t s = t->stages, n_q = system->n_q, n_z = system->n_z, n_m = system->n_m;
    for (int32_t j = 0; j < s; j++) { /* what the rates have changed by, at the stages as known */
        for (int32_t p = 0; p < n_z; p++) {
            int32_t m = system->z_muscle[p], k = j * n_z + p;
            double sum = at->h_c[k] * (c->u[m] - at->u[m]);
            for (int32_t i = 0; i < n_q; i++) {
                double dv = c->v[i] - at->v[i];
                sum += at->h_q[k * n_q + i] * (c->q[i] - at->q[i] + h * t->c[j] * dv) +
                       at->h_v[k * n_q + i] * dv;
            }
            if (system->n_a > 0) {
                sum += at->h_a[k] * (c->stage_a[j * n_m + m] - at->stage_a[j * n_m + m]);
            }
            c->H[k] = sum;
        }
    }
    for (int32_t j = 0; j < s; j++) {
        for (int32_t p = 0; p < n_z; p++) {
            c->offset[j * n_z + p] = c->z[p] - at->z[p];
        }
        for (int32_t k = 0; k < s; k++) {
            rk_add(c->offset + j * n_z, h * t->A[j * s + k], c->H + k * n_z, n_z);
        }
    }
    memcpy(c->Z, at->Z, sizeof(double) * (size_t)(s * n_z));
    rk_states_before(c);
}

void rk_states_keep(const struct rk_context *c) {
    const mhe_system *system = c->rk->system;
    size_t n_z = (size_t)system->n_z;
    memcpy(c->kept.z, c->z, sizeof(double) * n_z);
    memcpy(c->kept.u, c->u, sizeof(double) * (size_t)system->n_m);
    memcpy(c->kept.Z, c->Z, sizeof(double) * n_z * (size_t)c->rk->mechanics.stages);
}

/* ---- derivatives of a step, for all columns of `sens` at once ---- */

/* What the columns do to the right-hand sides of stage j with K and Z held: R [n_q x columns] of f,
 * S [n_z x columns] of h. In the first step of an interval q and v are the first columns. */
CLONES static void rk_state_direct(struct rk_context *c, double h, int32_t j, double *R,
                                   double *S) {
    const mhe_system *system = c->rk->system;
    const struct rk_slot *at = c->at;
    int32_t n_q = system->n_q, n_z = system->n_z, n_m = system->n_m, n_r = system->n_r;
    int32_t n = c->columns, first_d = system->first_d, first_u = system->n_x;
    const double *q = c->sens, *v = c->sens + n_q * n;
    double ch = h * c->rk->mechanics.c[j];
    memset(R, 0, sizeof(double) * (size_t)(n_q * n));
    memset(S, 0, sizeof(double) * (size_t)(n_z * n));
    for (int32_t i = 0; i < n_q + n_z; i++) {
        int32_t k = i < n_q ? j * n_q + i : j * n_z + i - n_q;
        const double *by_q = (i < n_q ? at->f_q : at->h_q) + k * n_q;
        const double *by_v = (i < n_q ? at->f_v : at->h_v) + k * n_q;
        double *row = i < n_q ? R + i * n : S + (i - n_q) * n;
        for (int32_t m = 0; m < n_q; m++) {
            if (c->step == 0) {
                row[m] = by_q[m];
                row[n_q + m] = ch * by_q[m] + by_v[m];
            } else if (by_q[m] != 0 || by_v[m] != 0) { /* muscles cross few joints */
                rk_add(row, by_q[m], q + m * n, n);
                rk_add(row, ch * by_q[m] + by_v[m], v + m * n, n);
            }
        }
    }
    for (int32_t i = 0; i < n_q; i++) {
        const double *f_a = at->f_a + (j * n_q + i) * n_m, *f_r = at->f_r + (j * n_q + i) * n_r;
        double *row = R + i * n;
        for (int32_t m = 0; m < n_m && system->n_a > 0; m++) {
            row[first_u + m] += f_a[m] * c->stage_a_e[j * n_m + m];
        }
        for (int32_t m = 0; m < n_m && system->n_d > 0; m++) {
            row[first_d + m] += f_a[m] * c->stage_a_a[j * n_m + m];
        }
        for (int32_t k = 0; k < n_r; k++) {
            row[first_u + n_m + k] += f_r[k];
        }
    }
    for (int32_t i = 0; i < n_q + n_z && system->n_p > 0; i++) {
        int32_t n_p = system->n_p;
        const double *by_p =
            i < n_q ? at->f_p + (j * n_q + i) * n_p : at->h_p + (j * n_z + i - n_q) * n_p;
        rk_add((i < n_q ? R + i * n : S + (i - n_q) * n) + first_u + system->n_u, 1, by_p, n_p);
    }
    for (int32_t p = 0; p < n_z; p++) {
        int32_t m = system->z_muscle[p];
        double *row = S + p * n, h_a = system->n_a > 0 ? at->h_a[j * n_z + p] : 0;
        row[first_u + m] += at->h_c[j * n_z + p] + h_a * c->stage_a_e[j * n_m + m];
        if (system->n_d > 0) {
            row[first_d + m] += h_a * c->stage_a_a[j * n_m + m];
        }
    }
}

/* At the start of an interval the states are the columns. */
static void rk_state_identity(struct rk_context *c) {
    const mhe_system *system = c->rk->system;
    int32_t two = system->first_d, n = c->columns;
    memset(c->sens, 0, sizeof(double) * (size_t)((two + system->n_z) * n));
    for (int32_t i = 0; i < two; i++) {
        c->sens[i * n + i] = 1;
    }
    for (int32_t p = 0; p < system->n_z; p++) {
        c->sens[(two + p) * n + system->first_z + p] = 1;
    }
}

CLONES static void rk_state_chain(struct rk_context *c, double h) {
    const struct rk_tableau *t = &c->rk->mechanics;
    const mhe_system *system = c->rk->system;
    int32_t s = t->stages, n_q = system->n_q, n_z = system->n_z, n = c->columns;
    double *q = c->sens, *v = q + n_q * n, *z = v + n_q * n;
    double *R = c->wide_K, *S = c->wide_H, *T = c->wide_Z;
    for (int32_t j = 0; j < s; j++) {
        rk_state_direct(c, h, j, R + j * n_q * n, S + j * n_z * n);
    }
    for (int32_t j = 0; j < s; j++) {
        double *to = T + j * n_z * n;
        memcpy(to, z, sizeof(double) * (size_t)(n_z * n));
        for (int32_t k = 0; k < s; k++) {
            rk_add(to, h * t->A[j * s + k], S + k * n_z * n, n_z * n);
        }
    }
    rk_state_solve(c, T, S, n);
    rk_state_push(c, S, R, n);
    rk_lu_solve_columns(c->at->lu, s * n_q, c->at->pivots, R, n);
    for (int32_t p = 0; p < n_z; p++) { /* the last stage is the end */
        const double *E = c->at->E + ((s - 1) * n_z + p) * s * n_q;
        memcpy(z + p * n, S + ((s - 1) * n_z + p) * n, sizeof(double) * (size_t)n);
        for (int32_t k = 0; k < s * n_q; k++) {
            if (E[k] != 0) {
                rk_add(z + p * n, E[k], R + k * n, n);
            }
        }
    }
    rk_add(q, h, v, n_q * n);
    for (int32_t k = 0; k < s; k++) {
        rk_add(q, h * h * t->bA[k], R + k * n_q * n, n_q * n);
        rk_add(v, h * t->b[k], R + k * n_q * n, n_q * n);
    }
}

void rk_states_chain(struct rk_context *c, double h) {
    if (c->step == 0) {
        rk_state_identity(c);
    }
    rk_state_chain(c, h);
}

int rk_states_advance(struct rk_context *c) {
    int32_t n_z = c->rk->system->n_z;
    double sum = 0;
    memcpy(c->z, c->Z + (c->rk->mechanics.stages - 1) * n_z, sizeof(double) * (size_t)n_z);
    for (int32_t p = 0; p < n_z; p++) {
        sum += c->z[p];
    }
    return isfinite(sum);
}
