/* SPDX-License-Identifier: Apache-2.0 */
/* active_update.c: the system of a set by the factors of one before it.
 *
 * Most sets differ from the one before in a few bounds, and a factorisation costs as much as
 * several solutions. What comes to a bound is held there by an unknown force; what leaves one is
 * moved off it by an unknown distance. The factors answer to each of one unit, and a system as
 * small as the changes are few says how much of each it takes (a Schur complement, as in Gill,
 * Murray, Saunders and Wright 1990, "A Schur-complement method for sparse quadratic programming",
 * in Reliable Numerical Computation, Oxford). Exact but for rounding; what that leaves is measured
 * as ever, and where it is too much the set is factorised. */
#include "active.h"

#include "../clones.h"

#include <math.h>
#include <string.h>

#define L KALMAN_LANES
#define LEAST_PIVOT 1e-12
#define MANY 5 /* changes, or systems before, after which there are more as a rule: */
#define SOME 2
#define EARLIER 2          /* stages before the first change in which the next may be, as a rule */
#define LEAST_FREEDOM 1e-6 /* of what its cost alone would leave a control */

/* ---- memory ---- */

size_t update_size(const qp_shape *s) {
    return kalman_takes(s) ? 3 * size_z(s) + size_x(s) : 0;
}

/* By their products, which are the same kernel's. */
static int32_t groups_at_once(const qp_shape *s) {
    const double n = s->n_dense, x = s->n_x, u = s->n_u;
    const double factors = 2 * x * x * n + n * n * (u + x);
    const double group = L * (4 * x * n + 2 * u * n + 2 * n * n);
    return factors < 2 * group ? 1 : factors < 3 * group ? 2 : KALMAN_GROUPS;
}

void update_place(qp_update *update, const qp_shape *s, double *memory) {
    const size_t z = size_z(s);
    *update = (qp_update){.at_once = kalman_takes(s) ? groups_at_once(s) : 0};
    update->side = memory;
    update->w = update->side + z;
    update->slope = update->w + z;
    update->lambda = update->slope + z;
}

void active_remember(qp *q) {
    qp_update *u = &q->update;
    if (u->at_once > 0 && q->first_is_fixed) {
        memcpy(u->w, q->w, sizeof(double) * size_z(q->shape));
        memcpy(u->slope, q->slope, sizeof(double) * size_z(q->shape));
        memcpy(u->lambda, q->lambda, sizeof(double) * size_x(q->shape));
        memset(u->n, 0, sizeof u->n);
        u->known = 1;
    }
}

/* ---- answers ---- */

/* Groups of eight: w [size_z][8] and behind them lambda [size_x][8]. */
static double *group_w(const qp *q, int32_t group) {
    return q->kalman.units.answers + (size_t)group * L * (size_z(q->shape) + size_x(q->shape));
}

static double *group_lambda(const qp *q, int32_t group) {
    return group_w(q, group) + L * size_z(q->shape);
}

/* Where the answer to a change at that place stands: 8 times its group and its place there; -1. */
static int32_t answer_to(const qp_update *u, ptrdiff_t at) {
    for (int32_t group = 0; group < KALMAN_GROUPS; group++) {
        for (int32_t i = 0; i < u->n[group]; i++) {
            if (u->at[group][i] == at) {
                return group * L + i;
            }
        }
    }
    return -1;
}

/* Answers to changes at n <= 8 more places. */
static void find_answers(qp *q, int32_t n, const ptrdiff_t *at, int32_t group) {
    qp_update *u = &q->update;
    kalman_unit list[L];
    for (int32_t i = 0; i < n; i++) {
        const int32_t leaves = u->side[at[i]] != 0;
        const int32_t is_control = at[i] % q->shape->ld_z < q->shape->n_u;
        /* A control at a bound is no variable; a state there is drawn to where the bound is. */
        list[i] = (kalman_unit){.at = at[i],
                                .g = leaves && is_control ? 0
                                     : leaves             ? -ACTIVE_HOLD
                                                          : -1,
                                .moves = leaves && is_control};
        u->at[group][i] = at[i];
    }
    u->n[group] = n;
    kalman_answer(&q->kalman, q->stages, n, list, group_w(q, group), group_lambda(q, group));
    q->solutions += 1;
}

