/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/gain.h"

#include "base/cholesky.h"

#include <math.h>
#include <string.h>

#define LONGEST 16 /* intervals: what comes later says nothing of the first nodes */

static void set_zero(double *array, ptrdiff_t n) {
    memset(array, 0, sizeof(double) * (size_t)n);
}

mhe_status mhi_gain_create(mhi_gain *g, mhi_arena *arena, mhe_error *err) {
    const int32_t n_x = g->n_x, n_u = g->n_u, n_q = g->n_q, n_m = g->n_m;
    g->whole = g->horizon <= LONGEST || (g->node > 0 && g->horizon <= MHI_GAIN_LONGEST);
    g->horizon = g->whole ? g->horizon : LONGEST;
    g->fixed = 2 * n_m;
    g->fresh = g->fixed + n_q;
    g->n_window = g->fresh + g->horizon * n_q;
    g->n_columns = g->n_window + g->horizon * n_q;
    const int32_t n_w = g->n_window;
    /* States that costs carry on from node to node may be more than columns. */
    const int32_t most = n_x > n_u ? n_x : n_u, widest = n_w > most ? n_w : most;
    const mhi_room rooms[] = {{&g->here.A, n_x * n_x},
                              {&g->here.B, n_x * n_u},
                              {&g->here.hess_xx, n_x * n_x},
                              {&g->here.hess_ux, n_u * n_x},
                              {&g->here.hess_uu, n_u * n_u},
                              {&g->here.force, n_x * n_m},
                              {&g->here.pose_fixed, n_q * n_q},
                              {&g->here.pose_fresh, n_q * n_q},
                              {&g->here.control, n_m},
                              {&g->here.free, n_m},
                              {&g->known.A, n_x * n_x},
                              {&g->known.B, n_x * n_u},
                              {&g->known.force, n_x * n_m},
                              {&g->known.K, n_u * n_x},
                              {&g->known.ff, n_u * n_w},
                              {&g->known.free, n_m},
                              {&g->known.weight, n_m},
                              {&g->known.to_x, n_x * n_x},
                              {&g->known.to_ff, n_x * n_w},
                              {&g->known.u_x, n_u * n_x},
                              {&g->known.u_ff, n_u * n_w},
                              {&g->V, n_x * n_x},
                              {&g->T, n_x * n_w},
                              {&g->K, (ptrdiff_t)g->horizon * n_u * n_x},
                              {&g->ff, (ptrdiff_t)g->horizon * n_u * n_w},
                              {&g->to_x, n_x * n_x},
                              {&g->to_ff, n_x * n_w},
                              {&g->u_x, n_u * n_x},
                              {&g->u_ff, n_u * n_w},
                              {&g->VA, n_x * n_x},
                              {&g->VB, n_x * n_u},
                              {&g->BVA, n_u * n_x},
                              {&g->M, n_u * n_u},
                              {&g->BT, n_u * n_w},
                              {&g->closed, n_x * n_x},
                              {&g->more, n_x * widest},
                              {&g->inverse, n_u * n_u}};
    return MHI_TAKE_ROOMS(arena, rooms, err);
}

/* Column of the posture's first direction at node k alone. */
static int32_t fresh_at(const mhi_gain *g, int32_t k) {
    return g->fresh + (g->horizon - k) * g->n_q;
}

/* Gradient of a node's costs by its state, of all columns, added to T. */
static void add_postures(const mhi_gain *g, int32_t k, double factor) {
    for (int32_t i = 0; i < g->n_q; i++) {
        double *row = g->T + i * g->n_window;
        for (int32_t j = 0; j < g->n_q; j++) {
            row[g->fixed + j] += factor * g->here.pose_fixed[i * g->n_q + j];
            row[fresh_at(g, k) + j] += factor * g->here.pose_fresh[i * g->n_q + j];
        }
    }
}

void mhi_gain_begin(mhi_gain *g) {
    /* Costs of intervals are weighed by their length, those of the last node are not. */
    const double factor = g->whole ? 1 / g->interval : 1;
    for (int32_t i = 0; i < g->n_x * g->n_x; i++) {
        g->V[i] = factor * g->here.hess_xx[i];
    }
    set_zero(g->T, (ptrdiff_t)g->n_x * g->n_window);
    add_postures(g, g->horizon, factor);
    g->stage = g->horizon - 1;
    g->forward = 0;
}

