/* SPDX-License-Identifier: Apache-2.0 */
/* late.c: measurements that come on their own, to the nodes of their time.
 *
 * A sample is kept by its time. Before each solve the nodes that newer samples may concern are
 * looked at again: those between the sample before the earliest of them and the one after the last.
 * What a frame itself brought stays; the rest is what the samples say by the channel's rule. */
#include "base/need.h"
#include "estimator/estimator_private.h"

#include <string.h>

/* What the samples say of node k; 1: another than before. Entries of the frame stay. */
static int32_t look(mhi_channel *c, double time, int32_t k) {
    const ptrdiff_t at = (ptrdiff_t)k * c->face.width;
    int32_t news = 0;
    mhi_samples_at(&c->samples, c->face.gap_rule, c->face.gap, c->span, time - c->face.delay,
                   c->found);
    for (int32_t i = 0; i < c->face.width; i++) {
        double *measured = &c->measured[at + i];
        if (!c->late[at + i] || isnan(c->found[i]) || c->found[i] == *measured) {
            continue; /* also what was found before the samples of that time left the ring */
        }
        *measured = c->believed[at + i] = c->found[i];
        c->why[at + i] = MHE_TRACK_USED;
        news = 1;
    }
    return news;
}

void mhi_channels_look(mhi_channels *channels, const double *times, int32_t filled, int32_t solved,
                       mhi_late_changed *changed, void *data) {
    for (int32_t i = 0; i < channels->n; i++) {
        mhi_channel *c = &channels->rows[i];
        for (int32_t k = 0; k < filled && c->samples.n > 0; k++) {
            const int32_t newest = k == filled - 1; /* nobody looked for it yet */
            if (!newest && times[k] + c->span - c->face.delay < c->samples.changed) {
                continue;
            }
            const int32_t empty =
                !mhi_channel_any(c->measured + (ptrdiff_t)k * c->face.width, c->face.width);
            if (look(c, times[k], k)) {
                c->counts.n_late_nodes += solved && empty && !newest;
                changed(data, c, k);
            }
        }
        c->samples.changed = INFINITY;
    }
}

mhe_status mhe_estimator_measure(mhe_estimator *e, int32_t channel, double time,
                                 const double *values, mhe_error *err) {
    if (MHI_NEED(err, {"estimator", e}, {"values", values}) != MHE_OK) {
        return MHE_E_ARGUMENT;
    }
    if (channel < 0 || channel >= e->channels.n) {
        return mhe_fail(err, MHE_E_ARGUMENT,
                        "mhe_estimator_measure: there is no channel %d; there are %d", (int)channel,
                        (int)e->channels.n);
    }
    if (!isfinite(time)) {
        return mhe_fail(err, MHE_E_ARGUMENT, "mhe_estimator_measure: the time is not finite");
    }
    mhi_channel *c = &e->channels.rows[channel];
    const int32_t known = e->clock.interval > 0 && e->window.filled > 0;
    if (known && time + c->face.delay + c->face.gap < e->window.times[0]) {
        c->counts.n_dropped++;
        return MHE_OK;
    }
    const mhe_status status = mhi_samples_put(&c->samples, time, values, err);
    c->counts.n_alone += status == MHE_OK;
    e->begin.has_posture |= c->posture;
    return status;
}