/* Slope of the Lagrangian at one place of an answer. */
static double slope_of(const qp *q, int32_t answer, ptrdiff_t at) {
    const qp_shape *s = q->shape;
    const int32_t k = (int32_t)(at / s->ld_z), j = (int32_t)(at % s->ld_z), x = j - s->n_u;
    const qp_stage *stage = &q->stages[k];
    const double *w = group_w(q, answer / L) + (ptrdiff_t)k * s->ld_z * L + answer % L;
    const double *lambda = group_lambda(q, answer / L) + (ptrdiff_t)k * s->ld_x * L + answer % L;
    const double *H = stage->H + (ptrdiff_t)j * s->ld_z;
    double slope = k > 0 && x >= 0 ? lambda[(x - s->ld_x) * L] : 0;
    if (x < 0 || x >= s->n_dense) { /* costs are separable */
        slope += H[j] * w[j * L];
    } else {
        for (int32_t l = 0; l < s->n_dense; l++) {
            slope += H[s->n_u + l] * w[(s->n_u + l) * L];
        }
    }
    for (int32_t l = 0; l < s->n_dense && k < s->N; l++) {
        slope -= stage->F[(ptrdiff_t)l * s->ld_z + j] * lambda[l * L];
    }
    if (k < s->N && s->n_dense < s->n_x) {
        const int32_t first = s->control_of[s->n_dense]; /* they are in order */
        if (x >= s->n_dense) {
            slope -= stage->by_state[x] * lambda[x * L];
        } else if (j >= first && j < first + s->n_x - s->n_dense) {
            const int32_t of = s->n_dense + j - first;
            slope -= stage->by_control[of] * lambda[of * L];
        }
    }
    return slope;
}

/* ---- what changed ---- */

typedef struct changes {
    int32_t n, n_new, answer[QP_MOST_CHANGES];
    ptrdiff_t at[QP_MOST_CHANGES], new[QP_MOST_CHANGES];
} changes;

/* A control comes to its bound that a bound of its state leaves next to no way: both are one, and
 * it takes the weight that holds states to share a pull among them. */
static int32_t depends(const qp *q, ptrdiff_t at) {
    const qp_shape *s = q->shape;
    const ptrdiff_t k = at / s->ld_z, j = at % s->ld_z;
    const double bend = q->stages[k].H[j * (s->ld_z + 1)];
    return j < s->n_u && q->side[at] != 0 && !(q->kalman.inverse[at] * bend > LEAST_FREEDOM);
}

/* Since the factors were made; 0: too many, or from one bound to the other. */
static int32_t find_changes(const qp *q, changes *c) {
    const qp_shape *s = q->shape;
    const qp_update *u = &q->update;
    c->n = c->n_new = 0;
    for (int32_t k = 0; k <= s->N; k++) {
        for (int32_t i = k < s->N ? 0 : s->n_u; i < s->n_z; i++) {
            const ptrdiff_t at = (ptrdiff_t)k * s->ld_z + i;
            if (q->side[at] == u->side[at]) {
                continue;
            }
            if (c->n == QP_MOST_CHANGES || q->side[at] * u->side[at] != 0) {
                return 0;
            }
            if (depends(q, at)) {
                return 0;
            }
            c->at[c->n++] = at;
            if (answer_to(u, at) < 0) {
                c->new[c->n_new++] = at;
            }
        }
    }
    return 1;
}

/* ---- what may change next ---- */

/* How far a control is from a change, in its own unit: to its nearer bound, or what its cost alone
 * would move it by if it were let go. */
static inline double to_change(const qp *q, ptrdiff_t at, const double *bend) {
    return q->side[at] == 0 ? smaller(q->w[at] - q->lower[at], q->upper[at] - q->w[at])
                            : fabs(q->slope[at]) / *bend;
}

/* Lanes of a group that are left over take the controls that are nearest to a change: the systems
 * after this one then find their answers there. Where all states are dense an answer costs the
 * more the earlier it begins. `list` [n < 8] grows; its length. */
static int32_t add_likely(const qp *q, int32_t n, ptrdiff_t *list) {
    const qp_shape *s = q->shape;
    const double *side = q->update.side;
    const int32_t first = (int32_t)(list[0] / s->ld_z) - EARLIER; /* they are in order */
    double distance[L];
    int32_t to = n;
    for (int32_t k = q->kalman.m > 0 || first < 0 ? 0 : first; k < s->N; k++) {
        const double *H = q->stages[k].H;
        for (int32_t i = 0; i < s->n_u; i++) {
            const ptrdiff_t at = (ptrdiff_t)k * s->ld_z + i;
            const double far = to_change(q, at, H + (ptrdiff_t)i * (s->ld_z + 1));
            if ((to == L && !(far < distance[L - 1])) || q->fixed[at] || q->side[at] != side[at] ||
                !(far >= 0) || answer_to(&q->update, at) >= 0) {
                continue;
            }
            int32_t place = to < L ? to++ : L - 1;
            for (; place > n && far < distance[place - 1]; place--) {
                distance[place] = distance[place - 1];
                list[place] = list[place - 1];
            }
            distance[place] = far;
            list[place] = at;
        }
    }
    return to;
}

