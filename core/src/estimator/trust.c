/* SPDX-License-Identifier: Apache-2.0 */
/* trust.c: which measurements are believed, and when a window is given up.
 *
 * A marker further than `data.marker_outlier` (plus how far the markers are anyway) from where the
 * model expects it is left out of the solves. A frame most of whose markers are so is implausible.
 * LOST_FRAMES of them in a row are not the measurements' fault: the window has lost the motion. So
 * it has after a whole window of failed solves. It then begins again from what was measured, as the
 * first one did. A window that has not settled yet believes all markers, but is given up, too.
 *
 * An amplifier that saturates or fails sets many channels at once to the ends of their range and
 * keeps them there. Muscles do not, so such EMG is no measurement, after `data.emg_saturation`
 * frames of it (those before are taken out of the window then). One muscle at its largest, or some
 * at rest, are plausible: a channel alone is always believed. Believed rails do not only spoil the
 * windows that hold them: the activations that they lead to decay with the muscles' own time
 * constant, which is longer than a short window. */
#include "estimator/estimator_private.h"

#include <string.h>

#define LOST_FRAMES 3
#define FEW_CHANNELS 3 /* fewer than these may be at their ends by chance */

double mhi_rms_distance(const double *a, const double *b, int32_t n, int32_t per_point) {
    double squares = 0;
    int32_t count = 0;
    for (int32_t i = 0; i < n; i++) {
        const double d = a[i] - b[i];
        squares += isnan(d) ? 0 : d * d;
        count += !isnan(d);
    }
    return count == 0 ? NAN : sqrt(per_point * squares / count);
}

mhe_status mhi_trust_create(mhi_trust *t, int32_t n_k, const mhi_run *run, mhi_arena *arena,
                            mhe_error *err) {
    *t = (mhi_trust){.outlier = run->data.marker_outlier,
                     .saturation = run->data.emg_saturation,
                     .expected = MHI_TAKE(arena, double, 3 * n_k),
                     .elsewhere = MHI_TAKE(arena, double, 3 * n_k)};
    return t->expected == NULL || t->elsewhere == NULL
               ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
               : MHE_OK;
}

void mhi_trust_clear(mhi_trust *t) {
    t->implausible = t->predicted = t->railed = 0;
}

/* Markers of the solution at node k; NaN where the model has none there. */
static void expect(mhe_estimator *e, int32_t k, double *markers) {
    if (mhi_system_markers(mhi_ocp_context(e->ocp), mhi_row(e->window.solution.x, k, e->window.n_x),
                           markers, NULL, NULL) != MHE_OK) {
        for (int32_t i = 0; i < 3 * e->n_k; i++) {
            markers[i] = NAN;
        }
    }
}

void mhi_trust_expect(mhe_estimator *e) {
    if (e->trust.outlier > 0) {
        expect(e, e->window.n, e->trust.expected);
    }
}

void mhi_trust_leave_out(mhi_channel *c, int32_t k, int32_t first, int32_t n, int32_t why) {
    const ptrdiff_t at = (ptrdiff_t)k * c->face.width + first;
    for (ptrdiff_t i = at; i < at + n; i++) {
        c->believed[i] = NAN;
        c->why[i] = isnan(c->measured[i]) ? MHE_TRACK_MISSING : why;
    }
}

/* Points of node k that are not where they are expected; of a window that has settled they are left
 * out. */
static void screen(mhe_estimator *e, mhi_channel *c, int32_t k, const double *expected,
                   int32_t *n_seen, int32_t *n_off) {
    const double *seen = mhi_row(c->believed, k, c->face.width);
    for (int32_t i = 0; i < c->face.n_labels; i++) {
        const double far = mhi_rms_distance(seen + 3 * i, expected + 3 * i, 3, 3);
        const int32_t off = far > e->trust.outlier + e->trust.fit;
        *n_seen += !isnan(far);
        *n_off += off;
        if (off && mhi_phase_settled(e)) {
            mhi_trust_leave_out(c, k, 3 * i, 3, MHE_TRACK_FAR);
        }
    }
}

void mhi_trust_screen(mhe_estimator *e) {
    int32_t n_seen = 0, n_off = 0;
    for (int32_t i = 0; i < e->channels.n && e->trust.outlier > 0; i++) {
        mhi_channel *c = &e->channels.rows[i];
        if (c->trust == MHI_TRUST_POSITION) {
            screen(e, c, e->window.n, e->trust.expected, &n_seen, &n_off);
        }
    }
    if (n_seen > 0) {
        e->trust.implausible = 2 * n_off > n_seen ? e->trust.implausible + 1 : 0;
    }
}

static int32_t is_rail(double emg) {
    return emg >= 1 || emg == 0;
}

