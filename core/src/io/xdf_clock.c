/* SPDX-License-Identifier: Apache-2.0 */
/* xdf_clock.c: a stream's stamps on the recorder's clock, and without their jitter.
 *
 * The offset of the sender's clock is a line through the measured offsets (least squares on
 * iteratively reweighted residuals, Huber 1964, doi:10.1214/aoms/1177703732: single measurements
 * are late). It begins anew where the clock was set: offsets that step by more than a second.
 * Stamps of a stream with a nominal rate lie on a line against the sample number, between gaps of
 * a second or of 500 samples. */
#include "io/xdf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define CLOCK_SET 1.0 /* s */
#define GAP_TIME 1.0  /* s */
#define GAP_SAMPLES 500.0
#define ROUNDS 20
#define QUICKEST 1e-3 /* s: residuals within this count as equals */

typedef struct line {
    double x, y, slope; /* y + slope (t - x) */
} line;

static double line_at(const line *l, double t) {
    return l->y + l->slope * (t - l->x);
}

/* Weighted least squares; weight NULL: all 1. */
static line fit(const double *x, const double *y, const double *weight, int64_t n) {
    double sum = 0, mx = 0, my = 0, xx = 0, xy = 0;
    for (int64_t i = 0; i < n; i++) {
        const double w = weight == NULL ? 1 : weight[i];
        sum += w;
        mx += w * (x[i] - x[0]);
        my += w * (y[i] - y[0]);
    }
    mx = x[0] + mx / sum;
    my = y[0] + my / sum;
    for (int64_t i = 0; i < n; i++) {
        const double w = weight == NULL ? 1 : weight[i];
        xx += w * (x[i] - mx) * (x[i] - mx);
        xy += w * (x[i] - mx) * (y[i] - my);
    }
    return (line){mx, my, xx > 0 ? xy / xx : 0};
}

static line robust_fit(const double *x, const double *y, double *weight, int64_t n) {
    line l = fit(x, y, NULL, n);
    for (int32_t round = 0; round < ROUNDS && n > 2; round++) {
        for (int64_t i = 0; i < n; i++) {
            const double off = fabs(y[i] - line_at(&l, x[i]));
            weight[i] = off <= QUICKEST ? 1 : QUICKEST / off;
        }
        l = fit(x, y, weight, n);
    }
    return l;
}

/* Last of the offsets from `first` on that belong to one run of the clock, plus one. */
static int64_t clock_run(const mhi_xdf_stream *s, int64_t first) {
    int64_t end = first + 1;
    while (end < s->n_offsets && fabs(s->offset[end] - s->offset[end - 1]) < CLOCK_SET) {
        end++;
    }
    return end;
}

/* Stamps become times of the recorder's clock. Where the clock was set, the samples between two
 * runs of offsets belong to the run whose measurements are nearest. */
static mhe_status apply_offsets(mhi_xdf_stream *s, mhe_error *err) {
    double *weight = malloc(sizeof *weight * (size_t)(s->n_offsets + 1));
    if (weight == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    int64_t k = 0;
    for (int64_t first = 0; first < s->n_offsets;) {
        const int64_t end = clock_run(s, first);
        const line l = robust_fit(s->offset_time + first, s->offset + first, weight, end - first);
        const int last = end == s->n_offsets;
        const double until =
            last ? INFINITY : 0.5 * (s->offset_time[end - 1] + s->offset_time[end]);
        for (; k < s->n_samples && (last || s->stamp[k] < until); k++) {
            s->time[k] = s->stamp[k] + line_at(&l, s->stamp[k]);
        }
        first = end;
    }
    free(weight);
    return MHE_OK;
}

/* Stamps between gaps onto a line against the sample number. */
static void smooth(mhi_xdf_stream *s) {
    const double gap = fmax(GAP_TIME, GAP_SAMPLES / s->rate);
    for (int64_t first = 0; first < s->n_samples;) {
        int64_t end = first + 1;
        while (end < s->n_samples && fabs(s->time[end] - s->time[end - 1]) < gap) {
            end++;
        }
        const int64_t n = end - first;
        double my = 0, xy = 0, xx = 0;
        const double middle = 0.5 * (double)(n - 1);
        for (int64_t i = 0; i < n; i++) {
            my += (s->time[first + i] - s->time[first]) / (double)n;
        }
        for (int64_t i = 0; i < n; i++) {
            const double x = (double)i - middle;
            xx += x * x;
            xy += x * (s->time[first + i] - s->time[first] - my);
        }
        const double slope = n > 1 ? xy / xx : 0, start = s->time[first] + my;
        for (int64_t i = 0; i < n && slope > 0; i++) {
            s->time[first + i] = start + slope * ((double)i - middle);
        }
        first = end;
    }
}

mhe_status mhi_xdf_synchronise(mhi_xdf_stream *s, mhe_error *err) {
    s->time = malloc(sizeof *s->time * ((size_t)s->n_samples + 1));
    if (s->time == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    if (s->n_samples > 0) {
        memcpy(s->time, s->stamp, sizeof *s->time * (size_t)s->n_samples);
    }
    const mhe_status status = s->n_offsets > 0 ? apply_offsets(s, err) : MHE_OK;
    if (status == MHE_OK && s->rate > 0) {
        smooth(s);
    }
    return status;
}
