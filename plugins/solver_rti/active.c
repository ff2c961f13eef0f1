/* SPDX-License-Identifier: Apache-2.0 */
/* active.c: a program by a primal-dual active set (a semismooth Newton method: Hintermueller, Ito
 * and Kunisch 2002, doi:10.1137/S1052623401383558).
 *
 * With a guess of which bounds hold, the program is one Newton system. Its solution says which of
 * them pull the wrong way and which others are crossed; that is the next guess, and where nothing
 * changes it is the solution. From one window to the next few bounds change, so two or three
 * systems do where an interior point takes five or more. It need not end: then the interior point
 * solves the program from the same start.
 *
 * Controls at a bound are constants. States at one are held by a weight ACTIVE_HOLD on the distance
 * beside their multiplier, so bounds that contradict each other do not break the recursion. Bounds
 * of states come in only where they are crossed: of an activation that fades to 0 and its
 * excitation at 0 one says what the other does, and guessing both makes the sets cycle. */
#include "active.h"

#include <math.h>
#include <string.h>

#define MOST_SETS 8
#define MANY_SETS 20 /* of whole recordings with parameters */
#define MOST_TAIL_SETS 4
#define MOST_CORRECTIONS 3
#define NEAR_BOUNDS \
    1e-4 /* of a set that is taken before it settles: multipliers are HOLD times it */

/* What lies in the way of a look at all variables. */
typedef struct look {
    int32_t changes;
    double stationarity, feasibility; /* largest */
} look;

static int32_t is_state(const qp_shape *s, int32_t i) {
    return i >= s->n_u;
}

static int32_t first_of(const qp_shape *s, int32_t k) {
    return k < s->N ? 0 : s->n_u;
}

/* Places of the parameters, which are constants at a bound, as controls are. */
static ptrdiff_t first_p(const qp_shape *s) {
    return (ptrdiff_t)(s->N + 1) * s->ld_z;
}

/* The multipliers z_lower - z_upper stand in q->rhs while sets change. */
static void guess_one(qp *q, ptrdiff_t at) {
    const double below = q->z_lower[at], above = q->z_upper[at];
    q->side[at] = 0;
    if (q->fixed[at]) {
        return;
    }
    if (active_is_equality(q, at) || (below > above && below > q->w[at] - q->lower[at])) {
        q->side[at] = -1;
    } else if (above > below && above > q->upper[at] - q->w[at]) {
        q->side[at] = 1;
    }
    q->rhs[at] = q->side[at] == 0 ? 0 : below - above;
}

static void guess(qp *q) {
    const qp_shape *s = q->shape;
    for (int32_t k = 0; k <= s->N; k++) {
        for (int32_t i = first_of(s, k); i < s->n_z; i++) {
            guess_one(q, (ptrdiff_t)k * s->ld_z + i);
        }
    }
    for (ptrdiff_t at = first_p(s); at < first_p(s) + s->n_p; at++) {
        guess_one(q, at);
    }
}

/* Where the program starts from: what is constant, all else 0; -> q->w. */
static void set_constant(qp *q, ptrdiff_t at, int32_t state) {
    q->held[at] = q->fixed[at] || (!state && q->side[at] != 0);
    q->w[at] = q->fixed[at] ? q->lower[at] : q->held[at] ? active_bound(q, at) : 0;
}

static void set_constants(qp *q) {
    const qp_shape *s = q->shape;
    for (int32_t k = 0; k <= s->N; k++) {
        for (int32_t i = 0; i < s->n_z; i++) {
            set_constant(q, (ptrdiff_t)k * s->ld_z + i, is_state(s, i));
        }
    }
    for (ptrdiff_t at = first_p(s); at < first_p(s) + s->n_p; at++) {
        set_constant(q, at, 0);
    }
}

/* -> slope and gap at w; `lambda` NULL: 0. */
static void find_residuals(qp *q, const double *lambda) {
    if (q->recursion == QP_KALMAN) {
        kalman_residuals(&q->kalman, q->stages, q->w, lambda, q->slope, q->gap);
        return;
    }
    qp_slope(q->shape, q->stages, q->w, lambda, q->slope);
    qp_gaps(q->shape, q->stages, q->w, q->gap);
}

