/* SPDX-License-Identifier: Apache-2.0 */
/* simulation.h: a model that moves: its state, the CVODES step, and the files an experiment would
 * have recorded. */
#ifndef SIMULATION_H
#define SIMULATION_H

#include "base/arena.h"
#include "config/run.h"
#include "io/table.h"
#include "model/system.h"
#include <mhe/outbox.h>

#include <mhe/integrator.h>

typedef struct simulation {
    const mhi_run *run;
    const mhi_system *system;
    double rate; /* Hz */
    int32_t n_q, n_m, n_x;
    double *x, *u, *w;    /* [n_x] state, [n_u] muscle controls and [n_w] inputs of forces, constant
                           * over a step */
    const char **muscles; /* [n_m] names */
    mhi_system_context *context;
    const mhe_integrator_ops *integrator;
    void *integrator_self, *integrator_context;
    double *x_next, *marker;
    double *row; /* [n_columns] of reference.sto: q, qdot, activations, excitations, forces, then
                  * what muscles have of other states */
    int32_t n_columns;
    double *activation, *excitation, *force; /* [n_m] in the row */
    mhe_outbox *outbox;
    mhe_sink *reference, *trc, *emg;
    mhi_arena arena;
} simulation;

/* Takes memory and the integrator (mhe.integrator.sundials) for a system that outlives the
 * simulation. [cold] */
mhe_status simulation_open(simulation *s, const mhi_run *run, const mhi_system *system,
                           const mhe_host *host, mhi_registry *registry, double rate,
                           mhe_error *err);
/* Steps from the first to the last row of a table; MHE_E_INPUT: more than a file should hold. */
mhe_status simulation_steps(const simulation *s, const mhi_table *input, int32_t *n,
                            mhe_error *err);
/* Opens reference.sto, markers.trc and emg.sto in the folder, which is the simulation's alone from
 * here on and does not hold `input` (NULL: none) under such a name. */
mhe_status simulation_files(simulation *s, const char *folder, const char *input, mhe_error *err);
/* Writes state, controls, forces and markers at a time. */
mhe_status simulation_write(simulation *s, double time, mhe_error *err);
/* Carries the state over 1/rate seconds. */
mhe_status simulation_step(simulation *s, double time, mhe_error *err);
mhe_status simulation_commit(simulation *s, mhe_error *err);
/* Without a commit before, no file appears. */
void simulation_close(simulation *s);

#endif
