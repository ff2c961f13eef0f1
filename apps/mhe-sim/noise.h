/* SPDX-License-Identifier: Apache-2.0 */
/* noise.h: from a reference motion to the files of a recording with errors. */
#ifndef MHE_SIM_NOISE_H
#define MHE_SIM_NOISE_H

#include "noise/config.h"

/* Writes markers.trc, emg.sto, noise.yaml, with raw EMG recording.c3d and, where the config wants
 * it and gnuplot is installed, noise.svg with its noise.gp into the folder; on a failure none of
 * them. */
mhe_status noise_record(const mhi_noise_config *config, const mhe_host *host, const char *out,
                        mhe_error *err);

/* Draws the EMG of the muscles with the largest excitations, without and with noise, as noise.svg
 * in the folder. */
mhe_status noise_picture(const mhi_noise_config *config, const mhi_recording *reference,
                         const mhe_description *model, const char *out, mhe_error *err);

#endif