/* The system of the present set, factorised and solved from w with multipliers `lambda` of 0. */
static int32_t solve_set(qp *q, double regularisation) {
    const qp_shape *s = q->shape;
    set_constants(q);
    memset(q->lambda, 0, sizeof(double) * size_x(s));
    find_residuals(q, s->n_p > 0 ? q->lambda : NULL);
    for (int32_t k = 0; k <= s->N; k++) {
        for (int32_t i = 0; i < s->n_z; i++) {
            const ptrdiff_t at = (ptrdiff_t)k * s->ld_z + i;
            const int32_t stiff = is_state(s, i) && q->side[at] != 0;
            q->diagonal[at] = regularisation + (stiff ? ACTIVE_HOLD : 0);
            q->slope[at] -= stiff ? ACTIVE_HOLD * (active_bound(q, at) - q->w[at]) + q->rhs[at] : 0;
        }
    }
    for (ptrdiff_t at = first_p(s); at < first_p(s) + s->n_p; at++) {
        q->diagonal[at] = regularisation;
    }
    if (!qp_factor(q, q->held)) {
        return 0;
    }
    qp_newton(q, q->slope, q->gap, q->dw, q->dlambda);
    for (size_t i = 0; i < size_z(s); i++) {
        q->w[i] += q->held[i] ? 0 : q->dw[i];
    }
    memcpy(q->lambda, q->dlambda, sizeof(double) * size_x(s));
    if (q->update.at_once > 0) {
        memcpy(q->update.side, q->side, sizeof(double) * size_z(s));
    }
    return 1;
}

/* The same of one variable, whose slope is known; 1: it came to another side. */
static int32_t see_one(qp *q, ptrdiff_t at, double crossed, double pulled, look *l) {
    const double y = q->slope[at];
    if (q->side[at] == 0) {
        l->stationarity = larger(l->stationarity, fabs(y));
    } else {
        l->feasibility = larger(l->feasibility, fabs(q->w[at] - active_bound(q, at)));
    }
    q->rhs[at] = q->side[at] == 0 ? 0 : y;
    if (!active_turn(q, at, q->w[at], y, crossed, pulled)) {
        return 0;
    }
    l->changes++;
    q->rhs[at] = 0;
    return 1;
}

/* A simple state that the control before it took over its bound, or one that decays from such a
 * state: once the control is back at its own bound it may well be inside. */
static int32_t only_follows(const qp *q, ptrdiff_t at, double crossed, double *because) {
    const double over = q->side[at] != 0                    ? 0
                        : q->w[at] < q->lower[at] - crossed ? -1
                        : q->w[at] > q->upper[at] + crossed ? 1
                                                            : 0;
    *because = over == *because ? over : 0;
    return *because != 0;
}

/* Residuals at the present point and set, and the set that follows from them. */
static look see(qp *q, const qp_limits *limits) {
    const qp_shape *s = q->shape;
    const double crossed = 0.5 * limits->feasibility, pulled = 0.5 * limits->stationarity;
    const int32_t simple = s->n_u + s->n_dense, m = s->in_order ? s->n_x - s->n_dense : 0;
    const int32_t first_control = m > 0 ? s->control_of[s->n_dense] : 0;
    double *because = q->because; /* the side to which a state was taken by its control */
    look l = {0};
    memset(q->turned, 0, (size_t)s->n_x);
    memset(because, 0, sizeof(double) * (size_t)s->ld_x);
    find_residuals(q, q->lambda);
    for (size_t i = 0; i < size_x(s); i++) {
        l.feasibility = larger(l.feasibility, fabs(q->gap[i]));
    }
    for (int32_t k = 0; k <= s->N; k++) {
        for (int32_t i = s->n_u; i < s->n_z; i++) {
            const ptrdiff_t at = (ptrdiff_t)k * s->ld_z + i;
            const int32_t j = i - simple;
            if (q->fixed[at] || (j >= 0 && j < m && only_follows(q, at, crossed, &because[j])) ||
                !see_one(q, at, crossed, pulled, &l)) {
                continue;
            }
            if (j >= 0) {
                q->turned[j] = 1;
            }
        }
        for (int32_t i = first_of(s, k); i < s->n_u; i++) {
            const ptrdiff_t at = (ptrdiff_t)k * s->ld_z + i;
            const int32_t j = i - first_control;
            if (q->fixed[at] || !see_one(q, at, crossed, pulled, &l)) {
                continue;
            }
            if (j >= 0 && j < m) {
                q->turned[j] = 1;
                because[j] = q->side[at] != 0 ? q->side[at] : because[j];
            }
        }
    }
    for (ptrdiff_t at = first_p(s); at < first_p(s) + s->n_p; at++) {
        (void)(q->fixed[at] || see_one(q, at, crossed, pulled, &l));
    }
    return l;
}

