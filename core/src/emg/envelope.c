/* SPDX-License-Identifier: Apache-2.0 */
#include "emg/envelope.h"

#include "base/arena.h"
#include "emg/filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HOLD 0.01   /* s that the last value stands in for missing ones */
#define FLAT 0.5    /* s of one and the same number: no muscle does that */
#define SETTLING 3. /* group delays until a step is answered to a few percent */

typedef struct channel {
    double band[2 * MHI_FILTER_SECTIONS_MAX], low[2 * MHI_FILTER_SECTIONS_MAX];
    double *ring;      /* [window] */
    double sum, fresh; /* of the ring; of what was put into it since it last began anew */
    int32_t at, n;     /* place in the ring; samples since the start, until settled */
    int32_t missing, same;
    double last_raw, last;
} channel;

struct mhi_envelope {
    int32_t process, kind, n_channels;
    mhi_filter band, low;
    int32_t window;               /* samples, of average and RMS */
    int32_t hold, flat, settling; /* samples */
    double delay, rate;           /* s, Hz */
    channel *channels;
    mhi_arena arena;
};

static mhe_status design(const mhi_emg_section *o, double rate, mhi_filter *band, mhi_filter *low,
                         mhe_error *err) {
    mhe_error why = {0};
    mhe_status status =
        mhi_filter_band_pass(o->band_order, o->band_low, o->band_high, rate, band, &why);
    if (status == MHE_OK && o->envelope == MHI_EMG_LOW_PASS) {
        status = mhi_filter_low_pass(o->low_pass_order, o->low_pass, rate, low, &why);
    }
    return status == MHE_OK ? MHE_OK : mhe_fail(err, MHE_E_INPUT, "%s", why.text);
}

static int32_t window_samples(const mhi_emg_section *o, double rate) {
    const double n = floor(o->window * rate + 0.5);
    return n < 1 ? 1 : n > 1e7 ? 10000000 : (int32_t)n;
}

static int32_t is_windowed(int32_t kind) {
    return kind == MHI_EMG_AVERAGE || kind == MHI_EMG_RMS;
}

/* Delay and settling of what is designed, in samples. */
static void set_delay(mhi_envelope *e, const mhi_emg_section *o) {
    double band = 0, smooth = 0;
    if (e->band.n > 0) {
        const double centre = mhi_filter_band_centre(o->band_low, o->band_high, e->rate);
        band = mhi_filter_delay(&e->band, centre, e->rate);
    }
    if (e->low.n > 0) {
        smooth = mhi_filter_delay(&e->low, 0, e->rate);
    } else if (is_windowed(e->kind)) {
        smooth = (e->window - 1) / 2.0;
    }
    e->delay = (band + smooth) / e->rate;
    e->settling = (int32_t)ceil(SETTLING * band + (e->low.n > 0 ? SETTLING : 2) * smooth);
}

