/* SPDX-License-Identifier: Apache-2.0 */
/* recording.h: the files of a config's `data` section, read as frames of its model.
 *
 *     mhe_recording_open(config, &recording, &err);
 *     mhe_recording_describe(recording, &info, &err);
 *     for (int32_t k = 0; k < info.n_frames; k++) {
 *         mhe_recording_frame(recording, k, &frame, &err);
 *         mhe_estimator_push(estimator, &frame, &estimate, &ready, &err);
 *     }
 *
 * Markers (.trc, .c3d), EMG (.sto, .mot, .c3d; raw channels through the section `emg`), measured
 * angles and a reference (.sto, .mot): columns are found by the model's names, units and clocks are
 * made one. Threads: reading from one recording is free; it does not change. */
#ifndef MHE_RECORDING_H
#define MHE_RECORDING_H

#include <mhe/config.h>
#include <mhe/estimator.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mhe_recording mhe_recording;

/* Sizes and what was found. Pointers live as long as the recording, names as long as the config. */
typedef struct mhe_recording_info {
    uint32_t size;
    int32_t n_frames;
    double rate;                          /* Hz, of the frames */
    const double *time;                   /* [n_frames], s */
    int32_t n_q, n_muscles, n_markers;    /* of the model */
    int32_t has_markers, has_emg;         /* 0: no such file */
    int32_t has_angles, has_reference;    /* 0: no such file */
    int32_t n_markers_found, n_emg_found; /* of the model's, columns in the files */
    double marker_unit;                   /* m per unit of the marker file */
    const char *marker_unit_name;         /* "mm" */
    const char *alignment;                /* rates and offsets of raw EMG in a line; "" without */
    int32_t emg_channels;                 /* raw channels; 0: the columns are muscles, and ... */
    double emg_rate;                      /* ... these are 0: Hz */
    double emg_offset;                    /* s, of the EMG file against the markers */
    double emg_filter_delay;              /* s, of the filters */
    double emg_lag;                       /* s of it beyond the electromechanical delay */
    const char *const *coordinate_names;  /* [n_q] */
    const char *const *muscle_names;      /* [n_muscles] */
    const char *const *marker_names;      /* [n_markers] */
} mhe_recording_info;

/* What is known of the truth at a frame; NaN where the reference has no such column. */
typedef struct mhe_truth {
    uint32_t size;
    double time;              /* s */
    const double *q;          /* [n_q], rad (m) */
    const double *qdot;       /* [n_q], rad/s (m/s) */
    const double *activation; /* [n_muscles] */
    const double *excitation; /* [n_muscles] */
    const double *force;      /* [n_muscles], N */
} mhe_truth;

/* Reads the files that the config names. What looks wrong in them is told to the config's host.
 * MHE_E_INPUT, MHE_E_CONFIG: err->text is "file:line: what". [cold] */
MHE_API mhe_status mhe_recording_open(mhe_config *config, mhe_recording **recording,
                                      mhe_error *err);
MHE_API void mhe_recording_close(mhe_recording *recording); /* NULL is fine. [cold] */

/* Fills `info` up to its size. [any] */
MHE_API mhe_status mhe_recording_describe(const mhe_recording *recording, mhe_recording_info *info,
                                          mhe_error *err);

/* Frame k, 0 .. n_frames - 1, up to the size of `frame`; its arrays are the recording's.
 * MHE_E_ARGUMENT: there is no such frame. [any] */
MHE_API mhe_status mhe_recording_frame(const mhe_recording *recording, int32_t k, mhe_frame *frame,
                                       mhe_error *err);

/* The reference at frame k, up to the size of `truth`; the arrays are the recording's.
 * MHE_E_ARGUMENT: there is no such frame; MHE_E_INPUT: there is no reference. [any] */
MHE_API mhe_status mhe_recording_truth(const mhe_recording *recording, int32_t k, mhe_truth *truth,
                                       mhe_error *err);

#ifdef __cplusplus
}
#endif
#endif
