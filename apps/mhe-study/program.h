/* SPDX-License-Identifier: Apache-2.0 */
/* program.h: a trial that another program makes, where the study names one: whatever is to be tried
 * many times under conditions (a calibration, say) has what a study has, rows that are kept,
 * workers, parts and merging. */
#ifndef PROGRAM_H
#define PROGRAM_H

#include "trial.h"

/* What a study file's `program` is called with and has to answer, for people. */
void program_describe(mhi_text *out);
/* One trial. What the program refuses, or answers wrongly, makes the trial failed. Status as of
 * trial_run. */
mhe_status program_run(const study *s, task what, const char *dir, const volatile int32_t *stop,
                       trial_result *result, mhe_error *err);

#endif
