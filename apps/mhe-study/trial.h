/* SPDX-License-Identifier: Apache-2.0 */
/* trial.h: one trial: a noisy recording in memory, the estimator on it, one row of results. */
#ifndef TRIAL_H
#define TRIAL_H

#include "study.h"
#include "tally.h"

#include "estimator/errors.h"

typedef struct trial_result {
    tally tally;
    mhi_rmse rmse;
    double seconds;
    int32_t failed;
    mhe_error reason; /* of a failed trial */
} trial_result;

/* Runs it, as mhe-run would run its files. What the estimator refuses makes the trial failed, with
 * the reason; the status tells of what is wrong with this machine (MHE_E_MEMORY, MHE_E_IO) and of
 * *stop set meanwhile (MHE_E_INTERRUPTED). A recording that one window holds is judged by all nodes
 * of that window. Forces of conditions that keep them are a file in `dir`/forces. Give the result
 * back with trial_free in any case. */
mhe_status trial_run(const study *s, task what, const char *dir, const mhe_host *host,
                     const volatile int32_t *stop, trial_result *result, mhe_error *err);
void trial_free(trial_result *result);

/* Cells of the result between commas; what varies from run to run stands apart. Rate and solve
 * times are of all solves but the first of a trial, which starts cold: first_ms. */
#define TRIAL_RESULT_COLUMNS                                                              \
    "status,solves,converged,iterations_mean,iterations_max,q_deg,qdot_rad_s,activation," \
    "excitation,force_n,marker_mm"
#define TRIAL_TIMING_COLUMNS                                                                      \
    "rate_hz,solve_ms_mean,solve_ms_p50,solve_ms_p95,solve_ms_p99,solve_ms_max,first_ms,seconds," \
    "peak_rss_"                                                                                   \
    "mb"
void trial_cells(trial_result *result, mhi_text *cells);
void trial_timing(trial_result *result, mhi_text *cells);

/* The estimator of a condition can be made: what its plugins refuse. MHE_E_CONFIG with the line of
 * the condition's grid. */
mhe_status trial_check(const study *s, const condition *c, const mhe_host *host, mhe_error *err);

#endif