/* V B, V A, M = R + B^T V B, S + B^T V A. */
static void meet(mhi_gain *g) {
    const int32_t n_x = g->n_x, n_u = g->n_u;
    const mhi_matrix B = {g->here.B, n_x, n_u, n_u};
    const mhi_matrix A = {g->here.A, n_x, n_x, n_x};
    set_zero(g->VA, n_x * n_x); /* (A^T V)^T: V is symmetric, A mostly zeros */
    mhi_product_add_transposed(&A, g->V, n_x, n_x, g->VA, n_x);
    for (int32_t i = 0; i < n_x; i++) {
        for (int32_t j = 0; j < i; j++) {
            const double swap = g->VA[i * n_x + j];
            g->VA[i * n_x + j] = g->VA[j * n_x + i];
            g->VA[j * n_x + i] = swap;
        }
    }
    double *BV = g->more; /* [n_u x n_x] */
    set_zero(BV, n_u * n_x);
    mhi_product_add_transposed(&B, g->V, n_x, n_x, BV, n_x);
    for (int32_t i = 0; i < n_x; i++) {
        for (int32_t j = 0; j < n_u; j++) {
            g->VB[i * n_u + j] = BV[j * n_x + i];
        }
    }
    memcpy(g->M, g->here.hess_uu, sizeof(double) * (size_t)(n_u * n_u));
    mhi_product_add_transposed(&B, g->VB, n_u, n_u, g->M, n_u);
    memcpy(g->BVA, g->here.hess_ux, sizeof(double) * (size_t)(n_u * n_x));
    mhi_product_add_transposed(&B, g->VA, n_x, n_x, g->BVA, n_x);
}

static void negate(double *array, ptrdiff_t n) {
    for (ptrdiff_t i = 0; i < n; i++) {
        array[i] = -array[i];
    }
}

/* What a control answers less is as if it were held by more weight, beside that which holds it
 * while all others answer. That was found by the sweep before. */
static void hold_at_bounds(mhi_gain *g) {
    for (int32_t m = 0; m < g->n_m && g->has_known; m++) {
        g->M[m * g->n_u + m] += g->known.weight[m] * (1 / g->here.free[m] - 1);
    }
}

/* 1 / (M^-1)_mm from the factor of M, without what was added to it. */
static void weigh_controls(mhi_gain *g) {
    const int32_t n = g->n_u;
    set_zero(g->inverse, (ptrdiff_t)n * n);
    for (int32_t i = 0; i < n; i++) {
        g->inverse[i * n + i] = 1;
    }
    mhi_cholesky_solve(g->M, n, g->inverse, n);
    for (int32_t m = 0; m < g->n_m; m++) {
        const double share = g->has_known ? g->here.free[m] : 1;
        g->known.weight[m] = share / g->inverse[m * n + m];
    }
}

/* K = -M^-1 (S + B^T V A), ff = -M^-1 (g_u + B^T T). 0: M is singular. */
static int32_t solve_stage(mhi_gain *g, double *K, double *ff) {
    const int32_t n_x = g->n_x, n_u = g->n_u, n_w = g->n_window;
    const mhi_matrix B = {g->here.B, n_x, n_u, n_u};
    double largest = 0;
    hold_at_bounds(g);
    for (int32_t i = 0; i < n_u; i++) {
        largest = fmax(largest, g->M[i * n_u + i]);
    }
    for (int32_t i = 0; i < n_u; i++) {
        g->M[i * n_u + i] += 1e-12 * largest;
    }
    if (mhi_cholesky_factor(g->M, n_u) != 0) {
        return 0;
    }
    memcpy(K, g->BVA, sizeof(double) * (size_t)(n_u * n_x));
    mhi_cholesky_solve(g->M, n_u, K, n_x);
    negate(K, n_u * n_x);
    set_zero(g->BT, n_u * n_w);
    mhi_product_add_transposed(&B, g->T, n_w, n_w, g->BT, n_w);
    for (int32_t m = 0; m < g->n_m; m++) {
        g->BT[m * n_w + m] += g->here.control[m];
    }
    memcpy(ff, g->BT, sizeof(double) * (size_t)(n_u * n_w));
    mhi_cholesky_solve(g->M, n_u, ff, n_w);
    negate(ff, n_u * n_w);
    return 1;
}

/* The cost to go from node k: V = Q + A^T V A + K^T (S + B^T V A), T = g_x + A^T T + K^T (g_u + B^T
 * T). */
static void go_back(mhi_gain *g, int32_t k, const double *K) {
    const int32_t n_x = g->n_x, n_u = g->n_u, n_w = g->n_window;
    const mhi_matrix A = {g->here.A, n_x, n_x, n_x};
    const mhi_matrix gain = {(double *)(uintptr_t)K, n_u, n_x, n_x};
    memcpy(g->V, g->here.hess_xx, sizeof(double) * (size_t)(n_x * n_x));
    mhi_product_add_transposed(&A, g->VA, n_x, n_x, g->V, n_x);
    mhi_product_add_transposed(&gain, g->BVA, n_x, n_x, g->V, n_x);
    for (int32_t i = 0; i < n_x; i++) {
        for (int32_t j = 0; j < i; j++) {
            const double mean = 0.5 * (g->V[i * n_x + j] + g->V[j * n_x + i]);
            g->V[i * n_x + j] = g->V[j * n_x + i] = mean;
        }
    }
    set_zero(g->more, n_x * n_w);
    mhi_product_add_transposed(&A, g->T, n_w, n_w, g->more, n_w);
    mhi_product_add_transposed(&gain, g->BT, n_w, n_w, g->more, n_w);
    memcpy(g->T, g->more, sizeof(double) * (size_t)(n_x * n_w));
    add_postures(g, k, 1);
}

