/* SPDX-License-Identifier: Apache-2.0 */
/* recording.h: the data section's files as frames of one model: columns found by name, on the
 * markers' time grid. */
#ifndef MHI_RECORDING_H
#define MHI_RECORDING_H

#include "believe/findings.h"
#include "config/run.h"
#include "emg/electrodes.h"

#include <mhe/description.h>
#include <mhe/estimator.h>
#include <mhe/host.h>

/* Hz: more seldom no motion is recorded, but one of up to 2000 Hz is, its times taken as s being
 * ms. */
#define MHI_SLOWEST 2.0

/* What is known of the truth, on the frames' times. NaN where a column is absent. */
typedef struct mhi_reference {
    int32_t present;
    double *q, *qdot;                /* [n_frames x n_q] */
    double *activation, *excitation; /* [n_frames x n_m] */
    double *force;                   /* [n_frames x n_m]; NaN where the file has none */
} mhi_reference;

typedef struct mhi_recording {
    int32_t n_frames;
    double rate;     /* Hz */
    double *time;    /* [n_frames], s */
    double *markers; /* [n_frames x 3 n_k], m, NaN = missing; NULL without a markers file */
    double *emg;     /* [n_frames x n_m], NaN = missing; NULL without an EMG file */
    double *angles;  /* [n_frames x n_q], rad (m), NaN = missing; NULL without a file of angles */
    int32_t n_q;
    double unit; /* metres per unit of the marker file */
    char unit_name[8];
    int32_t n_markers_found, n_emg_found;
    int32_t n_emg_columns; /* of data.emg, where columns are muscles; else 0 */
    mhi_emg_report emg_report;
    char alignment[512]; /* rates and offsets of the sources in a line, where EMG was processed */
    mhi_reference reference;
    mhi_findings findings; /* what makes it doubtful (believe/believe.h) */
    uint8_t *labels_used;  /* [data.labels]; NULL: none was looked for */
} mhi_recording;

/* Reads the files that run->data names for a model. Columns that match nothing, and names
 * without a column, are told to `host` as warnings; a file of which no column matches, or that
 * holds several people and the config names none, is an error. MHE_E_INPUT. [cold] */
mhe_status mhi_recording_read(const mhi_run *run, const mhe_description *model,
                              const mhe_host *host, mhi_recording **recording, mhe_error *err);
/* A reference alone, on its own times; markers and emg are NULL. [cold] */
mhe_status mhi_recording_read_reference(const char *path, const mhe_description *model,
                                        const mhe_host *host, mhi_recording **recording,
                                        mhe_error *err);
/* Frame k, for a model of so many markers and muscles; the arrays are the recording's. */
mhe_frame mhi_recording_frame(const mhi_recording *recording, int32_t n_markers, int32_t n_muscles,
                              int32_t k);
void mhi_recording_free(mhi_recording *recording);

#endif
