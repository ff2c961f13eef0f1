/* SPDX-License-Identifier: Apache-2.0 */
/* report.h: what a calibration found, for people and for programs. */
#ifndef REPORT_H
#define REPORT_H

#include "held_out.h"

/* One recording before and after. */
typedef struct report_recording {
    const char *name;
    int32_t held_out;
    held_out before, after;
} report_recording;

typedef struct report_content {
    const mhi_calibration *c;
    const report_recording *recordings;
    int32_t n_recordings;
    mhi_text findings; /* one a line */
} report_content;

const char *report_outcome(const mhi_calibration *c);
const char *report_verdict(const mhi_estimated *e);
/* What a reader is to know: not informed, at a bound, against the prior, not converged. */
void report_findings(report_content *r);
void report_table(const report_content *r, mhi_text *out); /* parameters.csv */
void report_json(const report_content *r, mhi_text *out);  /* calibration.json */
void report_html(const report_content *r, mhi_text *out);  /* report.html */

#endif
