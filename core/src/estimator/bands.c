/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/bands_private.h"

#include <string.h>

/* All lengths together, and tendons alone: curves may look at those otherwise than by the norm
 * length of the fibres (the passive force of the paper's begins where a fibre is as long as the
 * slack tendon). */
static mhe_status create_variants(mhe_estimator *e, mhi_bands *b, mhe_error *err) {
    const mhi_uncertainty_section *c = b->config;
    const mhi_variation all = {
        .fiber = c->optimal_fiber_length, .tendon = c->tendon_slack_length, .path = c->path_length};
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < MHI_N_VARIANTS && status == MHE_OK; i++) {
        mhi_variation by = i < 2 ? all : (mhi_variation){.tendon = all.tendon};
        const int32_t other = i < 2 || all.fiber > 0 || all.path > 0;
        by.far = i % 2 == 0 ? MHI_FAR : -MHI_FAR;
        if (other && (by.fiber > 0 || by.tendon > 0 || by.path > 0)) {
            status = mhi_variant_create(e->system, &by, &b->variants[i], err);
        }
    }
    return status;
}

static mhe_status take(mhe_estimator *e, mhi_bands *b, mhe_error *err) {
    const ptrdiff_t n = b->gain.n_columns;
    const mhi_room rooms[] = {{&b->error, b->n_x * n},
                              {&b->next, b->n_x * n},
                              {&b->size, n},
                              {&b->free, b->n_m},
                              {&b->noise_share, b->n_m},
                              {&b->far, b->gain.fixed},
                              {&b->near, b->gain.fixed},
                              {&b->below, b->n_m},
                              {&b->above, b->n_m},
                              {&b->room, b->n_m},
                              {&b->at, b->n_x * n},
                              {&b->controls, b->n_u * n},
                              {&b->row, n},
                              {&b->marker_q, 3 * e->n_k * b->n_q},
                              {&b->unknown, b->n_q * b->n_q},
                              {&b->marker, 3 * e->n_k},
                              {&b->force, b->n_m},
                              {&b->more, b->n_m},
                              {&b->less, b->n_m},
                              {&b->force_error, b->n_m * n},
                              {&b->q, b->n_q},
                              {&b->activation, b->n_m},
                              {&b->force_sd, b->n_m},
                              {&b->moment, b->n_q},
                              {&b->moments[0].by_a, b->n_q * b->n_m},
                              {&b->moments[0].by_q, b->n_q * b->n_q},
                              {&b->moments[0].by_v, b->n_q * b->n_q},
                              {&b->moments[1].by_a, b->n_q * b->n_m},
                              {&b->moments[1].by_q, b->n_q * b->n_q},
                              {&b->moments[1].by_v, b->n_q * b->n_q},
                              {&b->value, b->n_x},
                              {&b->slope, b->n_x + b->n_u}};
    return MHI_TAKE_ROOMS(&b->arena, rooms, err);
}

static mhe_status check(const mhe_estimator *e, mhe_error *err) {
    const mhi_node *output = mhi_node_find(mhi_tree_root(e->run->tree), "output");
    const mhi_node *node = mhi_node_find(output, "uncertainty");
    if (mhi_system_face(e->system)->n_z > 0) {
        return mhi_fail_at(err, MHE_E_CONFIG, e->run->tree, node,
                           "output.uncertainty: muscles with states of their own have none; "
                           "'muscle.tendon: rigid' has");
    }
    if (e->node > 0 && e->window.n > MHI_GAIN_LONGEST) {
        return mhi_fail_at(err, MHE_E_CONFIG, e->run->tree, node,
                           "output.uncertainty: with more than %d intervals (horizon.window is %d) "
                           "only at 'output.node: first'",
                           MHI_GAIN_LONGEST, (int)e->window.n);
    }
    return MHE_OK;
}

