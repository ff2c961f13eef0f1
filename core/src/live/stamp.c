/* SPDX-License-Identifier: Apache-2.0 */
#include "live/stamp.h"

#include <math.h>

#define HALF_LIFE 30.0 /* s after which a stamp counts half */
#define GAP 8.0        /* periods beyond the line, and ... */
#define GAP_TIME 0.15  /* ... s, that are no jitter any more */
#define JUMP 5.0       /* s: the clock was set, or the stream broke off */
#define LEARNING 50    /* samples before the line is believed about gaps */

void mhi_stamp_start(mhi_stamp *s, double rate) {
    *s = (mhi_stamp){.rate = rate > 0 ? rate : 0, .last = -INFINITY};
}

static void begin_line(mhi_stamp *s, double stamp) {
    s->n = 0;
    s->number = 0;
    s->start = stamp;
    s->offset = 0;
    s->period = 1 / s->rate;
    /* the first stamp may be late by tens of periods, the nominal rate wrong by a percent */
    s->p00 = 1e4;
    s->p01 = 0;
    s->p11 = 1e-4;
}

static double line_at(const mhi_stamp *s, double number) {
    return s->start + s->offset + s->period * number;
}

/* One step of recursive least squares with forgetting. The variance of a stamp is the unit of the
 * covariances. */
static void follow(mhi_stamp *s, double error) {
    const double keep = pow(0.5, 1 / (HALF_LIFE * s->rate)), x = s->number;
    const double g0 = s->p00 + s->p01 * x, g1 = s->p01 + s->p11 * x;
    const double gain = 1 / (keep + g0 + g1 * x);
    s->offset += g0 * gain * error;
    s->period += g1 * gain * error;
    s->p00 = (s->p00 - g0 * g0 * gain) / keep;
    s->p01 = (s->p01 - g0 * g1 * gain) / keep;
    s->p11 = (s->p11 - g1 * g1 * gain) / keep;
}

/* Numbers are counted from the newest sample on, so that they stay small however long it runs. */
static void shift_origin(mhi_stamp *s) {
    const double n = s->number;
    s->start = line_at(s, n);
    s->offset = 0;
    s->p00 += n * (2 * s->p01 + n * s->p11);
    s->p01 += n * s->p11;
    s->number = 0;
}

double mhi_stamp_next(mhi_stamp *s, double stamp) {
    if (!isfinite(stamp)) {
        stamp = isfinite(s->last) ? s->last + (s->rate > 0 ? 1 / s->rate : 1e-6) : 0;
    }
    if (s->rate == 0) {
        s->last = stamp > s->last ? stamp : nextafter(s->last, INFINITY);
        return s->last;
    }
    const double expected = s->n == 0 ? stamp : line_at(s, s->number + 1);
    double error = stamp - expected;
    const double beyond = fmax(GAP / s->rate, GAP_TIME);
    if (s->n == 0 || fabs(error) > JUMP || (error < -beyond && s->n > LEARNING)) {
        s->n_jumps += s->n > 0;
        begin_line(s, stamp);
        error = 0;
    } else {
        s->number += 1;
        if (error > beyond && s->n > LEARNING) {
            const double missing = floor(error / s->period + 0.5);
            s->number += missing;
            s->n_gaps += (int64_t)missing;
            error = stamp - line_at(s, s->number);
        }
        follow(s, error);
    }
    s->n++;
    if (s->number > 1e4) {
        shift_origin(s);
    }
    const double time = line_at(s, s->number);
    const double least = s->last + 0.1 / s->rate;
    const int set_back = stamp < s->last - JUMP;
    s->last = set_back || time > least ? time : least;
    return s->last;
}
