/* SPDX-License-Identifier: Apache-2.0 */
/* submit.h: mhe-study submit: a study as a job array of an engine that shares out machines. */
#ifndef SUBMIT_H
#define SUBMIT_H

#include "arguments.h"

#include <mhe/host.h>

/* Checks the study, makes its folder and motions here, writes DIR/slurm/job.sh and hands it to
 * sbatch. Every task runs a shard; the one that completes the study writes the tables. A task that
 * dies with its machine is requeued by Slurm and goes on where its rows end. The study's files, DIR
 * and the programs must be at the same paths on all machines. */
mhe_status submit_study(const arguments *a, const mhe_host *host, mhe_error *err);

#endif
