/* SPDX-License-Identifier: Apache-2.0 */
/* motion.h: the two ways to make a model move. */
#ifndef MOTION_H
#define MOTION_H

#include "config/run.h"

typedef struct motion_setup {
    const mhi_run *run;
    const mhe_host *host;
    mhi_registry *registry;
    const char *input; /* .sto: excitations or postures */
    double rate;       /* Hz of the result; muscle controls are constant over each of its steps */
    const char *out;   /* folder: reference.sto, markers.trc, emg.sto */
} motion_setup;

/* Integrates from initial.q and qdot (without: the coordinates' defaults) under the file's
 * excitations, linear between its rows; the first activations are the first excitations. */
mhe_status motion_forward(const motion_setup *setup, mhe_error *err);

/* Moves through the file's postures, each reached from the last on a minimum-jerk path (Flash &
 * Hogan 1985, doi:10.1523/JNEUROSCI.05-07-01688.1985). The muscle controls are found on the way:
 * the config's window, solved at every step from the state that CVODES has reached, looks ahead
 * along the path. */
mhe_status motion_follow(const motion_setup *setup, mhe_error *err);

#endif
