/* SPDX-License-Identifier: Apache-2.0 */
/* bands_cause.c: how large the errors are that estimates rest on. */
#include "estimator/bands_private.h"

#include "base/cholesky.h"

#include <string.h>

#define MEMORY 500.0  /* frames that the level of EMG's noise is learnt over */
#define PATIENCE 10.0 /* frames' worth of belief in what the config says of it */
/* The noise of a channel is known by few waves of it and by what all channels show: its band is
 * that of Student's t with 12 degrees of freedom. */
#define FEW (2.179 / 1.96)
#define CYCLE 60.0     /* frames over which what bounds hold is taken together */
#define LEAST_FREE 0.4 /* of what a control answers */
#define QUIET 0.02     /* channels that vary less than that tell little */
#define UNKNOWN 0.1    /* variation of a channel that is not known yet */

/* Next state by an error of a muscle's force that stays over the interval, in units of activation:
 * as if activation and its control were that much larger together. */
static void forces_of(const mhe_estimator *e, mhi_bands *b) {
    const mhi_gain_node *here = &b->gain.here;
    const mhe_layout *layout = mhi_ocp_problem(e->ocp)->layout;
    const mhe_block *activation = mhe_layout_find(layout, MHE_ROLE_STATE, "activation");
    const mhe_block *qdot = mhe_layout_find(layout, MHE_ROLE_STATE, "qdot");
    const int32_t moved = qdot->first + qdot->count; /* q and qdot, which forces move */
    for (int32_t i = 0; i < b->n_x; i++) {
        for (int32_t m = 0; m < b->n_m; m++) {
            const double of_state =
                activation == NULL ? 0 : here->A[i * b->n_x + activation->first + m];
            here->force[i * b->n_m + m] = i < moved ? of_state + here->B[i * b->n_u + m] : 0;
        }
    }
}

/* J^T J of the markers seen at node k, into `normal` [n_q x n_q]. */
static int32_t see_markers(mhe_estimator *e, mhi_bands *b, int32_t k, double *normal) {
    const mhi_channel *c = mhi_channels_find(&e->channels, MHI_SIGNAL_MARKERS);
    const int32_t n_q = b->n_q;
    int32_t n = 0;
    memset(normal, 0, sizeof(double) * (size_t)(n_q * n_q));
    if (c == NULL || !c->read ||
        mhi_system_markers(mhi_ocp_context(e->ocp), mhi_row(e->window.solution.x, k, b->n_x),
                           b->marker, b->marker_q, NULL) != MHE_OK) {
        return 0;
    }
    const double *seen = mhi_row(c->believed, k, c->face.width);
    for (int32_t r = 0; r < 3 * e->n_k; r++) {
        const double *row = b->marker_q + r * n_q;
        n += !isnan(seen[r]);
        for (int32_t i = 0; i < n_q && !isnan(seen[r]); i++) {
            for (int32_t j = 0; j <= i; j++) {
                normal[i * n_q + j] += row[i] * row[j];
            }
        }
    }
    return n;
}

/* Where offsets are learnt, what is left to know of them takes the place of `marker_offset`: the
 * gradient's covariance is w^2 J^T P J. */
static void learnt_offsets_of(mhe_estimator *e, mhi_bands *b, int32_t k, double weight) {
    const mhi_channel *c = mhi_channels_find(&e->channels, MHI_SIGNAL_MARKERS);
    const int32_t n_q = b->n_q;
    double *root = b->unknown, all = 0;
    if (!(e->rates.offsets.sd > 0) || !(weight > 0) ||
        !mhi_offsets_unknown(&e->rates.offsets, mhi_row(e->window.solution.x, k, b->n_x),
                             mhi_row(c->believed, k, c->face.width), root)) {
        return;
    }
    for (int32_t i = 0; i < n_q; i++) {
        all += root[i * n_q + i];
    }
    for (int32_t i = 0; i < n_q; i++) {
        root[i * n_q + i] += 1e-9 * all;
    }
    if (mhi_cholesky_factor(root, n_q) != 0) {
        return;
    }
    for (int32_t i = 0; i < n_q; i++) {
        for (int32_t j = 0; j < n_q; j++) {
            const double entry = j > i ? 0 : j == i ? 1 / root[i * n_q + i] : root[i * n_q + j];
            b->gain.here.pose_fixed[i * n_q + j] = weight * entry;
        }
    }
}

/* Of independent errors of the markers, each of 1 m, the costs' gradient by q has the covariance
 * w^2 J^T J, w being what a square metre weighs: its root's columns are the directions. */
