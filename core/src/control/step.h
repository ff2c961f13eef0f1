/* SPDX-License-Identifier: Apache-2.0 */
/* step.h: solves one optimal-control problem of a config (config/run_steps.h). */
#ifndef MHI_STEP_H
#define MHI_STEP_H

#include "config/run_steps.h"
#include "control/trajectory.h"

#include <mhe/solver.h>

typedef struct mhi_step_setup {
    const mhi_run *run;
    const mhe_host *host;
    const mhi_system *system;
    const mhi_step *steps;
    int32_t number;                   /* of the step to solve */
    const mhi_trajectory *done;       /* [number] results of the steps before */
    int32_t linearise;                /* 1: A and B of the result are wanted */
    const mhe_solve_control *control; /* may be NULL */
    const char *cache;                /* folder of earlier solutions; NULL: none is used */
    int32_t *read_back;               /* out: 1 where the solution came from there */
} mhi_step_setup;

/* Solves it; the arrays of `result` come from `arena`. MHE_E_CONFIG: bounds or targets that do not
 * fit the model or contradict each other; a step that did not converge is told by info->outcome.
 * A folder that cannot be written is only warned of. [cold] */
mhe_status mhi_step_solve(const mhi_step_setup *setup, mhi_arena *arena, mhi_trajectory *result,
                          mhe_solve_info *info, mhe_error *err);

#endif
