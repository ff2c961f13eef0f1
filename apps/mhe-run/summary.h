/* SPDX-License-Identifier: Apache-2.0 */
/* summary.h: what a run came to: summary.json and the lines at its end. */
#ifndef SUMMARY_H
#define SUMMARY_H

#include "base/text.h"
#include "estimator/errors.h"
#include "live.h"

typedef struct summary {
    mhe_estimator_info info;
    int32_t n_frames; /* of the recording */
    int32_t n_pushed;
    int32_t n_solves;
    int32_t n_converged, n_deadline;
    int32_t n_predicted; /* of n_solves: the solve failed */
    int32_t iterations_max;
    double iterations_sum;
    double *solve_ms; /* [capacity >= n_solves], owned */
    int32_t capacity;
    double elapsed; /* s, whole loop */
    mhi_emg_report emg;
    const char *alignment; /* a line, or NULL */
    int32_t has_rmse;
    mhi_rmse rmse;
    const live *live; /* NULL: not by the clock */
} summary;

mhe_status summary_add(summary *s, const mhe_estimate *estimate, mhe_error *err);
/* summary.json; sorts the solve times. `config` is the config file's path. */
mhe_status summary_json(summary *s, const char *config, mhi_text *out, mhe_error *err);
/* Plain lines for the terminal, after summary_json. */
void summary_lines(const summary *s, mhi_text *out);
void summary_free(summary *s);

#endif
