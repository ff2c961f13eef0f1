/* SPDX-License-Identifier: Apache-2.0 */
/* rig.h: electrodes on a model of three muscles, and signals for them. */
#ifndef TEST_EMG_RIG_H
#define TEST_EMG_RIG_H

#include "emg/electrodes.h"

#define RIG_RATE 2000.0

/* The keys of the emg section at their defaults. */
mhi_emg_section rig_options(void);

typedef struct emg_rig {
    mhi_run run; /* channels "A" of biceps and brachialis (gain 0.5), "B" of triceps */
    mhe_description model;
    mhi_emg_report report;
    int32_t n_found, n_told;
    char told[1024]; /* what the host was given, newline after each */
    mhe_host host;
    mhe_error err;
} emg_rig;

void rig_open(emg_rig *rig);
void rig_close(emg_rig *rig);

/* Rows of columns "spare", "A" and "B": a carrier around 95 Hz times rig_force(t), A in mV. */
mhi_table *rig_table(int32_t n_rows);
double rig_force(double time);
/* emg [n_frames x 3] at 100 Hz from time 0. */
mhe_status rig_read(emg_rig *rig, mhi_table *table, int32_t n_frames, double *emg);

#endif
