/* SPDX-License-Identifier: Apache-2.0 */
/* recover.c: which measurements are believed, and when a window is given up.
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

void mhi_recover_screen(mhe_estimator *e) {
    double *seen = mhi_row(e->trusted, e->n, 3 * e->n_k);
    int32_t n_seen = 0, n_off = 0;
    if (!(e->outlier > 0)) {
        return;
    }
    for (int32_t i = 0; i < e->n_k; i++) {
        const double far = mhi_rms_distance(seen + 3 * i, e->expected + 3 * i, 3, 3);
        const int32_t off = far > e->outlier + e->fit;
        n_seen += !isnan(far);
        n_off += off;
        for (int32_t axis = 0; axis < 3 && off && e->settled; axis++) {
            seen[3 * i + axis] = NAN;
        }
    }
    if (n_seen > 0) {
        e->implausible = 2 * n_off > n_seen ? e->implausible + 1 : 0;
    }
}

static int32_t is_rail(double emg) {
    return emg >= 1 || emg == 0;
}

static int32_t at_rails(const mhe_estimator *e, const double *emg) {
    int32_t n_measured = 0, n_low = 0, n_high = 0;
    for (int32_t i = 0; i < e->n_m; i++) {
        n_measured += !isnan(emg[i]);
        n_low += emg[i] == 0;
        n_high += emg[i] >= 1;
    }
    return n_measured >= FEW_CHANNELS && (n_low + n_high == n_measured || 2 * n_high > n_measured);
}

void mhi_recover_count_emg(mhe_estimator *e, const double *emg) {
    const int32_t railed = e->saturation > 0 && at_rails(e, emg);
    e->railed = !railed ? 0 : e->railed < e->saturation ? e->railed + 1 : e->railed;
}

void mhi_recover_drop_emg(mhe_estimator *e) {
    if (e->railed == 0 || e->railed < e->saturation) {
        return;
    }
    for (int32_t k = e->filled; k-- > 0;) { /* what was dropped before is no longer at the rails */
        double *emg = mhi_row(e->emg, k, e->n_m);
        if (!at_rails(e, emg)) {
            return;
        }
        for (int32_t i = 0; i < e->n_m; i++) {
            emg[i] = is_rail(emg[i]) ? NAN : emg[i];
        }
    }
}

int32_t mhi_recover_is_lost(const mhe_estimator *e) {
    int32_t measured = 0; /* without markers or angles there is nothing to begin from */
    for (ptrdiff_t i = 0; i < (ptrdiff_t)(e->n + 1) * 3 * e->n_k && !measured; i++) {
        measured = !isnan(e->markers[i]);
    }
    for (ptrdiff_t i = 0; i < (ptrdiff_t)(e->n + 1) * e->n_q && !measured; i++) {
        measured = !isnan(e->angles[i]);
    }
    return measured && (e->implausible >= LOST_FRAMES || e->predicted >= e->n);
}

void mhi_recover_begun(mhe_estimator *e) {
    memcpy(e->trusted, e->markers, sizeof(double) * (size_t)((e->n + 1) * 3 * e->n_k));
    e->implausible = e->predicted = 0;
    e->fit = 0;
}

void mhi_recover_solved(mhe_estimator *e, int32_t frame_status) {
    const int32_t failed = frame_status == MHE_FRAME_PREDICTED;
    e->predicted = !failed ? 0 : e->predicted + e->settled; /* to settle may take its time */
    const int32_t finished =
        frame_status == MHE_FRAME_OK || frame_status == MHE_FRAME_ITERATION_LIMIT;
    if (!finished || !(e->outlier > 0)) { /* what drifts must not raise its own limit */
        return;
    }
    if (mhi_system_markers(mhi_ocp_context(e->ocp), mhi_row(e->solution.x, e->n, e->n_x),
                           e->expected, NULL, NULL) == MHE_OK) {
        const double fit =
            mhi_rms_distance(e->expected, mhi_row(e->trusted, e->n, 3 * e->n_k), 3 * e->n_k, 3);
        e->fit = isnan(fit) ? e->fit : fit;
    }
}
