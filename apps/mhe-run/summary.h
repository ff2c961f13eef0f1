/* SPDX-License-Identifier: Apache-2.0 */
/* summary.h: what a run came to: summary.json and the lines at its end. */
#ifndef SUMMARY_H
#define SUMMARY_H

#include "believe/diagnosis.h"
#include "config/run.h"
#include "estimator/errors.h"
#include "live.h"
#include "tally.h"

typedef struct summary {
    mhe_estimator_info info;
    int32_t n_frames; /* of the recording */
    int32_t n_pushed;
    tally tally;
    double elapsed; /* s, whole loop */
    mhi_emg_report emg;
    const char *alignment; /* a line, or NULL */
    int32_t has_rmse;
    mhi_rmse rmse;
    const mhi_findings *findings;   /* what the verdict follows from */
    const mhi_diagnosis *diagnosis; /* what was tracked */
    const mhe_description *model;   /* what of it was dropped */
    const live *live;               /* NULL: not by the clock */
} summary;

/* summary.json; sorts the solve times. */
mhe_status summary_json(summary *s, const mhi_run *run, mhi_text *out, mhe_error *err);
/* The verdict first: usable or not, why, and what helps. */
void summary_verdict(const summary *s, mhi_text *out);
/* Plain lines for the terminal, after summary_json. */
void summary_lines(const summary *s, mhi_text *out);

#endif
