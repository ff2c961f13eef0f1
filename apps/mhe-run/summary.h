/* SPDX-License-Identifier: Apache-2.0 */
/* summary.h: what a run came to: summary.json and the lines at its end. */
#ifndef SUMMARY_H
#define SUMMARY_H

#include "base/text.h"
#include "live.h"
#include "peaks.h"
#include "tally.h"

#include <mhe/findings.h>

typedef struct summary {
    mhe_estimator_info info;
    mhe_recording_info recording;
    int32_t n_pushed;
    tally tally;
    peaks peaks;
    double *marker_offsets; /* [n_markers x 3] m, learnt by the end; NULL: none are */
    double elapsed;         /* s, whole loop */
    int32_t has_rmse;
    mhe_rmse rmse;
    const mhe_findings *findings; /* what the verdict follows from, and what was tracked */
    int32_t weight;               /* of them */
    const mhe_config *config;     /* whose model was not taken whole */
    const live *live;             /* NULL: not by the clock */
} summary;

/* What the estimator has learnt by now of where markers are. */
mhe_status summary_take_offsets(summary *s, const mhe_estimator *estimator, mhe_error *err);
/* summary.json; sorts the solve times. `path` is the config file's. */
mhe_status summary_json(summary *s, const char *path, mhi_text *out, mhe_error *err);
/* The verdict first: usable or not, why, and what helps. */
void summary_verdict(const summary *s, mhi_text *out);
/* Plain lines for the terminal, after summary_json. */
void summary_lines(const summary *s, mhi_text *out);

#endif