static int32_t go_backwards(mhi_gain *g) {
    const int32_t k = g->stage, n_x = g->n_x, n_w = g->n_window;
    double *K = g->K + (ptrdiff_t)k * g->n_u * n_x, *ff = g->ff + (ptrdiff_t)k * g->n_u * n_w;
    meet(g);
    for (int32_t i = 0; i < n_x; i++) { /* T + V force */
        for (int32_t j = 0; j < n_x; j++) {
            const double v = g->V[i * n_x + j];
            for (int32_t m = 0; m < g->n_m && v != 0; m++) {
                g->T[i * n_w + g->n_m + m] += v * g->here.force[j * g->n_m + m];
            }
        }
    }
    if (!solve_stage(g, K, ff)) {
        return -1;
    }
    if (k > 0) {
        go_back(g, k, K);
    } else {
        weigh_controls(g);
    }
    g->stage--;
    return 0;
}

static void add_force(const mhi_gain *g, double *to) {
    for (int32_t i = 0; i < g->n_x; i++) {
        for (int32_t m = 0; m < g->n_m; m++) {
            to[i * g->n_window + g->n_m + m] += g->here.force[i * g->n_m + m];
        }
    }
}

/* From the state of node `forward` to that of the next. */
static void go_forwards(mhi_gain *g) {
    const int32_t n_x = g->n_x, n_u = g->n_u, n_w = g->n_window, k = g->forward;
    const double *K = g->K + (ptrdiff_t)k * n_u * n_x, *ff = g->ff + (ptrdiff_t)k * n_u * n_w;
    const mhi_matrix A = {g->closed, n_x, n_x, n_x}, B = {g->here.B, n_x, n_u, n_u};
    memcpy(g->closed, g->here.A, sizeof(double) * (size_t)(n_x * n_x));
    mhi_product_add(&B, K, n_x, n_x, g->closed, n_x);
    set_zero(g->more, n_x * n_w);
    mhi_product_add(&A, g->to_ff, n_w, n_w, g->more, n_w);
    mhi_product_add(&B, ff, n_w, n_w, g->more, n_w);
    add_force(g, g->more);
    memcpy(g->to_ff, g->more, sizeof(double) * (size_t)(n_x * n_w));
    set_zero(g->more, n_x * n_x);
    mhi_product_add(&A, g->to_x, n_x, n_x, g->more, n_x);
    memcpy(g->to_x, g->more, sizeof(double) * (size_t)(n_x * n_x));
    g->forward++;
}

static void copy(double *to, const double *from, ptrdiff_t n) {
    memcpy(to, from, sizeof(double) * (size_t)n);
}

/* Controls of the output's node, where `forward` stands. */
static void give_controls(mhi_gain *g) {
    const int32_t n_x = g->n_x, n_u = g->n_u, n_w = g->n_window, k = g->forward;
    const double *ff = g->ff + (ptrdiff_t)k * n_u * n_w;
    const mhi_matrix K = {g->K + (ptrdiff_t)k * n_u * n_x, n_u, n_x, n_x};
    copy(g->u_ff, ff, n_u * n_w);
    if (k == 0) {
        copy(g->u_x, K.at, n_u * n_x);
        return;
    }
    set_zero(g->u_x, n_u * n_x);
    mhi_product_add(&K, g->to_x, n_x, n_x, g->u_x, n_x);
    mhi_product_add(&K, g->to_ff, n_w, n_w, g->u_ff, n_w);
}

static void finish(mhi_gain *g) {
    const int32_t n_x = g->n_x, n_u = g->n_u, n_w = g->n_window;
    mhi_gain_answer *to = &g->known;
    copy(to->A, g->here.A, n_x * n_x);
    copy(to->B, g->here.B, n_x * n_u);
    copy(to->force, g->here.force, n_x * g->n_m);
    copy(to->K, g->K, n_u * n_x);
    copy(to->ff, g->ff, n_u * n_w);
    copy(to->free, g->here.free, g->n_m);
    copy(to->to_x, g->to_x, n_x * n_x);
    copy(to->to_ff, g->to_ff, n_x * n_w);
    copy(to->u_x, g->u_x, n_u * n_x);
    copy(to->u_ff, g->u_ff, n_u * n_w);
    g->has_known = 1;
}

static void start_forwards(mhi_gain *g) {
    set_zero(g->to_ff, (ptrdiff_t)g->n_x * g->n_window);
    set_zero(g->to_x, g->n_x * g->n_x);
    for (int32_t i = 0; i < g->n_x; i++) {
        g->to_x[i * g->n_x + i] = 1;
    }
}

int32_t mhi_gain_go_on(mhi_gain *g) {
    const int32_t last = g->node < g->horizon ? g->node : g->horizon - 1;
    if (g->stage >= 0) {
        if (go_backwards(g) < 0) {
            return -1;
        }
        if (g->stage >= 0) {
            return 0;
        }
        start_forwards(g);
    } else {
        go_forwards(g);
    }
    if (g->forward == last) {
        give_controls(g);
    }
    if (g->forward == g->node) {
        finish(g);
        return 1;
    }
    return 0;
}