static int32_t at_rails(const double *emg, int32_t n) {
    int32_t n_measured = 0, n_low = 0, n_high = 0;
    for (int32_t i = 0; i < n; i++) {
        n_measured += !isnan(emg[i]);
        n_low += emg[i] == 0;
        n_high += emg[i] >= 1;
    }
    return n_measured >= FEW_CHANNELS && (n_low + n_high == n_measured || 2 * n_high > n_measured);
}

void mhi_trust_count(mhi_trust *t, const mhi_channel *c, const double *values) {
    if (c->trust != MHI_TRUST_RAILS) {
        return;
    }
    const int32_t railed = t->saturation > 0 && at_rails(values, c->face.width);
    t->railed = !railed ? 0 : t->railed < t->saturation ? t->railed + 1 : t->railed;
}

static void drop_rails(mhi_channel *c, int32_t k) {
    const double *emg = mhi_row(c->believed, k, c->face.width);
    for (int32_t i = 0; i < c->face.width; i++) {
        if (is_rail(emg[i])) {
            mhi_trust_leave_out(c, k, i, 1, MHE_TRACK_SATURATED);
        }
    }
}

void mhi_trust_drop(const mhi_trust *t, mhi_channel *c, int32_t k) {
    if (c->trust != MHI_TRUST_RAILS || t->railed == 0 || t->railed < t->saturation) {
        return;
    }
    for (; k >= 0; k--) { /* what was dropped before is no longer at the rails */
        if (!at_rails(mhi_row(c->believed, k, c->face.width), c->face.width)) {
            return;
        }
        drop_rails(c, k);
    }
}

/* Late EMG at the rails at node k and so many nodes before it. */
static void drop_late(const mhe_estimator *e, mhi_channel *c, int32_t k) {
    int32_t first = k + 1;
    while (first > 0 && at_rails(mhi_row(c->measured, first - 1, c->face.width), c->face.width)) {
        first--;
    }
    if (e->trust.saturation == 0 || (k + 1 - first) * e->run->horizon.ratio < e->trust.saturation) {
        return;
    }
    for (; k >= first; k--) {
        drop_rails(c, k);
    }
}

void mhi_trust_late(void *estimator, mhi_channel *c, int32_t k) {
    mhe_estimator *e = estimator;
    int32_t n_seen = 0, n_off = 0;
    if (c->trust == MHI_TRUST_RAILS) {
        drop_late(e, c, k);
    } else if (c->trust == MHI_TRUST_POSITION && e->trust.outlier > 0 && mhi_phase_settled(e) &&
               k < e->window.n) { /* the newest node is screened as one that came with its frame */
        expect(e, k, e->trust.elsewhere);
        screen(e, c, k, e->trust.elsewhere, &n_seen, &n_off);
    }
}

int32_t mhi_trust_is_lost(const mhe_estimator *e) {
    int32_t measured = 0; /* without a posture there is nothing to begin from */
    for (int32_t i = 0; i < e->channels.n && !measured; i++) {
        const mhi_channel *c = &e->channels.rows[i];
        measured = c->posture && mhi_channel_any(c->measured, (e->window.n + 1) * c->face.width);
    }
    return measured && (e->trust.implausible >= LOST_FRAMES || e->trust.predicted >= e->window.n);
}

void mhi_trust_begun(mhe_estimator *e) {
    for (int32_t i = 0; i < e->channels.n; i++) {
        if (e->channels.rows[i].trust == MHI_TRUST_POSITION) {
            mhi_channel_believe(&e->channels.rows[i], e->window.n + 1);
        }
    }
    e->trust.implausible = e->trust.predicted = 0;
    e->trust.fit = 0;
}

void mhi_trust_solved(mhe_estimator *e, int32_t frame_status) {
    mhi_trust *t = &e->trust;
    const int32_t failed = frame_status == MHE_FRAME_PREDICTED;
    t->predicted = !failed ? 0 : t->predicted + mhi_phase_settled(e); /* to settle takes its time */
    const int32_t finished =
        frame_status == MHE_FRAME_OK || frame_status == MHE_FRAME_ITERATION_LIMIT;
    if (!finished || !(t->outlier > 0)) { /* what drifts must not raise its own limit */
        return;
    }
    const mhi_channel *markers = mhi_channels_find(&e->channels, MHI_SIGNAL_MARKERS);
    if (mhi_system_markers(mhi_ocp_context(e->ocp),
                           mhi_row(e->window.solution.x, e->window.n, e->window.n_x), t->expected,
                           NULL, NULL) == MHE_OK) {
        const double fit = mhi_rms_distance(
            t->expected, mhi_row(markers->believed, e->window.n, 3 * e->n_k), 3 * e->n_k, 3);
        t->fit = isnan(fit) ? t->fit : fit;
    }
}
