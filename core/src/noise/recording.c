/* SPDX-License-Identifier: Apache-2.0 */
/* recording.c: noisy records as the recording that an estimator is run on. */
#include "estimator/columns.h"
#include "noise/noise.h"

#include <stdlib.h>

/* Rows of n_columns on their own times, as the table that interpolates them. */
typedef struct source {
    double *time, *values;
    int32_t n, n_columns;
} source;

/* On the recording's times; NULL stays NULL. */
static mhe_status resample(const mhi_recording *r, source from, int32_t hold, double **out,
                           mhe_error *err) {
    const mhi_table table = {
        .n_rows = from.n, .n_columns = from.n_columns, .time = from.time, .values = from.values};
    if (from.values == NULL) {
        return MHE_OK;
    }
    *out = calloc((size_t)r->n_frames * (size_t)from.n_columns + 1, sizeof(double));
    if (*out == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t k = 0; k < r->n_frames; k++) {
        for (int32_t i = 0; i < from.n_columns; i++) {
            (*out)[(ptrdiff_t)k * from.n_columns + i] = mhi_column_at(&table, i, r->time[k], hold);
        }
    }
    return MHE_OK;
}

static mhe_status add_truth(mhi_recording *r, const mhi_recording *from, const mhe_description *d,
                            mhe_error *err) {
    const mhi_reference *truth = &from->reference;
    const int32_t n_q = d->n_coordinates, n_m = d->n_muscles, n = from->n_frames;
    const struct {
        double *values;
        int32_t n_columns, hold;
        double **out;
    } parts[] = {{truth->q, n_q, 0, &r->reference.q},
                 {truth->qdot, n_q, 0, &r->reference.qdot},
                 {truth->activation, n_m, 0, &r->reference.activation},
                 {truth->excitation, n_m, 1, &r->reference.excitation},
                 {truth->force, n_m, 0, &r->reference.force}};
    mhe_status status = MHE_OK;
    for (size_t i = 0; i < sizeof parts / sizeof parts[0] && status == MHE_OK; i++) {
        const source from_rows = {from->time, parts[i].values, n, parts[i].n_columns};
        status = resample(r, from_rows, parts[i].hold, parts[i].out, err);
    }
    r->reference.present = 1;
    return status;
}

mhe_status mhi_noise_recording(const mhi_noise *noise, const mhi_recording *reference,
                               const mhe_description *d, const mhe_plugin *model,
                               const void *model_config, const mhe_host *host,
                               mhi_recording **recording, mhe_error *err) {
    mhi_record markers = {0}, emg = {0};
    *recording = NULL;
    if (noise->raw_emg.electrodes.n > 0) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "noise.raw_emg: raw EMG is for recordings in files (mhe-sim noise)");
    }
    mhi_recording *r = calloc(1, sizeof *r);
    if (r == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    r->unit = 1;
    r->unit_name[0] = 'm';
    mhe_status status =
        mhi_noise_markers(noise, reference, d, model, model_config, host, &markers, err);
    if (status == MHE_OK) {
        r->n_frames = markers.n_samples;
        r->rate = markers.rate;
        r->time = markers.time;
        r->markers = markers.values;
        markers = (mhi_record){0}; /* now the recording's */
        r->n_markers_found = d->n_markers;
        r->n_emg_found = d->n_muscles;
        status = mhi_noise_emg(noise, reference, d, &emg, err);
    }
    if (status == MHE_OK) {
        const source from_rows = {emg.time, emg.values, emg.n_samples, emg.n_channels};
        status = resample(r, from_rows, 0, &r->emg, err);
    }
    if (status == MHE_OK) {
        status = add_truth(r, reference, d, err);
    }
    mhi_record_free(&markers);
    mhi_record_free(&emg);
    if (status != MHE_OK) {
        mhi_recording_free(r);
        return status;
    }
    *recording = r;
    return MHE_OK;
}
