/* SPDX-License-Identifier: Apache-2.0 */
#include "noise.h"

#include "base/arena.h"
#include "estimator/create.h"
#include "io/c3d_write.h"
#include "io/model_file.h"
#include <mhe/outbox.h>

#include <math.h>

typedef struct recorder {
    const mhi_noise_config *config;
    const mhe_host *host;
    mhe_description *model;
    mhi_recording *reference;
    mhi_record markers, emg, raw_emg; /* the last one may be none */
    mhe_outbox *outbox;
    mhi_arena arena;
} recorder;

static mhe_status record(recorder *r, mhe_error *err) {
    const mhi_noise_config *c = r->config;
    mhe_status status = mhi_estimator_read_model(c->run, r->host, &r->model, err);
    if (status == MHE_OK) {
        status = mhi_recording_read_reference(c->reference, r->model, r->host, &r->reference, err);
    }
    if (status == MHE_OK) {
        status = mhi_noise_markers(&c->noise, r->reference, r->model, c->run->model.plugin,
                                   c->run->model.config, r->host, &r->markers, err);
    }
    if (status == MHE_OK) {
        status = mhi_noise_emg(&c->noise, r->reference, r->model, &r->emg, err);
    }
    return status == MHE_OK && c->noise.raw_emg.electrodes.n > 0
               ? mhi_noise_raw_emg(&c->noise, r->reference, r->model, &r->raw_emg, err)
               : status;
}

static mhe_status write_rows(const mhi_record *record, mhe_sink *sink, mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t k = 0; k < record->n_samples && status == MHE_OK; k++) {
        status = mhe_sink_row(sink, record->time[k],
                              record->values + (ptrdiff_t)k * record->n_channels, err);
    }
    return status;
}

static const char **marker_names(recorder *r, mhe_error *err) {
    const mhe_description *d = r->model;
    const char **names = MHI_TAKE(&r->arena, const char *, d->n_markers);
    for (int32_t i = 0; names != NULL && i < d->n_markers; i++) {
        names[i] = d->markers[i].name;
    }
    if (names == NULL) {
        (void)mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    return names;
}

static mhe_status write_markers(recorder *r, mhe_error *err) {
    const mhe_description *d = r->model;
    mhe_sink *sink = NULL;
    const char **names = marker_names(r, err);
    if (names == NULL) {
        return MHE_E_MEMORY;
    }
    mhe_status status = mhe_sink_trc(r->outbox, "markers.trc", names, d->n_markers, r->markers.rate,
                                     1e-3, "mm", &sink, err);
    return status == MHE_OK ? write_rows(&r->markers, sink, err) : status;
}

static mhe_status write_emg(recorder *r, mhe_error *err) {
    const mhe_description *d = r->model;
    mhe_sink *sink = NULL;
    const char **names = MHI_TAKE(&r->arena, const char *, d->n_muscles);
    if (names == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < d->n_muscles; i++) {
        names[i] = d->muscles[i].name;
    }
    mhe_status status =
        mhe_sink_sto(r->outbox, "emg.sto", "EMG, normalised", names, d->n_muscles, &sink, err);
    return status == MHE_OK ? write_rows(&r->emg, sink, err) : status;
}

/* Markers and raw EMG; the frames that both last for. */
static mhe_status write_recording(recorder *r, mhe_error *err) {
    const mhi_record *markers = &r->markers, *emg = &r->raw_emg;
    const double per_frame = round(emg->rate / markers->rate);
    if (fabs(emg->rate / markers->rate - per_frame) > 1e-6 || per_frame < 1) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "noise: raw_emg.rate (%g Hz) must be a multiple of the markers' rate (%g "
                        "Hz)",
                        emg->rate, markers->rate);
    }
    const int32_t n_emg = emg->n_samples / (int32_t)per_frame;
    const mhi_c3d_content content = {.markers = marker_names(r, err),
                                     .channels = r->config->noise.raw_emg.electrodes.keys,
                                     .unit = "V",
                                     .n_markers = r->model->n_markers,
                                     .n_channels = emg->n_channels,
                                     .n_frames =
                                         markers->n_samples < n_emg ? markers->n_samples : n_emg,
                                     .per_frame = (int32_t)per_frame,
                                     .rate = markers->rate,
                                     .first = markers->time[0],
                                     .points = markers->values,
                                     .analog = emg->values};
    return content.markers == NULL ? MHE_E_MEMORY
                                   : mhi_outbox_c3d(r->outbox, "recording.c3d", &content, err);
}

static mhe_status write_config(recorder *r, mhe_error *err) {
    mhi_text text = {0};
    mhi_noise_config_write(r->config, &text);
    mhe_status status = text.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                                    : mhe_outbox_text(r->outbox, "noise.yaml", text.data, err);
    mhi_text_free(&text);
    return status;
}

/* noise.yaml in the folder may be the very config, with its owner's words in it. */
static mhe_status claim_folder(recorder *r, const char *out, mhe_error *err) {
    static const char *const names[] = {"markers.trc", "emg.sto",  "recording.c3d",
                                        "noise.yaml",  "noise.gp", "noise.svg"};
    mhe_status status = mhe_outbox_open(out, &r->outbox, err);
    if (status == MHE_OK) {
        status = mhe_outbox_claim(r->outbox, names, (int32_t)(sizeof names / sizeof names[0]), err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_spare(r->outbox, r->config->run->path, err);
    }
    return status == MHE_OK ? mhe_outbox_spare(r->outbox, r->config->reference, err) : status;
}

/* A recording without its picture is complete. */
static void draw(recorder *r, const char *out) {
    mhe_error why = {0};
    if (r->config->output.picture &&
        noise_picture(r->config, r->reference, r->model, out, &why) != MHE_OK) {
        r->host->log(r->host, MHE_LOG_WARNING, why.text);
    }
}

mhe_status noise_record(const mhi_noise_config *config, const mhe_host *host, const char *out,
                        mhe_error *err) {
    recorder r = {.config = config, .host = host};
    mhe_status status = claim_folder(&r, out, err);
    if (status == MHE_OK) {
        status = record(&r, err);
    }
    if (status == MHE_OK) {
        status = write_markers(&r, err);
    }
    if (status == MHE_OK) {
        status = write_emg(&r, err);
    }
    if (status == MHE_OK && r.raw_emg.n_channels > 0) {
        status = write_recording(&r, err);
    }
    if (status == MHE_OK) {
        status = write_config(&r, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_commit(r.outbox, err);
    }
    if (status == MHE_OK) {
        draw(&r, out);
    }
    mhe_outbox_close(r.outbox);
    mhi_record_free(&r.markers);
    mhi_record_free(&r.emg);
    mhi_record_free(&r.raw_emg);
    mhi_recording_free(r.reference);
    mhi_description_free(r.model);
    mhi_arena_free(&r.arena);
    return status;
}
