/* SPDX-License-Identifier: Apache-2.0 */
#include "emg/electrodes_private.h"

#include "base/text.h"

#include <fnmatch.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define KEPT 1.0   /* s of samples that stay at hand */
#define STALE 0.01 /* s that a value lives beyond the next sample's turn */

/* ---- names ---- */

static const char **muscle_names(const mhe_description *d, mhi_arena *arena) {
    const char **names = MHI_TAKE(arena, const char *, d->n_muscles + 1);
    for (int32_t i = 0; i < d->n_muscles && names != NULL; i++) {
        names[i] = d->muscles[i].name;
    }
    return names;
}

mhe_status mhi_electrodes_columns(const mhi_run *run, const char *source, const char *const *labels,
                                  int32_t n_labels, int32_t *column, mhe_error *err) {
    union {
        const char *const *lent;
        char **owned;
    } texts = {.lent = labels}; /* only read */
    const mhi_table table = {.n_labels = n_labels, .labels = texts.owned};
    int32_t n_found = 0;
    for (int32_t i = 0; i < run->emg.n_channels; i++) {
        const char *name = run->emg.channels[i].name;
        column[i] = mhi_table_find(&table, name);
        column[i] = column[i] < 0 ? mhi_table_find_alike(&table, name, NULL) : column[i];
        n_found += column[i] >= 0;
        for (int32_t k = 0; k < i && column[i] >= 0; k++) {
            if (column[k] == column[i]) {
                return mhe_fail(err, MHE_E_INPUT, "%s: the channels '%s' and '%s' are one column",
                                source, run->emg.channels[k].name, name);
            }
        }
    }
    if (n_found == 0) {
        char hint[256];
        const char *name = run->emg.channels[0].name;
        return mhe_fail(err, MHE_E_INPUT, "%s: no column for any channel: '%s'%s", source, name,
                        mhi_suggest(hint, sizeof hint, name, labels, n_labels));
    }
    return MHE_OK;
}

/* How models write a side, of a muscle that is named without one. */
#define N_SIDES 6
static int32_t spell(int32_t side, int32_t form, const char *name, char *out, size_t size) {
    static const char *const forms[2][N_SIDES] = {
        {"%s_l", "l_%s", "%s_left", "left_%s", "%s_L", "L_%s"},
        {"%s_r", "r_%s", "%s_right", "right_%s", "%s_R", "R_%s"}};
    if (form == 0) {
        (void)snprintf(out, size, "%s", name);
        return 1;
    }
    if (side == MHI_EMG_NO_SIDE) {
        return 0;
    }
    const char *text = forms[side == MHI_EMG_RIGHT][form - 1], *gap = strstr(text, "%s");
    (void)snprintf(out, size, "%.*s%s%s", (int)(gap - text), text, name, gap + 2);
    return 1;
}

/* A muscle has one channel. */
static mhe_status lay_wire(mhi_electrodes *e, const mhi_run *run, const mhi_emg_channel *c, wire w,
                           const char *name, const char **owner, mhe_error *err) {
    if (owner[w.muscle] != NULL) {
        return mhi_fail_at(err, MHE_E_CONFIG, run->tree, c->node,
                           "emg.channels: the muscle '%s' stands at two channels, '%s' and '%s'",
                           name, owner[w.muscle], c->name);
    }
    owner[w.muscle] = c->name;
    e->wires[e->n_wires++] = w;
    return MHE_OK;
}

static mhe_status lay_wires(mhi_electrodes *e, const mhi_run *run, const mhe_description *d,
                            mhe_error *err) {
    const mhi_emg_section *o = &run->emg;
    const char **names = muscle_names(d, &e->arena);
    const char **owner = MHI_TAKE(&e->arena, const char *, d->n_muscles + 1);
    e->wires = MHI_TAKE(&e->arena, wire, d->n_muscles + 1);
    if (names == NULL || owner == NULL || e->wires == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < o->n_channels; i++) {
        const mhi_emg_channel *c = &o->channels[i];
        for (int32_t k = 0; k < c->muscles.n; k++) {
            const char *name = c->muscles.values[k];
            const double gain = c->gains.n > 0 ? c->gains.values[k] : 1;
            const double shape = c->shape.n == 0 ? 0 : c->shape.values[c->shape.n > 1 ? k : 0];
            const int32_t before = e->n_wires;
            mhe_status status = MHE_OK;
            for (int32_t form = 0; form <= N_SIDES && e->n_wires == before; form++) {
                char pattern[256];
                if (spell(o->side, form, name, pattern, sizeof pattern)) {
                    for (int32_t m = 0; m < d->n_muscles && status == MHE_OK; m++) {
                        status = fnmatch(pattern, names[m], 0) == 0
                                     ? lay_wire(e, run, c, (wire){i, m, gain, shape}, names[m],
                                                owner, err)
                                     : MHE_OK;
                    }
                }
                if (status != MHE_OK) {
                    return status;
                }
            }
            char hint[256];
            if (e->n_wires == before) {
                return mhi_fail_at(err, MHE_E_CONFIG, run->tree, c->node,
                                   "emg.channels: '%s': the model has no muscle '%s'%s", c->name,
                                   name, mhi_suggest(hint, sizeof hint, name, names, d->n_muscles));
            }
        }
    }
    return MHE_OK;
}