static void postures_of(mhe_estimator *e, mhi_bands *b, int32_t k) {
    const int32_t n_q = b->n_q;
    mhi_gain_node *here = &b->gain.here;
    double *root = here->pose_fixed, weighed = 0, plain = 0;
    const int32_t n = see_markers(e, b, k, root);
    for (int32_t i = 0; i < n_q; i++) {
        weighed += here->hess_xx[i * b->n_x + i];
        plain += root[i * n_q + i];
    }
    for (int32_t i = 0; i < n_q; i++) { /* directions that no marker shows */
        root[i * n_q + i] += 1e-9 * plain;
    }
    const int32_t known = n > 0 && plain > 0 && mhi_cholesky_factor(root, n_q) == 0;
    const double weight = known ? weighed / plain : 0;
    for (int32_t i = 0; i < n_q; i++) {
        for (int32_t j = 0; j < n_q; j++) {
            const double entry = j > i || !known ? 0
                                 : j == i        ? 1 / root[i * n_q + i]
                                                 : root[i * n_q + j];
            here->pose_fresh[i * n_q + j] = weight * b->config->marker_noise * entry;
            here->pose_fixed[i * n_q + j] = weight * b->config->marker_offset * entry;
        }
    }
    learnt_offsets_of(e, b, k, weight);
}

/* Joint moments around node k. */
static int32_t moments_of(mhe_estimator *e, mhi_bands *b, int32_t k) {
    const int32_t n_q = b->n_q;
    mhi_bands_moments *to = &b->moments[1];
    mhi_muscle_state muscles;
    mhe_system_point at;
    mhi_system_point(e->system, mhi_row(e->window.solution.x, k, b->n_x),
                     mhi_row(e->window.solution.u, k, b->n_u), NULL, &at);
    if (mhi_system_muscles(mhi_ocp_context(e->ocp), &at, 1, &muscles, NULL) != MHE_OK) {
        return 0;
    }
    memcpy(to->by_q, muscles.moment_q, sizeof(double) * (size_t)(n_q * n_q));
    memcpy(to->by_v, muscles.moment_v, sizeof(double) * (size_t)(n_q * n_q));
    for (int32_t j = 0; j < n_q; j++) {
        for (int32_t m = 0; m < b->n_m; m++) {
            to->by_a[j * b->n_m + m] = -muscles.length_q[m * n_q + j] * muscles.force_a[m];
        }
    }
    return 1;
}

int32_t mhi_bands_expand(mhe_estimator *e, mhi_bands *b) {
    const int32_t k = e->node > 0 && e->node < e->window.n ? e->node : 1;
    mhi_gain_node *here = &b->gain.here;
    double cost = 0;
    const mhe_stage_values out = {.size = sizeof out,
                                  .cost = &cost,
                                  .grad_x = b->slope,
                                  .grad_u = b->slope + b->n_x,
                                  .hess_xx = here->hess_xx,
                                  .hess_ux = here->hess_ux,
                                  .hess_uu = here->hess_uu,
                                  .x_next = b->value,
                                  .A = here->A,
                                  .B = here->B};
    if (mhi_ocp_expand(e->ocp, k, mhi_row(e->window.solution.x, k, b->n_x),
                       mhi_row(e->window.solution.u, k, b->n_u), &out, NULL) != MHE_OK) {
        return 0;
    }
    b->gain.interval = mhi_ocp_problem(e->ocp)->interval;
    forces_of(e, b);
    postures_of(e, b, k);
    memcpy(here->free, b->free, sizeof(double) * (size_t)b->n_m);
    for (int32_t m = 0; m < b->n_m; m++) { /* what holds a control is its EMG */
        here->control[m] = -here->hess_uu[m * b->n_u + m];
    }
    return moments_of(e, b, k);
}

/* EMG of node k, where it is believed, NaN where not. */
static const double *emg_of(const mhe_estimator *e, int32_t k) {
    const mhi_channel *c = mhi_channels_find(&e->channels, mhi_ocp_control(e->ocp));
    return c == NULL || !c->read ? NULL : mhi_row(c->believed, k, c->face.width);
}

/* How much its channels varied so far; NULL: there are none. */
static const double *varied_of(const mhe_estimator *e) {
    const mhi_channel *c = mhi_channels_find(&e->channels, mhi_ocp_control(e->ocp));
    return c == NULL || !c->read ? NULL : c->varied;
}

static double variation_of(const double *spread, int32_t m) {
    return spread == NULL || !(spread[m] > 0) ? UNKNOWN : spread[m];
}

