/* SPDX-License-Identifier: Apache-2.0 */
/* tasks.h: data.marker_weights, brought to the markers and coordinates of a model. */
#ifndef MHI_ESTIMATOR_TASKS_H
#define MHI_ESTIMATOR_TASKS_H

#include "base/arena.h"
#include "config/run.h"
#include "ocp/tasks.h"

#include <mhe/model.h>

/* *tasks is NULL where the run gives none. What a task file names and the model lacks is told to
 * `host` (NULL: nobody). MHE_E_CONFIG: a key that means no marker, or a weight that is none.
 * MHE_E_INPUT: the task file. Memory from `arena`. [cold] */
mhe_status mhi_tasks_read(const mhi_run *run, const mhe_description *description,
                          const mhe_host *host, mhi_arena *arena, const mhi_tasks **tasks,
                          mhe_error *err);

#endif