/* ---- the stream ---- */

static mhe_status take_arrays(mhi_electrodes *e, mhe_error *err) {
    const double kept = (e->longest + KEPT) * e->rate + 16;
    if (!(kept < 1e8)) {
        return mhe_fail(err, MHE_E_INPUT, "EMG at %g Hz: that cannot be", e->rate);
    }
    e->capacity = (int32_t)kept;
    const int32_t n = e->n_channels;
    e->raw = MHI_TAKE(&e->arena, double, n);
    e->scale = MHI_TAKE(&e->arena, double, n);
    e->peaks = MHI_TAKE(&e->arena, double, n);
    e->times = MHI_TAKE(&e->arena, double, e->capacity);
    e->values = MHI_TAKE(&e->arena, double, (int64_t)e->capacity *n);
    const int missing = e->raw == NULL || e->scale == NULL || e->peaks == NULL ||
                        e->times == NULL || e->values == NULL;
    return missing ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

mhe_status mhi_electrodes_open(const mhi_run *run, const mhe_description *model, const char *source,
                               const char *const *labels, int32_t n_labels, double rate,
                               const double *mvc, mhi_electrodes **electrodes, mhe_error *err) {
    *electrodes = NULL;
    mhi_electrodes *e = calloc(1, sizeof *e);
    if (e == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const mhi_emg_section *o = &run->emg;
    e->n_channels = o->n_channels;
    e->n_muscles = model->n_muscles;
    e->rate = rate;
    e->offset = run->data.emg_offset;
    e->max = o->max;
    e->column = MHI_TAKE(&e->arena, int32_t, e->n_channels);
    mhe_error why = {0};
    mhe_status status = e->column == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                          : lay_wires(e, run, model, err);
    if (status == MHE_OK) {
        status = mhi_electrodes_columns(run, source, labels, n_labels, e->column, err);
    }
    if (status == MHE_OK) {
        status = mhi_envelope_create(o, e->n_channels, rate, &e->envelope, &why);
        if (status != MHE_OK) {
            const int in_ms = 500 * rate > o->band_high && rate < 50;
            (void)mhe_fail(err, status, "%s: %s%s", source, why.text,
                           in_ms ? " (are its times in ms instead of s?)" : "");
        }
    }
    if (status == MHE_OK) {
        const double delay = mhi_envelope_delay(e->envelope);
        e->shift = MHI_TAKE(&e->arena, double, e->n_channels);
        for (int32_t i = 0; i < e->n_channels && e->shift != NULL; i++) {
            const double own = o->channels[i].delay < 0 ? o->delay : o->channels[i].delay;
            e->shift[i] = fmax(0, own - delay);
            e->longest = fmax(e->longest, e->shift[i]);
            e->lag = fmax(e->lag, delay - own);
        }
        status =
            e->shift == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : take_arrays(e, err);
    }
    if (status != MHE_OK) {
        mhi_electrodes_close(e);
        return status;
    }
    for (int32_t i = 0; i < e->n_channels; i++) {
        e->scale[i] = o->channels[i].gain / mvc[i];
        e->peaks[i] = NAN;
    }
    *electrodes = e;
    return MHE_OK;
}

void mhi_electrodes_close(mhi_electrodes *e) {
    if (e != NULL) {
        mhi_envelope_free(e->envelope);
        mhi_arena_free(&e->arena);
        free(e);
    }
}

void mhi_electrodes_tell(const mhi_electrodes *e, const mhi_run *run, const char *source,
                         const mhe_host *host) {
    mhi_electrodes_tell_absent(run, source, e->column, host);
}

double mhi_electrodes_filter_delay(const mhi_electrodes *e) {
    return mhi_envelope_delay(e->envelope);
}

double mhi_electrodes_lag(const mhi_electrodes *e) {
    return e->lag;
}

void mhi_electrodes_push(mhi_electrodes *e, double time, const double *raw) {
    time += e->offset;
    if (e->n_pushed > 0) {
        const double since = time - e->times[(e->n_pushed - 1) % e->capacity];
        if (!(since > 0) && since >= -KEPT) {
            return;
        }
        const double steps = fmin(fabs(since) * e->rate + 0.5, 1e9);
        e->n_pushed = since > 0 ? e->n_pushed : 0; /* a clock that was set back: it begins anew */
        if (steps >= 2) {                          /* rows are missing */
            mhi_envelope_skip(e->envelope, (int32_t)steps - 1);
        }
    }
    const int32_t slot = (int32_t)(e->n_pushed++ % e->capacity);
    double *out = e->values + (ptrdiff_t)slot * e->n_channels;
    e->times[slot] = time;
    for (int32_t i = 0; i < e->n_channels; i++) {
        e->raw[i] = e->column[i] < 0 ? NAN : raw[e->column[i]];
    }
    mhi_envelope_step(e->envelope, e->raw, out);
    for (int32_t i = 0; i < e->n_channels; i++) {
        out[i] *= e->scale[i];
        e->peaks[i] = fmax(e->peaks[i], out[i]); /* of a number and NaN: the number */
    }
}

/* Slot of the newest sample at or before a time; -1: none that is fresh enough. */
static int32_t newest_before(const mhi_electrodes *e, double time) {
    const int64_t kept = e->n_pushed < e->capacity ? e->n_pushed : e->capacity;
    int64_t low = e->n_pushed - kept - 1, high = e->n_pushed;
    const int64_t none = low;
    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        if (e->times[middle % e->capacity] <= time + MHI_SAME_TIME) {
            low = middle;
        } else {
            high = middle;
        }
    }
    const int32_t slot = low == none ? -1 : (int32_t)(low % e->capacity);
    return slot >= 0 && time - e->times[slot] > 1.5 / e->rate + STALE ? -1 : slot;
}

/* Normalised EMG as excitation. */
static double taken(const mhi_electrodes *e, const wire *w, double value) {
    const double emg = isnan(value) ? NAN : fmin(fmax(value * w->factor, 0), e->max);
    return w->shape == 0 ? emg : expm1(w->shape * emg) / expm1(w->shape);
}

void mhi_electrodes_at(const mhi_electrodes *e, double time, double *emg) {
    for (int32_t i = 0; i < e->n_muscles; i++) {
        emg[i] = NAN;
    }
    double shift = NAN;
    int32_t slot = -1;
    for (int32_t i = 0; i < e->n_wires; i++) {
        const wire *w = &e->wires[i];
        if (shift != e->shift[w->channel]) { /* alike in most channels */
            shift = e->shift[w->channel];
            slot = newest_before(e, time - shift);
        }
        if (slot >= 0) {
            emg[w->muscle] = taken(e, w, e->values[(ptrdiff_t)slot * e->n_channels + w->channel]);
        }
    }
}

/* Samples of the ring from a time on, before another: [*first, *end). */
static void between(const mhi_electrodes *e, double from, double to, int64_t *first, int64_t *end) {
    const int64_t oldest = e->n_pushed < e->capacity ? 0 : e->n_pushed - e->capacity;
    *end = e->n_pushed;
    while (*end > oldest && e->times[(*end - 1) % e->capacity] >= to - MHI_SAME_TIME) {
        --*end;
    }
    *first = *end;
    while (*first > oldest && e->times[(*first - 1) % e->capacity] >= from - MHI_SAME_TIME) {
        --*first;
    }
}

void mhi_electrodes_mean(const mhi_electrodes *e, double time, double span, double *emg) {
    double shift = NAN;
    int64_t first = 0, end = 0;
    mhi_electrodes_at(e, time, emg);
    for (int32_t i = 0; i < e->n_wires && span > 0; i++) {
        const wire *w = &e->wires[i];
        if (shift != e->shift[w->channel]) {
            shift = e->shift[w->channel];
            between(e, time - shift, time - shift + span, &first, &end);
        }
        double sum = 0;
        int32_t n = 0;
        for (int64_t k = first; k < end; k++) {
            const ptrdiff_t slot = (ptrdiff_t)(k % e->capacity) * e->n_channels;
            const double value = taken(e, w, e->values[slot + w->channel]);
            n += !isnan(value);
            sum += isnan(value) ? 0 : value;
        }
        if (first < end) {
            emg[w->muscle] = n > 0 ? sum / n : NAN;
        }
    }
}

void mhi_electrodes_watch(const mhi_electrodes *e, const mhi_run *run, const char *source,
                          const mhe_host *host) {
    mhe_error err = {0};
    double *peaks = calloc((size_t)e->n_channels + 1, sizeof *peaks);
    for (int32_t i = 0; i < e->n_channels && peaks != NULL; i++) {
        peaks[i] = fmax(e->peaks[i], 1); /* rest so far says nothing; of a number and NaN: 1 */
    }
    if (peaks != NULL && mhi_electrodes_check_peaks(run, source, peaks, host, &err) != MHE_OK) {
        host->log(host, MHE_LOG_WARNING, err.text);
    }
    free(peaks);
}

int32_t mhi_electrodes_set_mvc(mhi_electrodes *e, const mhi_run *run, int32_t channel, double mvc) {
    if (channel < 0 || channel >= e->n_channels || e->column[channel] < 0 || !(mvc > 0) ||
        !isfinite(mvc)) {
        return 0;
    }
    const double scale = run->emg.channels[channel].gain / mvc;
    e->peaks[channel] *= scale / e->scale[channel];
    e->scale[channel] = scale;
    return 1;
}

int32_t mhi_electrodes_peak(mhi_electrodes *e, int32_t channel, int32_t reset, double *peak) {
    if (channel < 0 || channel >= e->n_channels || e->column[channel] < 0) {
        return 0;
    }
    *peak = e->peaks[channel] / e->scale[channel];
    e->peaks[channel] = reset ? NAN : e->peaks[channel];
    return 1;
}