mhe_status mhi_bands_create(mhe_estimator *e, mhi_bands **bands, mhe_error *err) {
    mhi_arena arena = {0};
    *bands = NULL;
    mhe_status status = check(e, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_bands *b = MHI_TAKE(&arena, mhi_bands, 1);
    if (b == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    *b = (mhi_bands){.config = &e->run->uncertainty,
                     .gain = {.n_x = e->window.n_x,
                              .n_u = e->n_u,
                              .n_q = e->n_q,
                              .n_m = e->n_m,
                              .horizon = e->window.n,
                              .node = e->node},
                     .n_x = e->window.n_x,
                     .n_u = e->n_u,
                     .n_q = e->n_q,
                     .n_m = e->n_m,
                     .emg = {.level = 1},
                     .arena = arena};
    status = mhi_gain_create(&b->gain, &b->arena, err);
    if (status == MHE_OK) {
        status = take(e, b, err);
    }
    if (status == MHE_OK) {
        status = create_variants(e, b, err);
    }
    if (status != MHE_OK) {
        mhi_bands_free(b);
        return status;
    }
    for (int32_t m = 0; m < b->n_m; m++) {
        b->free[m] = 1;
    }
    *bands = b;
    return MHE_OK;
}

void mhi_bands_free(mhi_bands *b) {
    if (b != NULL) {
        mhi_arena arena = b->arena;
        for (int32_t i = 0; i < MHI_N_VARIANTS; i++) {
            mhi_variant_free(b->variants[i]);
        }
        mhi_arena_free(&arena);
    }
}

void mhi_bands_forget(mhi_bands *b) {
    if (b != NULL) {
        b->begun = b->gain.has_known = 0;
    }
}

void mhi_bands_set_node(mhi_bands *b, int32_t node) {
    if (b != NULL) {
        b->gain.node = node;
        b->gain.has_known = b->begun = 0;
    }
}

/* out = by_x error + by_columns size, of n rows. */
static void spread(const mhi_bands *b, int32_t n, const double *by_x, const double *by_columns,
                   double *out) {
    const int32_t all = b->gain.n_columns, of_window = b->gain.n_window;
    const mhi_matrix answer = {(double *)(uintptr_t)by_x, n, b->n_x, b->n_x};
    for (int32_t i = 0; i < n; i++) {
        for (int32_t j = 0; j < of_window; j++) {
            out[i * all + j] = by_columns[i * of_window + j] * b->size[j];
        }
        memset(out + i * all + of_window, 0, sizeof(double) * (size_t)(all - of_window));
    }
    mhi_product_add(&answer, b->error, all, all, out, all);
}

/* The next window's first node is this one's second; what was fresh is older by a node. */
static void move_on(mhi_bands *b) {
    const mhi_gain *g = &b->gain;
    const int32_t n = g->n_columns;
    const mhi_matrix A = {g->known.A, b->n_x, b->n_x, b->n_x};
    const mhi_matrix B = {g->known.B, b->n_x, b->n_u, b->n_u};
    memset(b->next, 0, sizeof(double) * (size_t)(b->n_x * n));
    mhi_product_add(&A, b->error, n, n, b->next, n);
    mhi_product_add(&B, b->controls, n, n, b->next, n);
    for (int32_t i = 0; i < b->n_x; i++) {
        double *row = b->next + i * n;
        for (int32_t m = 0; m < b->n_m; m++) {
            row[b->n_m + m] += g->known.force[i * b->n_m + m] * b->size[b->n_m + m];
        }
        memmove(row + g->fresh + g->n_q, row + g->fresh,
                sizeof(double) * (size_t)(n - g->fresh - g->n_q));
        memset(row + g->fresh, 0, sizeof(double) * (size_t)g->n_q);
    }
    double *swap = b->error;
    b->error = b->next;
    b->next = swap;
}

/* A sum of independent causes: its standard deviation, and how much further than that it reaches on
 * the side of its long tail and less on the other, shares. The skewness of a sum falls with the
 * number of its causes, as its cubes say (the first term of Cornish and Fisher 1938,
 * doi:10.2307/1400905). */
typedef struct sum {
    double sd, far, near;
    int32_t above; /* the long tail is that of truths above the estimate */
} sum;

/* `cut` is what bounds leave of the answers to other causes than column `own`, a share: their tails
 * are what is cut off first. */
static sum sum_of(const mhi_bands *b, const double *row, int32_t own, double cut) {
    double squares = 0, far = 0, near = 0;
    for (int32_t i = 0; i < b->gain.fixed; i++) {
        const double square = row[i] * row[i];
        const double cube = square * row[i] * (i == own ? 1 : cut * cut);
        squares += square;
        far += b->far[i] * cube;
        near += b->near[i] * cube;
    }
    for (int32_t i = b->gain.fixed; i < b->gain.n_columns; i++) { /* postures have no tails */
        squares += row[i] * row[i];
    }
    const double sd = sqrt(squares), unit = squares > 0 ? 1 / (squares * sd) : 0;
    return (sum){sd, fabs(far) * unit, fmin(1, fabs(near) * unit), near > 0};
}

/* Such that 1.96 of it hold 95 % on either side, by the side that reaches further. */
static double reach_of(const mhi_bands *b, const double *row) {
    const sum s = sum_of(b, row, -1, 1);
    return s.sd * (1 + s.far);
}

/* The same of a sum whose truth is no more than `below` and `above` off. Where one side is held
 * whole, all of the 5 % may lie on the other. */
static double reach_within(sum s, double below, double above) {
    const double far = s.sd * (1 + s.far), near = s.sd * (1 - s.near);
    const double up = s.above ? far : near; /* truth above the estimate */
    const double down = s.above ? near : far;
    return fmin(far, fmin(fmax(ONE_SIDED * down, above / TWO_SIDED),
                          fmax(ONE_SIDED * up, below / TWO_SIDED)));
}

/* The row of activations of the output's node: states, or controls. */
static const double *activation_row(const mhe_estimator *e, const mhi_bands *b, int32_t m) {
    const mhe_block *state =
        mhe_layout_find(mhi_ocp_problem(e->ocp)->layout, MHE_ROLE_STATE, "activation");
    const ptrdiff_t n = b->gain.n_columns;
    return state != NULL ? b->at + (state->first + m) * n : b->controls + m * n;
}

/* Adds `factor` row. */
static void add(double *to, const double *row, double factor, int32_t n) {
    for (int32_t i = 0; i < n && factor != 0; i++) {
        to[i] += factor * row[i];
    }
}

/* Moments are held by the markers: the errors of the forces cancel in them. So they are measured
 * where the answers were found, else what moved since would be all that is left. */
static void measure_moments(mhi_bands *b) {
    const int32_t n = b->gain.n_columns, n_q = b->n_q;
    const mhi_bands_moments *by = &b->moments[0];
    for (int32_t j = 0; j < n_q; j++) {
        memset(b->row, 0, sizeof(double) * (size_t)n);
        for (int32_t m = 0; m < b->n_m; m++) {
            add(b->row, b->force_error + m * n, by->by_a[j * b->n_m + m], n);
        }
        for (int32_t i = 0; i < n_q; i++) {
            add(b->row, b->at + i * n, by->by_q[j * n_q + i], n);
            add(b->row, b->at + (n_q + i) * n, by->by_v[j * n_q + i], n);
        }
        b->moment[j] = reach_of(b, b->row);
    }
}

/* The row of a muscle's activation as it is while its control is between its bounds: what they
 * leave now says reach_within(). Only the error of its own force it makes good as bounds let it.
 * However much the other causes ask of it, the truth is no further than the bound that is further
 * off: what they make of it is cut off there. Gives the share that is left. */
static double let_go(const mhi_bands *b, int32_t m, double *row) {
    const int32_t own = b->n_m + m;
    const double most = b->room[m] / TWO_SIDED, good = row[own];
    double squares = 0;
    row[own] = 0;
    for (int32_t i = 0; i < b->gain.n_columns; i++) {
        squares += row[i] * row[i];
    }
    const double sd = sqrt(squares) / b->gain.known.free[m];
    const double cut = sd > most ? most / sd : 1;
    for (int32_t i = 0; i < b->gain.n_columns; i++) {
        row[i] *= cut / b->gain.known.free[m];
    }
    row[own] = good;
    return cut;
}

/* Standard deviations from the errors of the output's node, in b->at and b->controls. */
static void measure(const mhe_estimator *e, mhi_bands *b, const mhi_muscle_state *muscles) {
    const int32_t n = b->gain.n_columns, n_q = b->n_q;
    for (int32_t j = 0; j < n_q; j++) {
        b->q[j] = reach_of(b, b->at + j * n);
    }
    for (int32_t m = 0; m < b->n_m; m++) { /* of the activation, and of the muscle's numbers */
        double *row = b->force_error + m * n;
        memcpy(row, activation_row(e, b, m), sizeof(double) * (size_t)n);
        row[b->n_m + m] += b->size[b->n_m + m];
    }
    measure_moments(b);
    for (int32_t m = 0; m < b->n_m; m++) {
        double *row = b->force_error + m * n;
        memcpy(row, activation_row(e, b, m), sizeof(double) * (size_t)n);
        const double cut = let_go(b, m, row);
        b->activation[m] = reach_within(sum_of(b, row, b->n_m + m, cut), b->below[m], b->above[m]);
        row[b->n_m + m] += b->size[b->n_m + m];
        for (int32_t i = 0; i < n; i++) {
            row[i] *= muscles->force_a[m];
        }
        for (int32_t i = 0; i < n_q; i++) {
            add(row, b->at + i * n, muscles->force_q[m * n_q + i], n);
            add(row, b->at + (n_q + i) * n, muscles->force_v[m * n_q + i], n);
        }
        const double number = SURE * b->size[b->n_m + m] * muscles->force_a[m];
        b->force_sd[m] = reach_within(
            sum_of(b, row, b->n_m + m, cut),
            fmin(b->below[m] * muscles->force_a[m] + number, fmax(0, muscles->force[m])),
            b->above[m] * muscles->force_a[m] + number * (1 + b->far[b->n_m + m]));
    }
}

/* New answers of the window: a stage a frame, all of them where there are none. */
static void renew(mhe_estimator *e, mhi_bands *b) {
    int32_t at_work = b->gain.has_known && (b->gain.stage >= 0 || b->gain.forward < b->gain.node);
    do {
        if (!at_work) {
            if (!mhi_bands_expand(e, b)) {
                return;
            }
            mhi_gain_begin(&b->gain);
        }
        const int32_t done = mhi_gain_go_on(&b->gain);
        at_work = done == 0;
        if (done > 0) {
            const mhi_bands_moments swap = b->moments[0];
            b->moments[0] = b->moments[1];
            b->moments[1] = swap;
        }
        if (done < 0) {
            b->gain.stage = -1;
            b->gain.forward = b->gain.node;
            return;
        }
    } while (!b->gain.has_known);
}

/* Where the window begins its error is taken as what it would settle to. */
static void settle(mhi_bands *b) {
    memset(b->error, 0, sizeof(double) * (size_t)(b->n_x * b->gain.n_columns));
    for (int32_t i = 0; i < 4 * b->gain.horizon; i++) {
        spread(b, b->n_u, b->gain.known.K, b->gain.known.ff, b->controls);
        move_on(b);
    }
    b->begun = 1;
}

/* NaN, until something is known. */
static void give_unknown(mhi_bands *b, mhe_estimate *out) {
    double *const all[] = {b->q, b->moment, b->activation, b->force_sd};
    for (int32_t k = 0; k < 4; k++) {
        for (int32_t i = 0; i < (k < 2 ? b->n_q : b->n_m); i++) {
            all[k][i] = NAN;
        }
    }
    out->q_sd = b->q;
    out->activation_sd = b->activation;
    out->force_sd = b->force_sd;
    out->moment_sd = b->moment;
}

void mhi_bands_give(mhe_estimator *e, int32_t k, mhe_estimate *out) {
    mhi_bands *b = e->bands;
    mhi_muscle_state muscles;
    mhe_system_point at;
    if (b == NULL) {
        return;
    }
    give_unknown(b, out);
    if (b->gain.node > 0 && !b->gain.whole) {
        return;
    }
    renew(e, b);
    mhi_system_point(e->system, e->output.x, e->output.held, NULL, &at);
    if (!b->gain.has_known ||
        mhi_system_muscles(mhi_ocp_context(e->ocp), &at, 1, &muscles, NULL) != MHE_OK) {
        return;
    }
    mhi_bands_size(e, b, k, e->output.activation, &muscles);
    if (!b->begun) {
        settle(b);
    }
    const mhi_gain_answer *known = &b->gain.known;
    if (k > 0) {
        spread(b, b->n_x, known->to_x, known->to_ff, b->at);
        spread(b, b->n_u, known->u_x, known->u_ff, b->controls);
    } else {
        memcpy(b->at, b->error, sizeof(double) * (size_t)(b->n_x * b->gain.n_columns));
        spread(b, b->n_u, known->K, known->ff, b->controls);
    }
    measure(e, b, &muscles);
    if (k > 0) {
        spread(b, b->n_u, known->K, known->ff, b->controls);
    }
    mhi_bands_free_controls(e, b);
    mhi_bands_learn(e, b);
    move_on(b);
}