/* 0: there is no more room, or factors cost less. */
static int32_t find_new_answers(qp *q, const changes *c) {
    int32_t group = 0;
    while (group < KALMAN_GROUPS && q->update.n[group] > 0) {
        group++;
    }
    const int32_t left = KALMAN_GROUPS - group, at_once = q->update.at_once;
    if (c->n_new > L * (left < at_once ? left : at_once)) {
        return 0;
    }
    const int32_t more = c->n >= MANY || q->iterations >= SOME;
    for (int32_t i = 0; i < c->n_new; i += L) {
        ptrdiff_t list[L];
        const int32_t n = c->n_new - i < L ? c->n_new - i : L;
        memcpy(list, c->new + i, sizeof *list * (size_t)n);
        find_answers(q, more && n < L ? add_likely(q, n, list) : n, list, group + i / L);
    }
    return 1;
}

/* a [n x n] x = b by elimination with pivots, in place; 0: singular to rounding. */
static int32_t eliminate(int32_t n, double a[][QP_MOST_CHANGES], double *b) {
    for (int32_t i = 0; i < n; i++) {
        double largest = 0;
        for (int32_t j = 0; j < n; j++) {
            largest = larger(largest, fabs(a[i][j]));
        }
        if (!(largest > 0)) {
            return 0;
        }
        for (int32_t j = 0; j < n; j++) {
            a[i][j] /= largest;
        }
        b[i] /= largest;
    }
    for (int32_t i = 0; i < n; i++) {
        int32_t best = i;
        for (int32_t j = i + 1; j < n; j++) {
            best = fabs(a[j][i]) > fabs(a[best][i]) ? j : best;
        }
        if (!(fabs(a[best][i]) > LEAST_PIVOT)) {
            return 0;
        }
        for (int32_t j = 0; j < n && best != i; j++) {
            const double kept = a[i][j];
            a[i][j] = a[best][j];
            a[best][j] = kept;
        }
        const double kept = b[i];
        b[i] = b[best];
        b[best] = best != i ? kept : b[best];
        for (int32_t j = i + 1; j < n; j++) {
            const double by = a[j][i] / a[i][i];
            for (int32_t l = i; l < n; l++) {
                a[j][l] -= by * a[i][l];
            }
            b[j] -= by * b[i];
        }
    }
    for (int32_t i = n - 1; i >= 0; i--) {
        for (int32_t j = i + 1; j < n; j++) {
            b[i] -= a[i][j] * b[j];
        }
        b[i] /= a[i][i];
    }
    return 1;
}

/* to [n] += the answers of a group [n][8], of each so many units. */
CLONES static void add_answers(size_t n, const double *answers, const double *units, double *to) {
    for (size_t i = 0; i < n; i++) {
        double sum[4] = {0};
        for (int32_t l = 0; l < 4; l++) {
            sum[l] = units[l] * answers[i * L + (size_t)l] +
                     units[l + 4] * answers[i * L + 4 + (size_t)l];
        }
        to[i] += (sum[0] + sum[1]) + (sum[2] + sum[3]);
    }
}

/* The new solution: of each answer so many units. */
static void combine(qp *q, const changes *c, const double *units) {
    const size_t z = size_z(q->shape), x = size_x(q->shape);
    const qp_update *u = &q->update;
    double of_group[KALMAN_GROUPS][L] = {{0}};
    for (int32_t i = 0; i < c->n; i++) {
        of_group[c->answer[i] / L][c->answer[i] % L] = units[i];
    }
    memcpy(q->w, u->w, sizeof(double) * z);
    memcpy(q->lambda, u->lambda, sizeof(double) * x);
    for (int32_t group = 0; group < KALMAN_GROUPS && u->n[group] > 0; group++) {
        add_answers(z, group_w(q, group), of_group[group], q->w);
        add_answers(x, group_lambda(q, group), of_group[group], q->lambda);
    }
    for (int32_t i = 0; i < c->n; i++) {
        const ptrdiff_t at = c->at[i];
        const int32_t constant = q->side[at] != 0 && at % q->shape->ld_z < q->shape->n_u;
        q->w[at] = constant ? active_bound(q, at) : q->w[at];
    }
}

int32_t active_update(qp *q) {
    qp_update *u = &q->update;
    double a[QP_MOST_CHANGES][QP_MOST_CHANGES], units[QP_MOST_CHANGES];
    changes c;
    if (!u->known || !find_changes(q, &c) || !find_new_answers(q, &c)) {
        return 0;
    }
    for (int32_t i = 0; i < c.n; i++) {
        c.answer[i] = answer_to(u, c.at[i]);
    }
    for (int32_t i = 0; i < c.n; i++) {
        const ptrdiff_t at = c.at[i];
        const int32_t held = q->side[at] != 0;
        units[i] = held ? active_bound(q, at) - u->w[at] : -u->slope[at];
        for (int32_t j = 0; j < c.n; j++) {
            const int32_t answer = c.answer[j];
            a[i][j] = held ? group_w(q, answer / L)[at * L + answer % L] : slope_of(q, answer, at);
        }
    }
    if (!eliminate(c.n, a, units)) {
        return 0;
    }
    combine(q, &c, units);
    q->updates++;
    return 1;
}