static void follow_chains(qp *q, const qp_limits *limits) {
    const int32_t m = q->shape->in_order ? q->shape->n_x - q->shape->n_dense : 0;
    for (int32_t j = 0; j < m; j++) {
        if (q->turned[j]) {
            active_follow(q, j, 0.5 * limits->feasibility, 0.5 * limits->stationarity);
        }
    }
}

/* What is left at the set's solution, by the factors that are there. */
static void correct(qp *q) {
    const qp_shape *s = q->shape;
    for (int32_t k = 0; k <= s->N; k++) {
        for (int32_t i = 0; i < s->n_z; i++) {
            const ptrdiff_t at = (ptrdiff_t)k * s->ld_z + i;
            const int32_t stiff = is_state(s, i) && q->side[at] != 0;
            q->slope[at] = stiff ? -ACTIVE_HOLD * (active_bound(q, at) - q->w[at]) : q->slope[at];
        }
    }
    qp_newton(q, q->slope, q->gap, q->dw, q->dlambda);
    for (size_t i = 0; i < size_z(s); i++) {
        q->w[i] += q->held[i] ? 0 : q->dw[i];
    }
    for (size_t i = 0; i < size_x(s); i++) {
        q->lambda[i] += q->dlambda[i];
    }
}

static int32_t is_good(const look *l, const qp_limits *limits) {
    return l->stationarity <= limits->stationarity && l->feasibility <= limits->feasibility;
}

static void finish(qp *q, const look *l) {
    for (size_t i = 0; i < size_z(q->shape); i++) {
        q->z_lower[i] = q->side[i] != 0 ? larger(0, q->rhs[i]) : 0;
        q->z_upper[i] = q->side[i] != 0 ? larger(0, -q->rhs[i]) : 0;
    }
    q->stationarity = l->stationarity;
    q->feasibility = l->feasibility;
    q->complementarity = q->open = 0;
}

/* A motion near the present set's solution, for a program cut short: controls within their bounds,
 * and the states that follow from them. */
static void settle(qp *q) {
    const qp_shape *s = q->shape;
    for (int32_t k = 0; k < s->N; k++) {
        double *now = row_z(s, q->w, k), *next = row_z(s, q->w, k + 1) + s->n_u;
        const ptrdiff_t at = (ptrdiff_t)k * s->ld_z;
        for (int32_t i = 0; i < s->n_u; i++) {
            now[i] = smaller(q->upper[at + i], larger(q->lower[at + i], now[i]));
        }
        memcpy(next, q->stages[k].b, sizeof(double) * (size_t)s->n_x);
        qp_forward(s, &q->stages[k], now, next);
    }
}

/* Sets of the tail until one suits it; 0: none did. Its first states are constants meanwhile. */
static int32_t solve_tail(qp *tail, const qp_limits *limits) {
    const qp_shape *s = tail->shape;
    const size_t x = sizeof(double) * (size_t)s->n_x;
    double *lower = tail->lower + s->n_u, *upper = tail->upper + s->n_u, *kept = tail->rest_x;
    memcpy(kept, lower, x);
    memcpy(kept + s->ld_x, upper, x);
    memset(lower, 0, x);
    memset(upper, 0, x);
    memset(tail->fixed + s->n_u, 1, (size_t)s->n_x);
    look l = {.changes = 1};
    for (int32_t i = 0; i < MOST_TAIL_SETS && l.changes > 0; i++) {
        if (!solve_set(tail, limits->regularisation)) {
            break;
        }
        l = see(tail, limits);
        follow_chains(tail, limits);
    }
    memcpy(lower, kept, x);
    memcpy(upper, kept + s->ld_x, x);
    memset(tail->fixed + s->n_u, 0, (size_t)s->n_x);
    return l.changes == 0;
}

