/* SPDX-License-Identifier: Apache-2.0 */
/* reference_track.h: from a solution on intervals to one consistent motion. */
#ifndef REFERENCE_TRACK_H
#define REFERENCE_TRACK_H

#include "control/trajectory.h"
#include "simulation.h"

typedef struct track_report {
    double correction;                  /* largest change of an excitation by the feedback */
    double q, qdot;                     /* largest difference to the solution, rad (m), rad/s */
    double peak_excitation, peak_force; /* 1, N */
} track_report;

/* Integrates the solution's controls (with A and B) from node `first` on with CVODES, kept on the
 * track by a small feedback on the muscle controls (control/feedback.h) that becomes part of them,
 * within `lower` .. `upper`, and writes reference.sto, forces.sto, markers.trc and emg.sto through
 * the simulation's files. */
mhe_status reference_track(simulation *s, const mhi_trajectory *solution, int32_t first,
                           double lower, double upper, track_report *report, mhe_error *err);

#endif
