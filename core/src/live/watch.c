/* SPDX-License-Identifier: Apache-2.0 */
#include "live/watch.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define AFTER 3.0      /* s of a stream after which it is judged */
#define OTHER_RATE 0.1 /* of what it says */
#define ESTIMATES 100  /* after which markers are judged */
#define FAR 0.1        /* m, mean of all markers and estimates: no model fits so badly */

static void tell(const mhi_inlet_setup *s, const char *text) {
    s->host->log(s->host, MHE_LOG_WARNING, text);
}

static void watch_rate(const mhi_inlet *in, const mhi_inlet_setup *setup, double seconds) {
    const double seen = (double)(in->n_samples - 1) / seconds;
    if (in->rate > 0 && fabs(seen / in->rate - 1) > OTHER_RATE) {
        char text[300];
        (void)snprintf(text, sizeof text,
                       "stream '%.150s' says that it has %.5g samples a second, and has %.5g: its "
                       "rate is another, or samples are lost",
                       in->name, in->rate, seen);
        tell(setup, text);
    }
}

void mhi_watch_stream(mhi_inlet *in, const mhi_inlet_setup *setup) {
    if (in->n_samples == 1) {
        in->began = in->newest;
    }
    const double seconds = in->newest - in->began;
    if (in->watched || !(seconds >= AFTER)) {
        return;
    }
    in->watched = 1;
    watch_rate(in, setup, seconds);
    if (in->is_raw) {
        mhi_electrodes_watch(in->electrodes, setup->run, in->name, setup->host);
    }
}

static const double *measured_markers(const mhi_inlet_setup *s, const mhe_estimate *e) {
    for (int32_t i = 0; i < e->n_tracked; i++) {
        const mhe_tracked *t = mhe_tracked_at(e, i);
        if (t->channel >= 0 && t->channel < s->info->n_channels &&
            strcmp(mhe_channel_at(s->info, t->channel)->name, "markers") == 0) {
            return t->measured;
        }
    }
    return NULL;
}

void mhi_watch_markers(const mhi_inlet_setup *s, const char *stream, const mhe_estimate *e,
                       mhi_watch *w) {
    const double *measured = w->n_estimates >= ESTIMATES ? NULL : measured_markers(s, e);
    if (measured == NULL || e->markers == NULL) {
        return;
    }
    for (int32_t i = 0; i < s->info->n_markers; i++) {
        const double *a = measured + 3 * (ptrdiff_t)i, *b = e->markers + 3 * (ptrdiff_t)i;
        const double off = hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
        w->sum += isfinite(off) ? off : 0;
        w->n += isfinite(off);
    }
    if (++w->n_estimates == ESTIMATES && w->n > 0 && w->sum / (double)w->n > FAR) {
        char text[300];
        (void)snprintf(text, sizeof text,
                       "stream '%.120s': its markers stay %.2g m from the model's: is their unit "
                       "right, and is this the model of that person?",
                       stream, w->sum / (double)w->n);
        tell(s, text);
    }
}
