/* SPDX-License-Identifier: Apache-2.0 */
/* run_steps.h: optimal-control problems in a config: a list `steps` in place of `costs`, solved one
 * after the other. */
#ifndef MHI_RUN_STEPS_H
#define MHI_RUN_STEPS_H

#include "config/run.h"

/* Bounds of one signal over a part of a step's time. */
typedef struct mhi_step_bound {
    const char *signal;            /* "q", "qdot", "activation", "excitation", "residual_torque" */
    mhe_text_list of;              /* names of muscles or coordinates; n = 0: all */
    mhe_real_list value, min, max; /* n = 0: left as they are; 1: of all; else one each */
    double from, to;               /* s from the step's begin */
    const mhi_node *node;          /* for messages */
} mhi_step_bound;

typedef struct mhi_step {
    const char *name;
    double duration; /* s */
    int32_t intervals;
    mhe_text_list start;  /* earlier steps whose results, joined, the solver starts from */
    mhe_text_map targets; /* signal -> earlier steps, joined, or a .sto file */
    mhe_real_list toward; /* posture that a start without earlier steps moves to [n_q] */
    const char *output;   /* folder of the result; NULL: only used by later steps */
    int32_t drop;         /* nodes left out at the begin of the output; time is 0 behind them */
    mhi_use *costs;
    int32_t n_costs;
    mhi_step_bound *bounds;
    int32_t n_bounds;
    const mhi_node *node; /* for messages */
} mhi_step;

/* The steps of a run that mhi_run_read_base read; they live as long as it. Names of steps are
 * checked; names of the model's parts and files are not. MHE_E_CONFIG: "file:line: ...". [cold] */
mhe_status mhi_run_read_steps(mhi_run *run, mhi_registry *registry, mhi_step **steps, int32_t *n,
                              mhe_error *err);
/* Number of the step with this name among the first n, or -1. */
int32_t mhi_step_find(const mhi_step *steps, int32_t n, const char *name);

/* Option tables of a step ("steps") and of an entry of its bounds ("bounds"). [any] */
const mhe_option *mhi_step_options(int32_t *n);
const mhe_option *mhi_step_bound_options(int32_t *n);

#endif