mhe_status mhi_envelope_create(const mhi_emg_section *o, int32_t n_channels, double rate,
                               mhi_envelope **envelope, mhe_error *err) {
    *envelope = NULL;
    mhi_envelope *e = calloc(1, sizeof *e);
    if (e == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    e->process = o->process;
    e->kind = o->envelope;
    e->n_channels = n_channels;
    e->rate = rate;
    e->hold = (int32_t)(HOLD * rate);
    e->flat = (int32_t)ceil(FLAT * rate);
    e->window = e->process && is_windowed(e->kind) ? window_samples(o, rate) : 1;
    mhe_status status = e->process ? design(o, rate, &e->band, &e->low, err) : MHE_OK;
    if (status == MHE_OK && e->process) {
        set_delay(e, o);
    }
    e->channels = MHI_TAKE(&e->arena, channel, n_channels);
    double *rings = MHI_TAKE(&e->arena, double, (int64_t)n_channels * e->window);
    if (status == MHE_OK && (e->channels == NULL || rings == NULL)) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (status != MHE_OK) {
        mhi_envelope_free(e);
        return status;
    }
    for (int32_t i = 0; i < n_channels; i++) {
        e->channels[i].ring = rings + (ptrdiff_t)i * e->window;
        e->channels[i].last_raw = NAN;
        e->channels[i].last = NAN;
    }
    *envelope = e;
    return MHE_OK;
}

void mhi_envelope_free(mhi_envelope *e) {
    if (e != NULL) {
        mhi_arena_free(&e->arena);
        free(e);
    }
}

double mhi_envelope_delay(const mhi_envelope *e) {
    return e->delay;
}

double mhi_envelope_settling(const mhi_envelope *e) {
    return e->settling / e->rate;
}

static void restart(const mhi_envelope *e, channel *c) {
    memset(c->band, 0, sizeof c->band);
    memset(c->low, 0, sizeof c->low);
    memset(c->ring, 0, sizeof *c->ring * (size_t)e->window);
    c->sum = c->fresh = 0;
    c->at = c->n = 0;
}

/* Sum of the last `window` values. Each round begins with a sum of its own, so that rounding errors
 * do not pile up. */
static double window_sum(const mhi_envelope *e, channel *c, double value) {
    c->sum += value - c->ring[c->at];
    c->fresh += value;
    c->ring[c->at++] = value;
    if (c->at == e->window) {
        c->at = 0;
        c->sum = c->fresh;
        c->fresh = 0;
    }
    return c->sum;
}

static double smooth(const mhi_envelope *e, channel *c, double x) {
    switch (e->kind) {
    case MHI_EMG_LOW_PASS:
        return mhi_filter_step(&e->low, c->low, x);
    case MHI_EMG_AVERAGE:
        return window_sum(e, c, x) / e->window;
    case MHI_EMG_RMS:
        return sqrt(fmax(0, window_sum(e, c, x * x) / e->window));
    default:
        return x;
    }
}

static void skip(const mhi_envelope *e, channel *c, int32_t n) {
    c->missing = n < INT32_MAX - c->missing ? c->missing + n : INT32_MAX;
    if (c->missing > e->hold) {
        restart(e, c);
        c->last = NAN;
    }
}

static double step(const mhi_envelope *e, channel *c, double raw) {
    if (!e->process) {
        return raw;
    }
    if (!isfinite(raw)) {
        skip(e, c, 1);
        return c->last;
    }
    c->same = raw == c->last_raw ? c->same + (c->same < e->flat) : 0;
    c->last_raw = raw;
    if (c->same >= e->flat) {
        skip(e, c, e->hold + 1);
        return c->last;
    }
    c->missing = 0;
    const double value = smooth(e, c, fabs(mhi_filter_step(&e->band, c->band, raw)));
    if (c->n < e->settling) {
        c->n++;
        return NAN;
    }
    c->last = value;
    return value;
}

void mhi_envelope_step(mhi_envelope *e, const double *raw, double *out) {
    for (int32_t i = 0; i < e->n_channels; i++) {
        out[i] = step(e, &e->channels[i], raw[i]);
    }
}

void mhi_envelope_skip(mhi_envelope *e, int32_t n) {
    for (int32_t i = 0; i < e->n_channels && e->process; i++) {
        skip(e, &e->channels[i], n);
    }
}

/* ---- whole signals ---- */

/* Mean (of squares) of a window around each sample, cut off at the ends. */
static mhe_status centred_window(int32_t kind, int32_t window, double *signal, int32_t n,
                                 mhe_error *err) {
    double *sums = malloc(sizeof(double) * ((size_t)n + 1)); /* of all before */
    if (sums == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    sums[0] = 0;
    for (int32_t i = 0; i < n; i++) {
        sums[i + 1] = sums[i] + (kind == MHI_EMG_RMS ? signal[i] * signal[i] : signal[i]);
    }
    for (int32_t i = 0; i < n; i++) {
        const int32_t first = i - window / 2 < 0 ? 0 : i - window / 2;
        const int32_t end = n - i < window - window / 2 ? n : i + window - window / 2;
        const double mean = (sums[end] - sums[first]) / (end - first);
        signal[i] = kind == MHI_EMG_RMS ? sqrt(fmax(0, mean)) : mean;
    }
    free(sums);
    return MHE_OK;
}

static mhe_status stretch(const mhi_emg_section *o, double rate, const mhi_filter *band,
                          const mhi_filter *low, double *signal, int32_t n, mhe_error *err) {
    const int32_t a = mhi_filter_both_ways_least(band), b = mhi_filter_both_ways_least(low);
    if (n <= (a > b ? a : b)) {
        for (int32_t i = 0; i < n; i++) {
            signal[i] = NAN;
        }
        return MHE_OK;
    }
    mhe_status status = mhi_filter_both_ways(band, signal, n, err);
    for (int32_t i = 0; i < n; i++) {
        signal[i] = fabs(signal[i]);
    }
    if (status == MHE_OK && is_windowed(o->envelope)) {
        return centred_window(o->envelope, window_samples(o, rate), signal, n, err);
    }
    return status == MHE_OK ? mhi_filter_both_ways(low, signal, n, err) : status;
}

/* Short gaps are filled with the value before, flat stretches become gaps. */
static void mend(double *signal, int32_t n, int32_t hold, int32_t flat) {
    for (int32_t i = 0, end; i < n; i = end) {
        for (end = i + 1; end < n && signal[end] == signal[i]; end++) {
        }
        for (int32_t k = i; k < end && end - i > flat; k++) {
            signal[k] = NAN;
        }
    }
    for (int32_t i = 0, end; i < n; i = end) {
        for (end = i; end < n && !isfinite(signal[end]); end++) {
        }
        const double fill = end - i <= hold && i > 0 && end < n ? signal[i - 1] : NAN;
        for (int32_t k = i; k < end; k++) {
            signal[k] = fill;
        }
        end += end == i;
    }
}

mhe_status mhi_envelope_zero_phase(const mhi_emg_section *o, double rate, double *signal, int32_t n,
                                   mhe_error *err) {
    mhi_filter band = {0}, low = {0};
    mhe_status status = design(o, rate, &band, &low, err);
    mend(signal, n, (int32_t)(HOLD * rate), (int32_t)ceil(FLAT * rate));
    for (int32_t i = 0, end; i < n && status == MHE_OK; i = end) {
        for (end = i; end < n && !isnan(signal[end]); end++) {
        }
        if (end > i) {
            status = stretch(o, rate, &band, &low, signal + i, end - i, err);
        }
        end += end == i;
    }
    return status;
}