/* A share by which a number may be off is one of the true number; what is at hand is already off,
 * and where it is too small the truth is more than that share above it. Of e normal with deviation
 * sd that is e / (1 + e), whose mean square is sd^2 (1 + 9 sd^2 + 75 sd^4) to sixth order. */
static double share_of(double sd) {
    const double square = sd * sd;
    return sd * sqrt(1 + square * (9 + 75 * square));
}

/* Where it is alone its 95 % end where those of e do: further than its deviation where the truth is
 * above, less far below. */
static double far_of(double sd) {
    const double low = fmin(1.645 * sd, 0.8);
    return sd > 0 ? fmax(0, sd * ONE_SIDED / (1 - low) / share_of(sd) - 1) : 0;
}

static double near_of(double sd) {
    return sd > 0 ? 1 - sd / (1 + TWO_SIDED * sd) / share_of(sd) : 0;
}

/* A part of a cause with its tail, as a share of the whole: third moments add up. */
static double skew_of(double part, double tail, double all) {
    return all > 0 ? tail * pow(part / all, 1.5) : 0;
}

/* What EMG and bounds leave for the truth: a control is nearly surely within SURE standard
 * deviations of its EMG, whatever the other muscles are asked to do. */
static void limit_activation(const mhe_estimator *e, mhi_bands *b, int32_t k, int32_t m, double emg,
                             double activation) {
    const double u = mhi_row(e->window.solution.u, k, b->n_u)[m];
    const double least = mhi_ocp_u_lower(e->ocp, k)[m], most = mhi_ocp_u_upper(e->ocp, k)[m];
    b->below[m] = fmax(0, activation - least);
    b->above[m] = fmax(0, most - activation);
    b->room[m] = fmax(b->below[m], b->above[m]);
    if (!isnan(emg)) {
        const double off = SURE * b->size[m];
        b->below[m] = fmin(b->below[m], fmax(0, u - emg + off));
        b->above[m] = fmin(b->above[m], fmax(0, emg - u + off * (1 + b->far[m])));
    }
}

static void size_emg(mhe_estimator *e, mhi_bands *b, int32_t k, const double *activation) {
    const mhi_uncertainty_section *c = b->config;
    const int32_t node = k < e->window.n ? k : e->window.n - 1;
    const double *emg = emg_of(e, node);
    const double *spread = varied_of(e);
    for (int32_t m = 0; m < b->n_m; m++) {
        const int32_t known = emg != NULL && !isnan(emg[m]);
        const double noise = FEW * b->emg.level * c->emg_noise * variation_of(spread, m);
        const double gain = known ? share_of(c->emg_gain) * emg[m] : 0;
        const double all = known ? noise * noise + gain * gain + c->emg_floor * c->emg_floor
                                 : c->control * c->control;
        b->size[m] = sqrt(all);
        b->noise_share[m] = known && all > 0 ? noise * noise / all : 0;
        b->far[m] = known ? skew_of(gain * gain, far_of(c->emg_gain), all) : 0;
        b->near[m] = known ? skew_of(gain * gain, near_of(c->emg_gain), all) : 0;
        limit_activation(e, b, node, m, known ? emg[m] : NAN, activation[m]);
    }
}

/* How far forces are above and below those at hand with other lengths: b->more, b->less. */
static void vary_lengths(mhi_bands *b, const double *activation, const mhi_muscle_state *muscles) {
    memset(b->more, 0, sizeof(double) * (size_t)b->n_m);
    memset(b->less, 0, sizeof(double) * (size_t)b->n_m);
    for (int32_t i = 0; i < MHI_N_VARIANTS; i++) {
        if (b->variants[i] == NULL ||
            mhi_variant_forces(b->variants[i], activation, muscles->length, muscles->velocity,
                               b->force, NULL) != MHE_OK) {
            continue;
        }
        for (int32_t m = 0; m < b->n_m; m++) {
            const double d = b->force[m] - muscles->force[m];
            b->more[m] = isfinite(d) ? fmax(d, b->more[m]) : b->more[m];
            b->less[m] = isfinite(d) ? fmax(-d, b->less[m]) : b->less[m];
        }
    }
}

/* A muscle's force errors by its numbers, as one: they act through the force alone. The two ways of
 * a length are 1 + tail and 1 - 2 tail of its deviation. */
