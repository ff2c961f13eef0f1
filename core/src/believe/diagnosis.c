/* SPDX-License-Identifier: Apache-2.0 */
#include "believe/diagnosis_private.h"

#include "believe/exchange.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NAMED 3          /* worst ones named in a line */
#define FAR 0.03         /* m: a marker this far off is worth a word */
#define EXCHANGED 0.04   /* m: two markers this far off may be exchanged ... */
#define FITS_BETTER 0.25 /* ... if their squares shrink to this share when they are */
#define AT_END 1e-3      /* share of a coordinate's range */
#define AT_BOUND 0.999   /* share of the largest activation */
#define OFTEN 0.1        /* share of estimates */
#define LARGE_TORQUE 0.5 /* residual torque over the muscles' moment, RMS */
#define LARGE_SIZE 20.0  /* N m: worth a word whatever the muscles do */
#define DISAGREES 0.15   /* RMS difference of EMG and estimate */
#define STRETCH 0.5      /* s */

mhe_status mhi_diagnosis_create(const mhe_estimator_info *info, const mhi_run *run,
                                const mhi_recording *recording, const mhi_system *system,
                                mhi_diagnosis **result, mhe_error *err) {
    mhi_arena arena = {0};
    mhi_diagnosis *d = MHI_TAKE(&arena, mhi_diagnosis, 1);
    const int32_t n_k = info->n_markers;
    *result = NULL;
    if (d == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    d->info = info;
    d->run = run;
    d->recording = recording;
    d->system = system;
    d->distance = MHI_TAKE(&arena, double, n_k);
    d->emg = MHI_TAKE(&arena, double, info->n_muscles);
    d->markers = MHI_TAKE(&arena, mhi_tally, n_k);
    d->muscles = MHI_TAKE(&arena, mhi_tally, info->n_muscles);
    d->torques = MHI_TAKE(&arena, mhi_tally, info->n_q);
    d->moments = MHI_TAKE(&arena, mhi_tally, info->n_q);
    d->at_bound = MHI_TAKE(&arena, int32_t, info->n_muscles);
    d->at_end = MHI_TAKE(&arena, int32_t, info->n_q);
    d->exchanged = MHI_TAKE(&arena, int32_t, n_k * n_k);
    d->compared = MHI_TAKE(&arena, int32_t, n_k * n_k);
    d->lag.emg = MHI_TAKE(&arena, double, info->n_muscles);
    d->lag.residual = MHI_TAKE(&arena, double, info->n_muscles);
    d->arena = arena;
    if (!d->lag.emg || !d->lag.residual || !d->distance || !d->emg || !d->markers || !d->muscles ||
        !d->torques || !d->moments || !d->at_bound || !d->at_end || !d->exchanged || !d->compared) {
        mhi_diagnosis_free(d);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhi_lag_begin(&d->lag, info->n_muscles);
    *result = d;
    return MHE_OK;
}

void mhi_diagnosis_free(mhi_diagnosis *d) {
    if (d != NULL) {
        mhi_arena arena = d->arena;
        mhi_arena_free(&arena);
    }
}

static void count(mhi_tally *t, double value) {
    if (isnan(value)) {
        t->missing++;
        return;
    }
    t->squares += value * value;
    t->most = fmax(t->most, fabs(value));
    t->n++;
}

static double apart2(const double *a, const double *b) {
    double sum = 0;
    for (int32_t i = 0; i < 3; i++) {
        sum += (a[i] - b[i]) * (a[i] - b[i]);
    }
    return sum;
}

static void add_stretch(mhi_diagnosis *d, double time) {
    mhi_stretch *s = &d->stretch;
    s->from = s->n == 0 ? time : s->from;
    s->to = time;
    for (int32_t i = 0; i < d->info->n_markers; i++) {
        if (!isnan(d->distance[i])) {
            s->squares += d->distance[i] * d->distance[i];
            s->n++;
        }
    }
    if (s->n > 0 && s->to - s->from >= STRETCH) {
        d->worst =
            d->worst.n == 0 || s->squares / s->n > d->worst.squares / d->worst.n ? *s : d->worst;
        *s = (mhi_stretch){0};
    }
}

static void add_markers(mhi_diagnosis *d, const double *measured, const double *estimated) {
    const int32_t n_k = d->info->n_markers;
    for (int32_t i = 0; i < n_k; i++) {
        d->distance[i] = measured == NULL ? NAN : sqrt(apart2(measured + 3 * i, estimated + 3 * i));
        count(&d->markers[i], d->distance[i]);
        d->n_seen += !isnan(d->distance[i]);
        d->n_wanted++;
    }
    for (int32_t i = 0; i < n_k; i++) {
        for (int32_t j = i + 1; j < n_k; j++) {
            const double as_is = d->distance[i] * d->distance[i] + d->distance[j] * d->distance[j];
            if (isnan(as_is)) {
                continue;
            }
            const double crossed = apart2(measured + 3 * i, estimated + 3 * j) +
                                   apart2(measured + 3 * j, estimated + 3 * i);
            d->compared[i * n_k + j]++;
            d->exchanged[i * n_k + j] +=
                as_is > 2 * EXCHANGED * EXCHANGED && crossed < FITS_BETTER * as_is;
        }
    }
}

/* What the estimator did not believe of markers and EMG. */
static void add_left_out(mhi_diagnosis *d, const mhe_estimate *e) {
    for (int32_t i = 0; i < e->n_tracked; i++) {
        const mhe_tracked *t = mhe_tracked_at(e, i);
        const mhe_channel *c = mhe_channel_at(d->info, t->channel);
        mhi_tally *of = strcmp(c->name, "markers") == 0 ? d->markers
                        : strcmp(c->name, "emg") == 0   ? d->muscles
                                                        : NULL;
        for (int32_t k = 0; k < c->n_labels && of != NULL; k++) {
            const int32_t why = t->why[k * c->per_label];
            of[k].left_out += why == MHE_TRACK_FAR || why == MHE_TRACK_SATURATED;
        }
    }
}

/* What the estimate's node had of a channel; NULL: there is no such channel. */
static const double *measured(const mhe_estimator_info *info, const mhe_estimate *e,
                              const char *channel) {
    for (int32_t i = 0; i < e->n_tracked; i++) {
        const mhe_tracked *t = mhe_tracked_at(e, i);
        if (strcmp(mhe_channel_at(info, t->channel)->name, channel) == 0) {
            return t->measured;
        }
    }
    return NULL;
}

void mhi_diagnosis_add(mhi_diagnosis *d, const mhe_estimate *e) {
    const mhe_estimator_info *f = d->info;
    d->n++;
    d->n_converged += e->status == MHE_FRAME_OK;
    d->n_predicted += e->status == MHE_FRAME_PREDICTED;
    add_left_out(d, e);
    const double *emg = measured(f, e, "emg");
    add_markers(d, measured(f, e, "markers"), e->markers);
    add_stretch(d, e->time);
    const double *control = e->excitation != NULL ? e->excitation : e->activation;
    const mhi_bounds_section *b = &d->run->bounds;
    const int32_t excited = e->excitation != NULL;
    const double most = excited ? b->excitation_max : b->activation_max;
    const int32_t given = most == (excited ? b->excitation_min : b->activation_min);
    for (int32_t i = 0; i < f->n_muscles; i++) {
        d->emg[i] = emg == NULL ? NAN : emg[i];
        count(&d->muscles[i], control[i] - d->emg[i]);
        d->at_bound[i] += !given && control[i] >= AT_BOUND * most;
    }
    mhi_lag_add(&d->lag, f->n_muscles, e->time, d->emg, control);
    for (int32_t i = 0; i < f->n_q; i++) {
        count(&d->moments[i], e->moment[i]);
        count(&d->torques[i], i < f->n_residual_torques ? e->residual[i] : 0);
        const mhe_coordinate *c = &mhi_system_description(d->system)->coordinates[i];
        const double near = AT_END * (c->upper - c->lower);
        d->at_end[i] += e->q[i] < c->lower + near || e->q[i] > c->upper - near;
    }
}

const double *mhi_diagnosis_distances(const mhi_diagnosis *d) {
    return d->distance;
}

const double *mhi_diagnosis_emg(const mhi_diagnosis *d) {
    return d->emg;
}

/* Up to NAMED of n tallies above `least`, the largest RMS first; their number. */
static int32_t worst(const mhi_tally *all, int32_t n, double least, int32_t *which) {
    int32_t found = 0;
    for (int32_t i = 0; i < n; i++) {
        if (mhi_tally_rms(&all[i]) <= least) {
            continue;
        }
        int32_t at = found < NAMED ? found++ : NAMED;
        while (at > 0 && mhi_tally_rms(&all[i]) > mhi_tally_rms(&all[which[at - 1]])) {
            if (at < NAMED) {
                which[at] = which[at - 1];
            }
            at--;
        }
        if (at < NAMED) {
            which[at] = i;
        }
    }
    return found;
}

/* Pairs whose labels are exchanged in all frames, which the posture nearest to all markers tells
 * although the estimate may have come to terms with them. */
static int32_t add_exchanges_of_all(const mhi_diagnosis *d, mhi_text *out) {
    const mhe_estimator_info *f = d->info;
    mhi_exchange pairs[NAMED];
    uint8_t *suspect = calloc((size_t)f->n_markers + 1, 1);
    int32_t n = 0;
    for (int32_t i = 0; i < f->n_markers && suspect != NULL; i++) {
        suspect[i] = mhi_tally_rms(&d->markers[i]) > FAR;
        n += suspect[i];
    }
    n = n == 0 ? 0 : mhi_exchange_find(d->system, d->recording, suspect, pairs, NAMED);
    for (int32_t i = 0; i < n; i++) {
        mhi_text_add(out,
                     "markers %s and %s look exchanged: all markers are %.1f mm from the nearest "
                     "posture (RMS), %.1f mm with these labels exchanged\n",
                     f->marker_names[pairs[i].a], f->marker_names[pairs[i].b], 1e3 * pairs[i].as_is,
                     1e3 * pairs[i].fixed);
    }
    free(suspect);
    return n;
}

static void exchange_lines(const mhi_diagnosis *d, mhi_text *out) {
    const mhe_estimator_info *f = d->info;
    int32_t n = add_exchanges_of_all(d, out);
    const int32_t of_all = n > 0;
    for (int32_t i = 0; i < f->n_markers && !of_all; i++) {
        for (int32_t j = i + 1; j < f->n_markers; j++) {
            const int32_t at = i * f->n_markers + j;
            if (d->exchanged[at] > 0 && d->exchanged[at] >= OFTEN * d->compared[at]) {
                mhi_text_add(out, "markers %s and %s look exchanged in %.0f %% of the frames\n",
                             f->marker_names[i], f->marker_names[j],
                             100.0 * d->exchanged[at] / d->compared[at]);
                n++;
            }
        }
    }
    mhi_text_add(out, n > 0 ? "try: exchange their labels in the marker file\n" : "");
}

static void marker_lines(const mhi_diagnosis *d, mhi_text *out) {
    const mhe_estimator_info *f = d->info;
    int32_t which[NAMED], n = worst(d->markers, f->n_markers, 0, which);
    if (d->n_wanted == 0 || n == 0) {
        mhi_text_add(out, "markers: none measured\n");
        return;
    }
    mhi_text_add(out, "markers: %.1f %% of the samples missing; farthest from the estimate (RMS):",
                 100.0 * (d->n_wanted - d->n_seen) / d->n_wanted);
    for (int32_t i = 0; i < n; i++) {
        mhi_text_add(out, "%s %s %.1f mm", i == 0 ? "" : ",", f->marker_names[which[i]],
                     1e3 * mhi_tally_rms(&d->markers[which[i]]));
    }
    mhi_text_add(out, "\n");
    exchange_lines(d, out);
    if (mhi_tally_rms(&d->markers[which[0]]) > FAR) {
        mhi_text_add(out,
                     "try: check the place of %s on the model and the model's scale; let "
                     "outliers pull less with 'huber' of the marker cost\n",
                     f->marker_names[which[0]]);
    }
}

/* How well the muscles follow their EMG, over all that have one. */
static void emg_line(const mhi_diagnosis *d, mhi_text *out) {
    mhi_tally all = {0};
    int32_t which[NAMED], n_with = 0;
    for (int32_t i = 0; i < d->info->n_muscles; i++) {
        all.squares += d->muscles[i].squares;
        all.n += d->muscles[i].n;
        n_with += d->muscles[i].n > 0;
    }
    if (worst(d->muscles, d->info->n_muscles, 0, which) > 0) {
        mhi_text_add(out,
                     "EMG and estimate are %.3f apart (RMS, of 1; %d muscles); most: %s %.3f\n",
                     mhi_tally_rms(&all), n_with, d->info->muscle_names[which[0]],
                     mhi_tally_rms(&d->muscles[which[0]]));
    }
}

static void muscle_lines(const mhi_diagnosis *d, mhi_text *out) {
    const mhe_estimator_info *f = d->info;
    int32_t n = 0;
    for (int32_t i = 0; i < f->n_muscles; i++) {
        if (d->at_bound[i] > OFTEN * d->n) {
            mhi_text_add(out, "%s %s (%.0f %%)", n++ == 0 ? "muscles at full activation:" : ",",
                         f->muscle_names[i], 100.0 * d->at_bound[i] / d->n);
        }
    }
    if (n > 0) {
        mhi_text_add(out, "\ntry: residual torques at their joints, stronger muscles (the person "
                          "may be), or a smaller sigma of the activations\n");
    }
    emg_line(d, out);
    int32_t which[NAMED];
    n = worst(d->muscles, f->n_muscles, DISAGREES, which);
    for (int32_t i = 0; i < n; i++) {
        mhi_text_add(out, "%s %s %.2f", i == 0 ? "EMG and estimate disagree (RMS, of 1):" : ",",
                     f->muscle_names[which[i]], mhi_tally_rms(&d->muscles[which[i]]));
    }
    if (n > 0) {
        mhi_text_add(out, "\ntry: check electrode, MVC value and mapping of these channels, or "
                          "give their EMG a larger sigma\n");
    }
}

static void torque_lines(const mhi_diagnosis *d, mhi_text *out) {
    const mhe_estimator_info *f = d->info;
    int32_t n = 0;
    for (int32_t i = 0; i < f->n_q; i++) {
        const double torque = mhi_tally_rms(&d->torques[i]), moment = mhi_tally_rms(&d->moments[i]);
        if (torque > 1 && (torque > LARGE_TORQUE * moment || torque > LARGE_SIZE)) {
            mhi_text_add(out, "%s %s %.1f N m (muscles %.1f)",
                         n++ == 0 ? "large residual torques (RMS):" : ",", f->coordinate_names[i],
                         torque, moment);
        }
    }
    if (n > 0) {
        mhi_text_add(out, "\ntry: expected where muscles or supports are missing in the model; "
                          "elsewhere a smaller sigma of the residual torque there\n");
    }
}

void mhi_diagnosis_lines(const mhi_diagnosis *d, mhi_text *out) {
    if (d->n > 0) {
        marker_lines(d, out);
        muscle_lines(d, out);
        torque_lines(d, out);
    }
}
