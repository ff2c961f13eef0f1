/* SPDX-License-Identifier: Apache-2.0 */
/* step_private.h: a step while it is set up. */
#ifndef MHI_STEP_PRIVATE_H
#define MHI_STEP_PRIVATE_H

#include "control/step.h"
#include "ocp/ocp.h"

typedef struct mhi_step_work {
    const mhi_step_setup *setup;
    const mhi_step *step;
    const mhe_system *face;
    const mhe_description *description;
    mhi_ocp *ocp;
    double interval; /* s */
    double *x, *u;   /* [n_x], [n_u] scratch */
    mhi_arena arena; /* for the time of the solve */
} mhi_step_work;

/* Results of the steps with these names, one entry each. */
const mhi_trajectory **mhi_step_motions(mhi_step_work *w, const char *const *names, int32_t n);

/* Whether a target's source is a file, else names of steps. */
int32_t mhi_step_is_file(const char *source);

/* Targets of all signals that the step's config names. */
mhe_status mhi_step_targets(mhi_step_work *w, mhe_error *err);

/* Fails with place and name of the step in front. */
MHE_PRINTF(4, 5)
mhe_status mhi_step_fail(const mhi_step_work *w, mhe_status code, mhe_error *err,
                         const char *format, ...);

#endif