static void size_forces(mhe_estimator *e, mhi_bands *b, const double *activation,
                        const mhi_muscle_state *muscles) {
    const double off = b->config->max_isometric_force;
    vary_lengths(b, activation, muscles);
    for (int32_t m = 0; m < b->n_m; m++) {
        const double least = 1e-3 * e->description->muscles[m].max_isometric_force;
        const double slope = fmax(fabs(muscles->force_a[m]), least);
        const double more = fmax(b->more[m], b->less[m]), other = fmin(b->more[m], b->less[m]);
        const double length = (2 * more + other) / 3 / TWO_SIDED;
        const double strength = share_of(off) * muscles->force[m];
        const double all = length * length + strength * strength;
        const double sign = b->more[m] > b->less[m] ? 1 : -1;
        const double tail = more > 0 ? sign * (more - other) / (2 * more + other) : 0;
        const double of_length = skew_of(length * length, tail, all);
        b->size[b->n_m + m] = sqrt(all) / slope;
        b->far[b->n_m + m] = of_length + skew_of(strength * strength, far_of(off), all);
        b->near[b->n_m + m] = 2 * of_length + skew_of(strength * strength, near_of(off), all);
    }
}

void mhi_bands_size(mhe_estimator *e, mhi_bands *b, int32_t k, const double *activation,
                    const mhi_muscle_state *muscles) {
    size_emg(e, b, k, activation);
    size_forces(e, b, activation, muscles);
    for (int32_t i = b->gain.fixed; i < b->gain.n_columns; i++) {
        b->size[i] = 1;
    }
}

/* Probability that a normal deviate is below `x` of its standard deviations. */
static double normal_below(double x) {
    return 0.5 * erfc(-x * 0.70710678118654752);
}

void mhi_bands_free_controls(mhe_estimator *e, mhi_bands *b) {
    const mhe_solution *s = &e->window.solution;
    const double *least = mhi_ocp_u_lower(e->ocp, 0), *most = mhi_ocp_u_upper(e->ocp, 0);
    const mhi_gain_answer *known = &b->gain.known;
    for (int32_t m = 0; m < b->n_m; m++) {
        const double *row = b->controls + (ptrdiff_t)m * b->gain.n_columns;
        const double below = s->u[m] - least[m] - s->zu_lower[m] / known->weight[m];
        const double above = most[m] - s->u[m] - s->zu_upper[m] / known->weight[m];
        double squares = 0;
        for (int32_t i = 0; i < b->gain.n_columns; i++) {
            squares += row[i] * row[i];
        }
        const double reach = sqrt(squares) / known->free[m];
        const double inside =
            reach > 0 ? normal_below(below / reach) + normal_below(above / reach) - 1 : 1;
        const double free = sqrt(fmax(0, inside));
        b->free[m] = fmax(LEAST_FREE, b->free[m] + (free - b->free[m]) / CYCLE);
    }
}

void mhi_bands_learn(mhe_estimator *e, mhi_bands *b) {
    const double *emg = emg_of(e, 0), *u = e->window.solution.u;
    const double *spread = varied_of(e);
    const double level = b->emg.level * b->emg.level;
    double seen = 0, noise = 0, others = 0;
    for (int32_t m = 0; m < b->n_m && emg != NULL; m++) {
        const double *row = b->controls + (ptrdiff_t)m * b->gain.n_columns;
        const double scale = variation_of(spread, m) + QUIET;
        if (isnan(emg[m])) {
            continue;
        }
        const double unit = 1 / (scale * scale);
        double squares = 0, of_noise = 0;
        for (int32_t i = 0; i < b->gain.n_columns; i++) {
            squares += row[i] * row[i];
        }
        squares += b->size[m] * (b->size[m] - 2 * row[m]); /* of EMG itself, too */
        for (int32_t i = 0; i < b->n_m; i++) {
            const double error = row[i] - (i == m ? b->size[m] : 0);
            of_noise += b->noise_share[i] * error * error;
        }
        seen += (u[m] - emg[m]) * (u[m] - emg[m]) * unit;
        noise += of_noise * unit / (level * FEW * FEW);
        others += (squares - of_noise) * unit;
    }
    if (!(noise > 0) || !b->config->emg_measured) {
        return;
    }
    mhi_emg_level *l = &b->emg;
    const double keep = 1 - 1 / MEMORY;
    l->seen = keep * l->seen + seen;
    l->noise = keep * l->noise + noise;
    l->others = keep * l->others + others;
    l->frames++;
    /* What the other causes may do says nothing of the noise: it holds on to level 1. */
    const double held = PATIENCE * l->noise / l->frames + l->others;
    l->level = sqrt((held + fmax(0, l->seen - l->others)) / (held + l->noise));
}
