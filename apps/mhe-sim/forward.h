/* SPDX-License-Identifier: Apache-2.0 */
/* forward.h: integrates a model under given excitations and writes what an experiment would have
 * recorded. */
#ifndef FORWARD_H
#define FORWARD_H

#include "config/run.h"

typedef struct forward_setup {
    const mhi_run *run; /* model, muscle, integrator, formulation, initial */
    const mhe_host *host;
    const char *excitations; /* .sto: knots, linear between them; columns are muscles
                                (activation-driven: activations) */
    double rate;             /* Hz of the result; excitations are constant over each of its steps */
    const char *out;         /* folder: reference.sto, markers.trc, emg.sto */
} forward_setup;

/* Starts at initial.q and qdot (the coordinates' default values without) with activations equal to
 * the first excitations. MHE_E_INPUT, MHE_E_NUMERIC: nothing is written. */
mhe_status forward(const forward_setup *setup, mhe_error *err);

#endif
