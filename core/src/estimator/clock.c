/* SPDX-License-Identifier: Apache-2.0 */
/* clock.c: frames' times on the even grid of the window's nodes.
 *
 * The interval is the mean step of the first full window. From then on a frame belongs to the node
 * nearest to its time: nodes that no frame came for are put in without measurements, and the grid
 * follows the frames slowly, so that neither jitter nor a clock that drifts matters. Where more
 * than a window is missing, or the frames come faster than the interval, or their clock was set
 * back by more than a window, the window is emptied and begins anew; until it is full there is no
 * estimate, as at the start of a run. */
#include "estimator/estimator_private.h"
#include "estimator/recording.h"

#include <stdlib.h>

#define FOLLOW 0.1 /* part of a frame's distance from the grid by which the grid moves */
#define BEHIND 1.5 /* intervals: that much too early, frames must come faster than thought */
#define GAP 1.5    /* intervals: a longer step is a gap */

/* The frame's place among the nodes is not known: every ratio-th counts. */
static int32_t count_frame(mhe_estimator *e) {
    return e->n_counted++ % e->run->horizon.ratio == 0;
}

/* Nodes from the newest to this frame's; 0: it lies between nodes. */
static double nodes_on(const mhe_estimator *e, double time) {
    const double passed = (time - e->grid) / e->interval;
    const double ratio = e->run->horizon.ratio, frames = floor(passed * ratio + 0.5);
    if (ratio > 1) {
        return frames >= 1 && fmod(frames, ratio) == 0 ? frames / ratio : 0;
    }
    return fmax(frames, 1);
}

mhe_status mhi_clock_take(mhe_estimator *e, double time, int32_t *used, mhe_error *err) {
    const double span = e->n * mhi_ocp_problem(e->ocp)->interval;
    const int32_t back = isfinite(e->last_time) && time < e->last_time - span;
    *used = 0;
    if (!isfinite(time) || !(time > e->last_time || back)) {
        return mhe_fail(err, MHE_E_ARGUMENT, "frame time %g s does not follow %g s", time,
                        e->last_time);
    }
    e->last_time = time;
    const double early = e->interval > 0 ? (e->grid - time) / e->interval : 0;
    if (back || early > BEHIND || -early > e->n + 0.5) {
        if (e->interval > 0 || back) {
            mhi_window_clear(e);
        }
    }
    if (e->interval == 0) {
        *used = count_frame(e);
        return MHE_OK;
    }
    const double on = nodes_on(e, time);
    if (on == 0) {
        return MHE_OK;
    }
    for (int32_t i = 1; i < on; i++) {
        mhi_window_skip(e, e->grid + i * e->interval);
    }
    e->grid += on * e->interval;
    e->grid += FOLLOW * (time - e->grid);
    *used = 1;
    return MHE_OK;
}

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

mhe_status mhi_clock_measure(mhe_estimator *e, int32_t *known, mhe_error *err) {
    int32_t n_gaps = 0, last_gap = 0;
    for (int32_t k = 0; k < e->n; k++) {
        e->steps[k] = e->times[k + 1] - e->times[k];
    }
    qsort(e->steps, (size_t)e->n, sizeof *e->steps, by_value);
    const double median = e->steps[e->n / 2], mean = (e->times[e->n] - e->times[0]) / e->n;
    const double longest = e->run->horizon.ratio / MHI_SLOWEST;
    *known = 0;
    if (median >= longest) {
        return mhe_fail(err, MHE_E_INPUT,
                        "frames come %.6g s apart: are their times in ms instead of s?",
                        median / e->run->horizon.ratio);
    }
    for (int32_t k = 0; k < e->n; k++) {
        if (e->times[k + 1] - e->times[k] > GAP * median) {
            n_gaps++;
            last_gap = k;
        }
    }
    if (n_gaps == 1 ||
        (n_gaps > 1 && mean >= longest)) { /* several short ones: uneven times, taken as even */
        for (int32_t k = 0; k <= last_gap; k++) {
            mhi_window_advance(e);
        }
        return MHE_OK;
    }
    e->interval = mean;
    e->grid = e->times[e->n];
    mhi_ocp_set_interval(e->ocp, e->interval);
    *known = 1;
    return MHE_OK;
}
