/* SPDX-License-Identifier: Apache-2.0 */
/* held_out.h: what a config's estimates are worth on a recording. */
#ifndef HELD_OUT_H
#define HELD_OUT_H

#include "calibrate/calibrate.h"

/* RMS over a recording; NaN where nothing was to be compared with. */
typedef struct held_out {
    double marker, emg;          /* m, 1: estimates and measurements */
    double q, force, activation; /* rad, N, 1: of the truth where it is known */
    int32_t n;
} held_out;

/* With the model and the EMG's channels of `config`, on the files of `recording`. */
mhe_status held_out_measure(const char *config, const char *const *set, int32_t n_set,
                            const mhi_plan_recording *recording, const mhe_host *host,
                            held_out *out, mhe_error *err);

#endif
