/* SPDX-License-Identifier: Apache-2.0 */
#include "live/clocks.h"

#include <math.h>

#define FORGET 1e-6   /* s a sample by which the guess of a clock gives way: it may drift */
#define SET_BACK 0.5  /* s: packets that overtake each other step back less */
#define SET_AHEAD 2.0 /* s beyond the time that has passed: a packet before was not so late */
#define MOST_SET 4    /* packets in a row: no clock is set so often */

void mhi_clock_start(mhi_clock *c) {
    *c = (mhi_clock){.guess = INFINITY, .received = NAN};
}

/* What to add to stamps. Where it was never measured: samples are never early, so the least delay
 * seen is taken for none. */
static double offset_of(mhi_clock *c, const mhi_packet *p) {
    if (isfinite(p->offset)) {
        return p->offset;
    }
    const double least = p->received - p->stamp[p->n - 1];
    c->guess = isfinite(c->guess) && fabs(least - c->guess) < 5
                   ? fmin(c->guess + FORGET * p->n, least)
                   : least;
    return c->guess;
}

void mhi_clock_begin(mhi_clock *c, const mhi_packet *p, double rate, mhi_clock_packet *work) {
    *work = (mhi_clock_packet){.packet = p,
                               .passed = p->received - c->received,
                               .from = c->time,
                               .period = rate > 0 ? 1 / rate : 0};
    work->offset = p->stamp == NULL || c->unused ? 0 : offset_of(c, p);
}

/* A sender's clock that is set while it runs, between packets or within one: its samples go on as
 * they arrive. Packets that come late, or all at once after a pause, have stamps that go on by
 * themselves. */
double mhi_clock_time(mhi_clock *c, mhi_clock_packet *work, int32_t k, double *set) {
    const mhi_packet *p = work->packet;
    *set = 0;
    if (p->stamp == NULL || c->unused) {
        return p->received - (p->n - 1 - k) * work->period;
    }
    const double time = p->stamp[k] + work->offset, step = time - c->time;
    const double expected = k == 0 ? work->passed : work->period;
    if (isfinite(step) && isfinite(work->passed) &&
        (step < -SET_BACK || time - work->from > work->passed + SET_AHEAD)) {
        const double by = step - expected;
        *set = work->set ? 0 : by;
        c->shift -= by;
        work->from += by;
        work->set = 1;
    }
    c->time = time;
    return time + c->shift;
}

int32_t mhi_clock_end(mhi_clock *c, const mhi_clock_packet *work) {
    c->received = work->packet->received;
    c->n_set = work->set ? c->n_set + 1 : 0;
    if (c->n_set < MOST_SET || c->unused) {
        return 0;
    }
    c->unused = 1;
    return 1;
}
