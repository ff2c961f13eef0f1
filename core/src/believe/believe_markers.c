/* SPDX-License-Identifier: Apache-2.0 */
#include "base/text.h"
#include "base/values.h"
#include "believe/believe.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STILL 0.1         /* s of one and the same position to the last digit */
#define STILL_SHARE 0.01  /* of the frames */
#define STEPS_SHARE 0.2   /* of the frames */
#define MISSING_SHARE 0.2 /* of the frames without any marker */
#define ALONE 0.3         /* s without any marker: with EMG a quarter off, 1 to 2 degrees (docs) */
#define STRAIGHT 0.2      /* s along a straight line: nobody moves so ... */
#define BENT 2e-3         /* ... to this share of the way from frame to frame ... */
#define PASSED 0.005      /* m: ... over more than this */
#define MOVES 1e-4        /* m: a recording in which nothing moves more shows no motion */
#define JUMP 0.01         /* m of most markers together between two frames, beyond ... */
#define FASTEST 50.0      /* ... what so large a change of velocity (m/s2) makes of it ... */
#define JUMPS_OUT 6.0     /* ... and so many times what they do otherwise */
#define TOGETHER 3        /* markers */

/* Frames in which a marker repeats the one before, in runs longer than STILL. */
static int32_t count_still(const mhi_recording *r, int32_t n_k, int32_t marker, double *range) {
    int32_t n = 0, run = 0;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int32_t k = 0; k < r->n_frames; k++) {
        const double *p = r->markers + 3 * ((ptrdiff_t)k * n_k + marker);
        const double *before = k > 0 ? p - 3 * (ptrdiff_t)n_k : NULL;
        const int same = before != NULL && memcmp(p, before, 3 * sizeof *p) == 0 && !isnan(p[0]);
        run = same ? run + 1 : 0;
        if (run > STILL * r->rate && run > 2) {
            n += run == (int32_t)fmax(2, STILL * r->rate) + 1 ? run : 1;
        }
        for (int32_t i = 0; i < 3 && !isnan(p[0]); i++) {
            low[i] = fmin(low[i], p[i]);
            high[i] = fmax(high[i], p[i]);
        }
    }
    *range = 0;
    for (int32_t i = 0; i < 3; i++) {
        *range = fmax(*range, high[i] - low[i]);
    }
    return n;
}

/* Carried by the ground or by what nothing moves: such a marker may rest where motion is simulated.
 */
static int is_at_rest(const mhe_description *d, int32_t marker) {
    for (int32_t b = d->markers[marker].body; b >= 0; b = d->bodies[b].parent) {
        for (int32_t k = 0; k < d->bodies[b].n_motions; k++) {
            if (d->bodies[b].motions[k].coordinate >= 0) {
                return 0;
            }
        }
    }
    return 1;
}

static void check_still(const char *path, const mhe_description *d, const mhi_recording *r,
                        mhi_findings *findings) {
    mhi_text still = {0};
    int32_t n_moving = 0;
    for (int32_t i = 0; i < d->n_markers; i++) {
        double range = 0;
        const int32_t n = count_still(r, d->n_markers, i, &range);
        n_moving += range > MOVES;
        if (n > STILL_SHARE * r->n_frames && !is_at_rest(d, i)) {
            mhi_text_add(&still, "%s%s (%.0f %% of the frames)", still.length == 0 ? "" : ", ",
                         d->markers[i].name, 100.0 * n / r->n_frames);
        }
    }
    if (still.length > 0 && n_moving > 0) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "a system that holds the last position instead of a gap? Leave those "
                         "samples empty",
                         "%s: positions repeat to the last digit: %s", path, still.data);
    }
    mhi_text_free(&still);
}

/* Frames in which a marker goes on along a straight line at one speed, in runs of STRAIGHT. */
static int32_t count_straight(const mhi_recording *r, int32_t n_k, int32_t marker) {
    const ptrdiff_t width = 3 * (ptrdiff_t)n_k;
    int32_t n = 0, run = 0;
    double passed = 0;
    for (int32_t k = 2; k < r->n_frames; k++) {
        const double *p = r->markers + k * width + 3 * (ptrdiff_t)marker;
        double bend = 0, way = 0;
        for (int32_t i = 0; i < 3; i++) {
            const double to = p[i] - p[i - width], from = p[i - width] - p[i - 2 * width];
            bend += (to - from) * (to - from);
            way += to * to;
        }
        const int32_t goes_on = bend < BENT * BENT * way;
        passed = goes_on ? passed + sqrt(way) : 0;
        run = goes_on ? run + 1 : 0;
        const int32_t least = (int32_t)fmax(5, STRAIGHT * r->rate);
        if (run >= least && passed > PASSED) {
            n += n == 0 || run == least ? run : 1;
        }
    }
    return n;
}

/* Gaps that a straight line was drawn over: the line is believed like what was seen. */
static void check_straight(const char *path, const mhe_description *d, const mhi_recording *r,
                           mhi_findings *findings) {
    mhi_text straight = {0};
    for (int32_t i = 0; i < d->n_markers; i++) {
        const int32_t n = count_straight(r, d->n_markers, i);
        if (n > STILL_SHARE * r->n_frames) {
            mhi_text_add(&straight, "%s%s (%.0f %% of the frames)",
                         straight.length == 0 ? "" : ", ", d->markers[i].name,
                         100.0 * n / r->n_frames);
        }
    }
    if (straight.length > 0) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "gaps that were filled by a line? Leave those samples empty: the model "
                         "bridges them better",
                         "%s: positions go along a straight line at one speed: %s", path,
                         straight.data);
    }
    mhi_text_free(&straight);
}

