/* SPDX-License-Identifier: Apache-2.0 */
#include "base/text.h"
#include "believe/believe.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define STILL 0.1         /* s of one and the same position to the last digit */
#define STILL_SHARE 0.01  /* of the frames */
#define MISSING_SHARE 0.2 /* of the frames without any marker */
#define MOVES 1e-4        /* m: a recording in which nothing moves more shows no motion */

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

static void check_still(const char *path, const mhe_description *d, const mhi_recording *r,
                        mhi_findings *findings) {
    mhi_text still = {0};
    int32_t n_moving = 0;
    for (int32_t i = 0; i < d->n_markers; i++) {
        double range = 0;
        const int32_t n = count_still(r, d->n_markers, i, &range);
        n_moving += range > MOVES;
        if (n > STILL_SHARE * r->n_frames) {
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

void mhi_believe_markers(const mhi_run *run, const mhe_description *d, const mhi_recording *r,
                         mhi_findings *findings) {
    const char *path = run->data.markers;
    if (r->markers == NULL || path == NULL) {
        return;
    }
    int32_t n_empty = 0;
    for (int32_t k = 0; k < r->n_frames; k++) {
        int32_t seen = 0;
        for (int32_t i = 0; i < d->n_markers && !seen; i++) {
            seen = !isnan(r->markers[3 * ((ptrdiff_t)k * d->n_markers + i)]);
        }
        n_empty += !seen;
    }
    if (n_empty == r->n_frames) {
        mhi_findings_add(findings, MHI_FINDING_USELESS, "nothing shows where the body is",
                         "%s: no marker of the model is there in any frame", path);
    } else if (n_empty > MISSING_SHARE * r->n_frames) {
        mhi_findings_add(
            findings, MHI_FINDING_DOUBTFUL, "what is estimated there is the model's prediction",
            "%s: %.0f %% of the frames have no marker", path, 100.0 * n_empty / r->n_frames);
    }
    check_still(path, d, r, findings);
}
