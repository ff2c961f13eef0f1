/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/samples.h"

#include <math.h>
#include <mhe/estimator.h>
#include <stdlib.h>
#include <string.h>

#define CAPACITY 4096  /* 2 s of EMG: more than any window and delay */
#define SAME_TIME 5e-7 /* s: as for recordings (columns.c) */

void mhi_samples_free(mhi_samples *s) {
    free(s->time);
    free(s->values);
    *s = (mhi_samples){.width = s->width, .changed = INFINITY};
}

void mhi_samples_clear(mhi_samples *s) {
    s->n = s->first = 0;
    s->changed = INFINITY;
}

static int32_t place(const mhi_samples *s, int32_t i) {
    return (s->first + i) % s->capacity;
}

static double time_of(const mhi_samples *s, int32_t i) {
    return s->time[place(s, i)];
}

static const double *row(const mhi_samples *s, int32_t i) {
    return s->values + (ptrdiff_t)place(s, i) * s->width;
}

static void set(mhi_samples *s, int32_t i, double time, const double *values) {
    const int32_t at = place(s, i);
    s->time[at] = time;
    memcpy(s->values + (ptrdiff_t)at * s->width, values, sizeof(double) * (size_t)s->width);
}

/* The last sample at or before a time, -1: none. */
static int32_t last_before(const mhi_samples *s, double time) {
    int32_t low = -1, high = s->n;
    while (high - low > 1) {
        const int32_t middle = low + (high - low) / 2;
        if (time_of(s, middle) <= time + SAME_TIME) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

static mhe_status take_ring(mhi_samples *s, mhe_error *err) {
    s->time = malloc(sizeof(double) * CAPACITY);
    s->values = malloc(sizeof(double) * CAPACITY * (size_t)(s->width + 1));
    if (s->time == NULL || s->values == NULL) {
        mhi_samples_free(s);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->capacity = CAPACITY;
    mhi_samples_clear(s);
    return MHE_OK;
}

mhe_status mhi_samples_put(mhi_samples *s, double time, const double *values, mhe_error *err) {
    const mhe_status status = s->capacity == 0 ? take_ring(s, err) : MHE_OK;
    if (status != MHE_OK) {
        return status;
    }
    int32_t before = last_before(s, time);
    const int32_t same = before >= 0 && fabs(time_of(s, before) - time) <= SAME_TIME;
    if (!same && s->n == s->capacity) {
        if (before < 0) {
            return MHE_OK;
        }
        s->first = place(s, 1);
        s->n--;
        before--;
    }
    const int32_t at = same ? before : before + 1;
    for (int32_t i = s->n; i > at && !same; i--) { /* few came out of order, if any */
        set(s, i, time_of(s, i - 1), row(s, i - 1));
    }
    s->n += !same;
    set(s, at, time, values);
    s->changed = fmin(s->changed, at == 0 ? -INFINITY : time_of(s, at - 1));
    return MHE_OK;
}

/* Between sample i and the next one, which lie `step` apart. */
static void between(const mhi_samples *s, int32_t i, double since, double step, double *values) {
    const double *from = row(s, i), *to = row(s, i + 1);
    for (int32_t j = 0; j < s->width; j++) {
        values[j] = from[j] + (to[j] - from[j]) * since / step;
    }
}

/* Mean of the samples from a time on, `span` s long; entries without any stay NaN. 0: no sample. */
static int32_t mean(const mhi_samples *s, double span, double time, double *values) {
    int32_t first = last_before(s, time), n = 0;
    first = first >= 0 && fabs(time_of(s, first) - time) <= SAME_TIME ? first : first + 1;
    const int32_t end = last_before(s, time + span - 2 * SAME_TIME) + 1;
    for (int32_t j = 0; j < s->width; j++) {
        double sum = 0;
        n = 0;
        for (int32_t i = first; i < end; i++) {
            const double value = row(s, i)[j];
            n += !isnan(value);
            sum += isnan(value) ? 0 : value;
        }
        values[j] = n > 0 ? sum / n : NAN;
    }
    return first < end;
}

void mhi_samples_at(const mhi_samples *s, int32_t rule, double gap, double span, double time,
                    double *values) {
    if (rule == MHE_GAP_MEAN && mean(s, span, time, values)) {
        return;
    }
    const int32_t i = last_before(s, time), next = i + 1 < s->n;
    const double since = i < 0 ? INFINITY : time - time_of(s, i);
    const double until = next ? time_of(s, i + 1) - time : INFINITY;
    int32_t found = -1;
    if (i >= 0 && fabs(since) <= SAME_TIME) {
        found = i;
    } else if (rule == MHE_GAP_LINEAR) {
        if (since + until <= gap + SAME_TIME) {
            between(s, i, since, since + until, values);
            return;
        }
    } else if (rule == MHE_GAP_HOLD || rule == MHE_GAP_MEAN) {
        found = since <= gap + SAME_TIME ? i : -1;
    } else if (fmin(since, until) <= gap + SAME_TIME) {
        found = since <= until ? i : i + 1;
    }
    for (int32_t j = 0; j < s->width; j++) {
        values[j] = found < 0 ? NAN : row(s, found)[j];
    }
}
