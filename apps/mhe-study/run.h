/* SPDX-License-Identifier: Apache-2.0 */
/* run.h: the commands that compute. */
#ifndef RUN_H
#define RUN_H

#include "arguments.h"

#include <mhe/host.h>

/* mhe-study run: all trials of the study, or of a shard, that have no row yet. */
mhe_status run_study(const arguments *a, const mhe_host *host, mhe_error *err);
/* mhe-study merge: tables of a results folder, with the rows of others of the same study. */
mhe_status run_merge(const arguments *a, const mhe_host *host, mhe_error *err);

#endif