/* Frames in which every marker repeats the one before, which was no repetition itself. */
static int32_t count_steps(const mhi_recording *r, int32_t n_k) {
    const ptrdiff_t width = 3 * (ptrdiff_t)n_k;
    int32_t n = 0, last = 0;
    for (int32_t k = 1; k < r->n_frames; k++) {
        const double *p = r->markers + k * width;
        const int32_t same = memcmp(p, p - width, sizeof *p * (size_t)width) == 0;
        int32_t there = 0;
        for (int32_t i = 0; i < n_k; i++) {
            there |= !isnan(p[3 * i]);
        }
        n += same && !last && there;
        last = same;
    }
    return n;
}

/* Frames of another rate that were written at this one without anything between. */
static void check_steps(const char *path, const mhe_description *d, const mhi_recording *r,
                        mhi_findings *findings) {
    const int32_t n = d->n_markers > 0 ? count_steps(r, d->n_markers) : 0;
    if (n > STEPS_SHARE * r->n_frames) {
        mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                         "frames of a slower camera, each written several times? Take each once: "
                         "as they are, the motion goes in steps",
                         "%s: %.0f %% of the frames repeat all markers of the one before", path,
                         100.0 * n / r->n_frames);
    }
}

/* How far most markers leave, from frame k - 1 to k, the way that they take before and after: the
 * median of each axis, m; NaN: too few are there. */
static double jump_at(const mhi_recording *r, int32_t n_k, int32_t k, double *each) {
    const ptrdiff_t row = 3 * (ptrdiff_t)n_k;
    const double *t = r->time + k, most = 1.5 * (t[0] - t[-1]);
    double square = 0;
    int32_t n = 0;
    if (t[-1] - t[-2] > most || t[1] - t[0] > most) {
        return NAN;
    }
    for (int32_t axis = 0; axis < 3; axis++) {
        n = 0;
        for (int32_t i = 0; i < n_k; i++) {
            const double *p = r->markers + k * row + 3 * i + axis;
            const double jump = p[0] - p[-row] - 0.5 * (p[-row] - p[-2 * row] + p[row] - p[0]);
            if (!isnan(jump)) {
                each[n++] = jump;
            }
        }
        mhi_sort(each, n);
        const double median = n == 0 ? NAN : 0.5 * (each[(n - 1) / 2] + each[n / 2]);
        square += median * median;
    }
    return n < TOGETHER ? NAN : sqrt(square);
}

/* A system that was moved or calibrated anew, two recordings in one file. */
static void check_jump(const char *path, const mhe_description *d, const mhi_recording *r,
                       mhi_findings *findings) {
    double *all = malloc(sizeof *all * ((size_t)r->n_frames + (size_t)d->n_markers + 1)), most = 0;
    int32_t n = 0, at = 0;
    for (int32_t k = 2; k + 1 < r->n_frames && all != NULL; k++) {
        const double jump = jump_at(r, d->n_markers, k, all + r->n_frames);
        if (!isnan(jump)) {
            all[n++] = jump;
            at = jump > most ? k : at;
            most = fmax(most, jump);
        }
    }
    if (n > 0) {
        mhi_sort(all, n);
        const double step = r->time[at] - r->time[at - 1];
        if (most > JUMP + FASTEST * step * step && most > JUMPS_OUT * all[n / 2]) {
            mhi_findings_add(findings, MHI_FINDING_DOUBTFUL,
                             "was the system moved or calibrated anew, or are these two "
                             "recordings? Estimate the parts one by one",
                             "%s: most markers jump by %.0f mm from %.6g to %.6g s", path,
                             1e3 * most, r->time[at - 1], r->time[at]);
        }
    }
    free(all);
}

void mhi_believe_markers(const mhi_run *run, const mhe_description *d, const mhi_recording *r,
                         mhi_findings *findings) {
    const char *path = run->data.markers;
    if (r->markers == NULL || path == NULL) {
        return;
    }
    int32_t n_empty = 0, alone = 0, longest = 0, end = 0;
    for (int32_t k = 0; k < r->n_frames; k++) {
        int32_t seen = 0;
        for (int32_t i = 0; i < d->n_markers && !seen; i++) {
            seen = !isnan(r->markers[3 * ((ptrdiff_t)k * d->n_markers + i)]);
        }
        n_empty += !seen;
        alone = seen ? 0 : alone + 1;
        end = alone > longest ? k : end;
        longest = alone > longest ? alone : longest;
    }
    if (n_empty == r->n_frames) {
        mhi_findings_add(findings, MHI_FINDING_USELESS, "nothing shows where the body is",
                         "%s: no marker of the model is there in any frame", path);
    } else if (n_empty > MISSING_SHARE * r->n_frames) {
        mhi_findings_add(
            findings, MHI_FINDING_DOUBTFUL, "what is estimated there is the model's prediction",
            "%s: %.0f %% of the frames have no marker", path, 100.0 * n_empty / r->n_frames);
    } else if (longest > ALONE * r->rate) {
        mhi_findings_add(
            findings, MHI_FINDING_DOUBTFUL,
            end + 1 == longest ? "nothing shows where the body began: cut these frames off"
                               : "what is estimated there is the model's prediction",
            "%s: no marker from %.4g to %.4g s", path, r->time[end + 1 - longest], r->time[end]);
    }
    check_still(path, d, r, findings);
    check_straight(path, d, r, findings);
    check_steps(path, d, r, findings);
    check_jump(path, d, r, findings);
}
