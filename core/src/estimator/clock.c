/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/clock.h"

#include "base/values.h"
#include "estimator/recording.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

#define FOLLOW 0.1 /* part of a frame's distance from the grid by which the grid moves */
#define BEHIND 1.5 /* intervals: that much too early, frames must come faster than thought */
#define GAP 1.5    /* intervals: a longer step is a gap */

mhe_status mhi_frame_clock_create(mhi_frame_clock *c, int32_t n, int32_t ratio, double interval,
                                  mhi_arena *arena, mhe_error *err) {
    *c = (mhi_frame_clock){.n = n,
                           .ratio = ratio,
                           .last_time = -INFINITY,
                           .span = n * interval,
                           .steps = MHI_TAKE(arena, double, n)};
    return c->steps == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

/* The frame's place among the nodes is not known: every ratio-th counts. */
static int32_t count_frame(mhi_frame_clock *c) {
    return c->n_counted++ % c->ratio == 0;
}

/* Nodes from the newest to this frame's; 0: it lies between nodes. */
static double nodes_on(const mhi_frame_clock *c, double time) {
    const double passed = (time - c->grid) / c->interval;
    const double ratio = c->ratio, frames = floor(passed * ratio + 0.5);
    if (ratio > 1) {
        return frames >= 1 && fmod(frames, ratio) == 0 ? frames / ratio : 0;
    }
    return fmax(frames, 1);
}

void mhi_frame_clock_forget(mhi_frame_clock *c) {
    c->n_counted = 0;
    c->interval = 0;
}

mhe_status mhi_frame_clock_take(mhi_frame_clock *c, double time, mhi_tick *tick, mhe_error *err) {
    *tick = (mhi_tick){.set_back = isfinite(c->last_time) && time < c->last_time - c->span};
    if (!isfinite(time) || !(time > c->last_time || tick->set_back)) {
        return mhe_fail(err, MHE_E_ARGUMENT, "frame time %g s does not follow %g s", time,
                        c->last_time);
    }
    c->last_time = time;
    const double early = c->interval > 0 ? (c->grid - time) / c->interval : 0;
    tick->emptied = tick->set_back || (c->interval > 0 && (early > BEHIND || -early > c->n + 0.5));
    if (tick->emptied) {
        mhi_frame_clock_forget(c);
    }
    if (c->interval == 0) {
        tick->used = count_frame(c);
        return MHE_OK;
    }
    const double on = nodes_on(c, time);
    if (on == 0) {
        return MHE_OK;
    }
    tick->before = c->grid;
    tick->missing = (int32_t)on - 1;
    c->grid += on * c->interval;
    c->grid += FOLLOW * (time - c->grid);
    tick->used = 1;
    return MHE_OK;
}

mhe_status mhi_frame_clock_measure(mhi_frame_clock *c, const double *times, int32_t *gap,
                                   mhe_error *err) {
    int32_t n_gaps = 0, last_gap = 0;
    for (int32_t k = 0; k < c->n; k++) {
        c->steps[k] = times[k + 1] - times[k];
    }
    mhi_sort(c->steps, c->n);
    const double median = c->steps[c->n / 2], mean = (times[c->n] - times[0]) / c->n;
    const double longest = c->ratio / MHI_SLOWEST;
    *gap = 0;
    if (median >= longest) {
        return mhe_fail(err, MHE_E_INPUT,
                        "frames come %.6g s apart: are their times in ms instead of s?",
                        median / c->ratio);
    }
    for (int32_t k = 0; k < c->n; k++) {
        if (times[k + 1] - times[k] > GAP * median) {
            n_gaps++;
            last_gap = k;
        }
    }
    if (n_gaps == 1 ||
        (n_gaps > 1 && mean >= longest)) { /* several short ones: uneven times, taken as even */
        *gap = last_gap + 1;
        return MHE_OK;
    }
    c->interval = mean;
    c->span = c->n * mean;
    c->grid = times[c->n];
    return MHE_OK;
}
