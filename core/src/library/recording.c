/* SPDX-License-Identifier: Apache-2.0 */
#include "library/recording.h"

#include "base/need.h"
#include "library/config.h"

#include <stdlib.h>

/* The names of the model's parts, side by side. */
static mhe_status list_names(mhe_config *c, const mhe_description *m, mhe_recording_info *info,
                             mhe_error *err) {
    mhi_arena *arena = &c->run->arena;
    const char **q = MHI_TAKE(arena, const char *, m->n_coordinates);
    const char **muscles = MHI_TAKE(arena, const char *, m->n_muscles);
    const char **markers = MHI_TAKE(arena, const char *, m->n_markers);
    if (q == NULL || muscles == NULL || markers == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < m->n_coordinates; i++) {
        q[i] = m->coordinates[i].name;
    }
    for (int32_t i = 0; i < m->n_muscles; i++) {
        muscles[i] = m->muscles[i].name;
    }
    for (int32_t i = 0; i < m->n_markers; i++) {
        markers[i] = m->markers[i].name;
    }
    info->n_q = m->n_coordinates;
    info->n_muscles = m->n_muscles;
    info->n_markers = m->n_markers;
    info->coordinate_names = q;
    info->muscle_names = muscles;
    info->marker_names = markers;
    return MHE_OK;
}

static void fill_info(const mhi_recording *r, mhe_recording_info *info) {
    info->size = sizeof *info;
    info->n_frames = r->n_frames;
    info->rate = r->rate;
    info->time = r->time;
    info->has_markers = r->markers != NULL;
    info->has_emg = r->emg != NULL;
    info->has_angles = r->angles != NULL;
    info->has_reference = r->reference.present;
    info->n_markers_found = r->n_markers_found;
    info->n_emg_found = r->n_emg_found;
    info->marker_unit = r->unit;
    info->marker_unit_name = r->unit_name;
    info->alignment = r->alignment;
    info->emg_channels = r->emg_report.n_channels;
    info->emg_rate = r->emg_report.rate;
    info->emg_offset = r->emg_report.offset;
    info->emg_filter_delay = r->emg_report.filter_delay;
    info->emg_lag = r->emg_report.lag;
}

mhe_status mhe_recording_open(mhe_config *config, mhe_recording **recording, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"config", config}, {"recording", recording});
    const mhe_description *model = NULL;
    if (status != MHE_OK) {
        return status;
    }
    *recording = NULL;
    mhe_recording *r = calloc(1, sizeof *r);
    if (r == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    status = mhi_config_model(config, &model, err);
    if (status == MHE_OK) {
        status = list_names(config, model, &r->info, err);
    }
    if (status == MHE_OK) {
        status = mhi_recording_read(config->run, model, config->host, &r->data, err);
    }
    if (status != MHE_OK) {
        mhe_recording_close(r);
        return status;
    }
    fill_info(r->data, &r->info);
    *recording = r;
    return MHE_OK;
}

void mhe_recording_close(mhe_recording *r) {
    if (r != NULL) {
        mhi_recording_free(r->data);
        free(r);
    }
}

mhe_status mhe_recording_describe(const mhe_recording *r, mhe_recording_info *info,
                                  mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"recording", r}, {"info", info});
    return status == MHE_OK ? mhi_give(__func__, info, &r->info, err) : status;
}

static mhe_status check_frame(const char *function, const mhe_recording *r, int32_t k,
                              mhe_error *err) {
    return k >= 0 && k < r->info.n_frames
               ? MHE_OK
               : mhe_fail(err, MHE_E_ARGUMENT, "%s: there is no frame %d of %d", function, (int)k,
                          (int)r->info.n_frames);
}

mhe_status mhe_recording_frame(const mhe_recording *r, int32_t k, mhe_frame *frame,
                               mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"recording", r}, {"frame", frame});
    if (status == MHE_OK) {
        status = check_frame(__func__, r, k, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    const mhe_frame f = mhi_recording_frame(r->data, r->info.n_markers, r->info.n_muscles, k);
    return mhi_give(__func__, frame, &f, err);
}

mhe_status mhe_recording_truth(const mhe_recording *r, int32_t k, mhe_truth *truth,
                               mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"recording", r}, {"truth", truth});
    if (status == MHE_OK) {
        status = check_frame(__func__, r, k, err);
    }
    if (status == MHE_OK && !r->info.has_reference) {
        status = mhe_fail(err, MHE_E_INPUT, "the recording has no reference");
    }
    if (status != MHE_OK) {
        return status;
    }
    const mhi_reference *f = &r->data->reference;
    const ptrdiff_t q = (ptrdiff_t)k * r->info.n_q, m = (ptrdiff_t)k * r->info.n_muscles;
    const mhe_truth t = {.size = sizeof t,
                         .time = r->info.time[k],
                         .q = f->q + q,
                         .qdot = f->qdot + q,
                         .activation = f->activation + m,
                         .excitation = f->excitation + m,
                         .force = f->force + m};
    return mhi_give(__func__, truth, &t, err);
}
