/* SPDX-License-Identifier: Apache-2.0 */
/* track.h: a piece of the real abduction through the estimator, as measured or with faults. */
#ifndef TEST_RECORDING_TRACK_H
#define TEST_RECORDING_TRACK_H

#include "estimator/create.h"
#include "estimator/recording.h"

/* The piece: the arm rises from 25 to 55 degrees. */
#define TRACK_FIRST 290
#define TRACK_FRAMES 100
#define TRACK_MOST_VALUES (TRACK_FRAMES * 64)

typedef struct track {
    mhi_registry *registry;
    mhi_run *run;
    mhe_description *model;
    mhi_recording *recording;
    int32_t n_estimates, n_converged, n_predicted;
    double q[TRACK_MOST_VALUES], force[TRACK_MOST_VALUES], activation[TRACK_MOST_VALUES];
    double marker_rms[TRACK_FRAMES]; /* m, of the estimates */
    /* plain inverse kinematics of the same frames */
    double ik_q[TRACK_MOST_VALUES], ik_rms[TRACK_FRAMES];
} track;

extern const mhe_host track_host; /* drops what it is told */

/* Reads a shipped config ("abduction.yaml") and its data with assignments `set` [n_set]; 0: the
 * data are absent. */
int track_open(track *t, const char *config, const char *const *set, int32_t n_set);
/* Pushes the piece's frames and keeps what comes out. */
void track_run(track *t);
void track_close(track *t);

double *track_marker(track *t, int32_t frame, const char *name); /* of the recording, [3] m */
double *track_emg(track *t, int32_t frame, const char *muscle);
int32_t track_coordinate(const track *t, const char *name);
int32_t track_muscle(const track *t, const char *name);

/* RMS over all estimates and columns of a - b. */
double track_change(const track *t, const double *a, const double *b, int32_t n_columns);

#endif
