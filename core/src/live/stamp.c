/* SPDX-License-Identifier: Apache-2.0 */
#include "live/stamp.h"

#include <math.h>

#define BLOCK_TIME 0.25 /* s */
#define LEARNED 0.5     /* s, and ... */
#define LEARNING 50     /* samples, before the line is believed about its period and about gaps */
#define SETTLED 2.0     /* s: until then ... */
#define FASTEST 0.95    /* periods between samples: a stream that begins late catches up */
#define GAP 8.0         /* periods beyond the line, and ... */
#define GAP_TIME 0.15   /* ... s, that are no jitter any more */
#define JUMP 5.0        /* s: the clock was set, or the stream broke off */
#define CLOSEST 0.1     /* periods between two times that are handed out, and ... */
#define SQUEEZED 1e-3   /* ... where samples came at once */

void mhi_stamp_start(mhi_stamp *s, double rate) {
    *s = (mhi_stamp){.rate = rate > 0 ? rate : 0, .last = -INFINITY};
}

static void begin_line(mhi_stamp *s, double stamp) {
    s->n = 0;
    s->number = 0;
    s->at = 0;
    s->start = stamp;
    s->period = 1 / s->rate;
    s->n_blocks = 0;
    s->n_late = 0;
    s->learned = 0;
}

static double line_at(const mhi_stamp *s, double number) {
    return s->start + s->period * (number - s->at);
}

static const mhi_stamp_point *block(const mhi_stamp *s, int32_t i) { /* 0: the oldest */
    return &s->least[(s->newest + 1 + MHI_STAMP_BLOCKS - s->n_blocks + i) % MHI_STAMP_BLOCKS];
}

static double slope(const mhi_stamp_point *a, const mhi_stamp_point *b) {
    return (b->stamp - a->stamp) / (b->number - a->number);
}

/* The hull's edge over the middle of the blocks. */
static void fit(mhi_stamp *s) {
    int32_t hull[MHI_STAMP_BLOCKS], n = 0;
    for (int32_t i = 0; i < s->n_blocks; i++) { /* Andrew's monotone chain */
        while (n > 1 && slope(block(s, hull[n - 2]), block(s, hull[n - 1])) >=
                            slope(block(s, hull[n - 1]), block(s, i))) {
            n--;
        }
        hull[n++] = i;
    }
    const double first = block(s, 0)->number, span = block(s, s->n_blocks - 1)->number - first;
    if (n < 2 || span < LEARNED * s->rate || span < LEARNING) {
        return;
    }
    int32_t k = 1;
    while (k < n - 1 && block(s, hull[k])->number < first + span / 2) {
        k++;
    }
    const mhi_stamp_point *a = block(s, hull[k - 1]), *b = block(s, hull[k]);
    const double least = span < SETTLED * s->rate ? FASTEST / s->rate : 0.01 / s->rate;
    s->learned |= slope(a, b) >= least;
    s->period = fmax(slope(a, b), least);
    s->at = b->number;
    s->start = b->stamp;
}

/* Keeps the sample if it is the earliest of its block. A block that is whole is part of the line.
 */
static void keep(mhi_stamp *s, double stamp) {
    const mhi_stamp_point point = {s->number, stamp};
    mhi_stamp_point *least = &s->least[s->newest];
    if (s->n_blocks > 0 && s->number - s->block < BLOCK_TIME * s->rate) {
        if (stamp - least->stamp < s->period * (s->number - least->number)) {
            *least = point;
        }
        return;
    }
    if (s->n_blocks > 1) {
        fit(s);
    }
    s->newest = s->n_blocks == 0 ? 0 : (s->newest + 1) % MHI_STAMP_BLOCKS;
    s->n_blocks += s->n_blocks < MHI_STAMP_BLOCKS;
    s->least[s->newest] = point;
    s->block = s->number;
}

/* A sample beyond the line, which is believed: are those before it missing, or is it late? Late
 * ones wait somewhere and come at once, the first of them is the latest: if as many have come
 * since, and some, they do not catch up. 1: it is late. */
static int32_t is_late(mhi_stamp *s, double error, int32_t is_receipt) {
    const double missing = floor(error / s->period + 0.5);
    if (is_receipt && (double)++s->n_late <= missing + LEARNING) {
        return 1;
    }
    s->n_late = 0;
    s->number += missing;
    s->n_gaps += (int64_t)missing;
    return 0;
}

static void take(mhi_stamp *s, double stamp, int32_t is_receipt) {
    const double beyond = fmax(GAP / s->rate, GAP_TIME);
    const double error = s->n == 0 ? 0 : stamp - line_at(s, s->number + 1);
    if (s->n == 0 || fabs(error) > JUMP || (error < -beyond && s->learned)) {
        s->n_jumps += s->n > 0;
        begin_line(s, stamp);
        keep(s, stamp);
        return;
    }
    s->number += 1;
    if (!(error > beyond && s->learned)) {
        s->n_late = 0;
    } else if (is_late(s, error, is_receipt)) {
        return;
    }
    const double early = line_at(s, s->number) - stamp;
    s->start -= fmax(early, 0); /* until the line is fitted anew */
    keep(s, stamp);
}

double mhi_stamp_next(mhi_stamp *s, double stamp, double received, int32_t is_receipt) {
    if (!isfinite(stamp)) {
        stamp = isfinite(s->last) ? s->last + (s->rate > 0 ? 1 / s->rate : 1e-6) : 0;
    }
    if (s->rate == 0) {
        stamp = fmin(stamp, received);
        s->last = stamp > s->last ? stamp : nextafter(s->last, INFINITY);
        return s->last;
    }
    const int set_back = stamp < s->last - JUMP;
    take(s, stamp, is_receipt);
    s->n++;
    double time = line_at(s, s->number);
    if (!set_back) {
        time = fmax(time, s->last + CLOSEST / s->rate);
    }
    time = time > received ? received : time;
    if (!set_back) {
        time = fmax(time, s->last + SQUEEZED / s->rate);
    }
    s->last = time;
    return time;
}