/* Multipliers and sets as they come from the tail, if it comes to any. */
static void guess_tail(qp *q, const qp_limits *limits) {
    const int32_t from = active_tail_begins(q);
    if (from == 0 || q->ahead > KALMAN_LANES) {
        return;
    }
    qp_shape shape;
    qp tail = active_tail(q, &shape, from);
    const size_t z = sizeof(double) * size_z(&shape);
    double *side = q->update.side, *rhs = q->update.w; /* of no set yet */
    memcpy(side, tail.side, z);
    memcpy(rhs, tail.rhs, z);
    /* Its first stages make up for a first state that may be another. */
    const int32_t known = solve_tail(&tail, limits);
    const size_t back = known ? sizeof(double) * (size_t)(shape.N / 3 * shape.ld_z) : z;
    q->tails += known;
    memcpy(tail.side, side, back);
    memcpy(tail.rhs, rhs, back);
    q->solutions += tail.solutions * shape.N / q->shape->N;
    q->sweeps += tail.sweeps;
}

/* Bounds ahead of the tail that the first system changed: where there are many, because stages are
 * close to each other, the tail alone says little of the next program. */
static void count_ahead(qp *q) {
    const ptrdiff_t end = (ptrdiff_t)active_tail_begins(q) * q->shape->ld_z;
    q->ahead = 0;
    for (ptrdiff_t at = 0; at < end; at++) {
        q->ahead += q->side[at] != q->update.side[at];
    }
}

int32_t active_solve(qp *q, const qp_limits *limits) {
    const qp_shape *s = q->shape;
    const size_t z = sizeof(double) * size_z(s), x = sizeof(double) * size_x(s);
    memcpy(q->fix_w, q->w, z);
    memcpy(q->fix_lambda, q->lambda, x);
    memset(q->rhs, 0, z);
    guess(q);
    guess_tail(q, limits);
    int32_t result = QP_LIMIT;
    look l = {0};
    q->update.known = 0;
    for (q->iterations = 0;
         q->iterations < (s->n_p > 0 ? MANY_SETS : MOST_SETS) && result == QP_LIMIT;) {
        if (limits->is_late != NULL && limits->is_late(limits->data)) {
            result = QP_LATE;
            break;
        }
        int32_t by_update = active_update(q);
        if (!by_update && !solve_set(q, limits->regularisation)) {
            break;
        }
        q->iterations++;
        l = see(q, limits);
        if (by_update && l.changes == 0 && !is_good(&l, limits)) {
            by_update = 0;
            if (!solve_set(q, limits->regularisation)) {
                break;
            }
            l = see(q, limits);
        }
        if (!by_update) {
            active_remember(q);
        }
        follow_chains(q, limits);
        if (q->iterations == 1) {
            count_ahead(q);
        }
        if (!isfinite(l.stationarity + l.feasibility)) {
            break;
        }
        for (int32_t i = 0; i < MOST_CORRECTIONS && l.changes == 0 && !is_good(&l, limits); i++) {
            correct(q);
            l = see(q, limits);
        }
        if (l.changes == 0) {
            result = is_good(&l, limits) ? QP_SOLVED : -1;
        } else if (l.changes <= limits->unsettled && l.feasibility <= NEAR_BOUNDS) {
            result = QP_SOLVED;
        }
    }
    if (result == QP_LATE && q->iterations > 0) {
        settle(q);
    }
    if (result == QP_SOLVED || (result == QP_LATE && q->iterations > 0)) {
        finish(q, &l);
        return result;
    }
    memcpy(q->w, q->fix_w, z);
    memcpy(q->lambda, q->fix_lambda, x);
    return result == QP_LATE ? QP_LATE : QP_LIMIT;
}
