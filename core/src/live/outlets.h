/* SPDX-License-Identifier: Apache-2.0 */
/* outlets.h: sinks, each on a thread of its own. */
#ifndef MHI_OUTLETS_H
#define MHI_OUTLETS_H

#include "config/run.h"

#include <mhe/description.h>
#include <mhe/sink.h>

typedef struct mhi_outlets mhi_outlets;

typedef struct mhi_outlets_setup {
    const mhe_host *host;
    const mhi_run *run;
    const mhe_description *model;
    const mhe_estimator_info *info;
    const char *folder;
    const mhe_sink_control *control;
} mhi_outlets_setup;

/* Creates the sinks of the config, opens them and starts their threads. MHE_E_*: what a sink
 * refuses, with the config's line. [cold] */
mhe_status mhi_outlets_start(const mhi_outlets_setup *setup, mhi_outlets **outlets, mhe_error *err);
/* What is in the rings goes out; then everything is closed. NULL is fine. [cold] */
void mhi_outlets_stop(mhi_outlets *outlets);

/* Hands an estimate to all sinks; does not wait. `host_time`: of its node, s of CLOCK_MONOTONIC.
 * [hot] */
void mhi_outlets_give(mhi_outlets *outlets, const mhe_estimate *estimate, double host_time);

/* Of sink i: its plugin, estimates taken, lost; latencies from host_time to when it took them, s:
 * p50, p95, p99, max of the last 4096. Returns 0 where there is no such sink. [any] */
int32_t mhi_outlets_report(mhi_outlets *outlets, int32_t i, const char **id, int64_t *taken,
                           int64_t *lost, double latency[4]);

#endif
