/* SPDX-License-Identifier: Apache-2.0 */
/* recorded.c: the host's service that reads recordings as streams. */
#include "live/recorded.h"

#include "io/motion_file.h"
#include "io/xdf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* What is handed out, and what it stands on. */
typedef struct owned {
    mhe_recorded face; /* first: its address is that of the whole */
    mhi_xdf *xdf;
    mhi_table *table;
    mhe_recorded_stream *streams;
    mhe_arrival *arrivals;
    mhe_grant *grants;
    mhe_maximum *maxima;
    uint8_t **named; /* [n_streams][channels] */
    char ***labels;  /* [n_streams][channels], its own */
    const char ***units;
    int32_t *n_labels;
} owned;

static void recorded_free(const mhe_recorded *recorded) {
    owned *o = (owned *)(void *)(uintptr_t)recorded;
    if (o == NULL) {
        return;
    }
    for (int32_t i = 0; i < o->face.n_streams; i++) {
        for (int32_t k = 0; o->labels != NULL && o->labels[i] != NULL && k < o->n_labels[i]; k++) {
            free(o->labels[i][k]);
        }
        free(o->labels == NULL ? NULL : o->labels[i]);
        free(o->units == NULL ? NULL : (void *)o->units[i]);
        free(o->named == NULL ? NULL : o->named[i]);
    }
    free(o->labels);
    free((void *)o->units);
    free(o->named);
    free(o->n_labels);
    free(o->streams);
    free(o->arrivals);
    free(o->grants);
    free(o->maxima);
    mhi_table_free(o->table);
    mhi_xdf_free(o->xdf);
    free(o);
}

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

static mhe_status take_room(owned *o, int32_t n, mhe_error *err) {
    o->streams = calloc((size_t)n + 1, sizeof *o->streams);
    o->labels = calloc((size_t)n + 1, sizeof *o->labels);
    o->units = calloc((size_t)n + 1, sizeof *o->units);
    o->n_labels = calloc((size_t)n + 1, sizeof *o->n_labels);
    o->named = calloc((size_t)n + 1, sizeof *o->named);
    return o->streams == NULL || o->labels == NULL || o->units == NULL || o->n_labels == NULL ||
                   o->named == NULL
               ? no_memory(err)
               : MHE_OK;
}

/* Room for the n labels of the stream that comes next. */
static mhe_status begin_stream(owned *o, int32_t n, mhe_error *err) {
    const int32_t i = o->face.n_streams++;
    o->labels[i] = calloc((size_t)n + 1, sizeof *o->labels[i]);
    o->units[i] = calloc((size_t)n + 1, sizeof *o->units[i]);
    o->named[i] = calloc((size_t)n + 1, 1);
    o->n_labels[i] = n;
    return o->labels[i] == NULL || o->units[i] == NULL || o->named[i] == NULL ? no_memory(err)
                                                                              : MHE_OK;
}

/* ---- .trc, .sto ... ---- */

static mhe_status from_table(owned *o, int32_t kind, mhe_error *err) {
    const mhi_table *t = o->table;
    const int32_t per_label = kind == MHE_STREAM_MARKERS ? 3 : 1;
    mhe_status status = take_room(o, 1, err);
    if (status == MHE_OK) {
        status = begin_stream(o, t->n_columns, err);
    }
    for (int32_t i = 0; i < t->n_columns && status == MHE_OK; i++) {
        const char *label = t->labels[i / per_label];
        const size_t room = strlen(label) + 3;
        o->labels[0][i] = malloc(room);
        o->units[0][i] = kind == MHE_STREAM_MARKERS                   ? "m"
                         : kind == MHE_STREAM_ANGLES && t->in_degrees ? "deg"
                                                                      : "";
        if (o->labels[0][i] == NULL) {
            return no_memory(err);
        }
        (void)snprintf(o->labels[0][i], room, per_label == 3 ? "%s.%c" : "%s", label, "xyz"[i % 3]);
    }
    if (status == MHE_OK) {
        o->streams[0] = (mhe_recorded_stream){.about = {.size = sizeof(mhe_stream_info),
                                                        .kind = kind,
                                                        .name = t->path,
                                                        .n_channels = t->n_columns,
                                                        .labels = (const char *const *)o->labels[0],
                                                        .units = o->units[0],
                                                        .rate = t->rate,
                                                        .up = -1},
                                              .replaces = -1,
                                              .n = t->n_rows,
                                              .stamp = t->time,
                                              .values = t->values};
    }
    return status;
}

/* ---- .xdf ---- */

static int32_t kind_of(const mhi_xdf_stream *s) {
    return strcasecmp(s->type, "MoCap") == 0    ? MHE_STREAM_MARKERS
           : strcasecmp(s->type, "EMG") == 0    ? MHE_STREAM_EMG
           : strcasecmp(s->type, "Angles") == 0 ? MHE_STREAM_ANGLES
                                                : MHE_STREAM_OTHER;
}

static mhe_status add_xdf_stream(owned *o, const mhi_xdf_stream *s, int as_it_came,
                                 mhe_error *err) {
    const int32_t i = o->face.n_streams;
    mhe_status status = begin_stream(o, s->n_channels, err);
    for (int32_t k = 0; k < s->n_channels && status == MHE_OK; k++) {
        o->labels[i][k] = strdup(s->channels[k].label);
        o->units[i][k] = s->channels[k].unit;
        o->named[i][k] = s->channels[k].named != 0;
        status = o->labels[i][k] == NULL ? no_memory(err) : MHE_OK;
    }
    if (status == MHE_OK) {
        o->streams[i] = (mhe_recorded_stream){.about = {.size = sizeof(mhe_stream_info),
                                                        .kind = kind_of(s),
                                                        .name = s->name,
                                                        .n_channels = s->n_channels,
                                                        .labels = (const char *const *)o->labels[i],
                                                        .units = o->units[i],
                                                        .rate = s->rate,
                                                        .up = -1,
                                                        .named = o->named[i]},
                                              .replaces = -1,
                                              .n = s->n_samples,
                                              .stamp = as_it_came ? s->stamp : s->time,
                                              .values = s->values};
    }
    return status;
}

/* One of the streams that we add to what came; NULL: it is no recording of ours. */
static const mhi_xdf_stream *find_ours(const mhi_xdf *xdf, const char *type, int32_t n_columns) {
    for (int32_t i = 0; i < xdf->n_streams; i++) {
        const mhi_xdf_stream *s = &xdf->streams[i];
        if (strcmp(s->type, type) == 0 && s->n_channels == n_columns && s->values != NULL) {
            return s;
        }
    }
    return NULL;
}

static int32_t whole(double value, double least, double most) {
    return value >= least && value <= most ? (int32_t)value : (int32_t)least;
}

/* What frames were granted, in the order of their packets. */
static mhe_status take_grants(owned *o, mhe_error *err) {
    const mhi_xdf_stream *s = find_ours(o->xdf, MHI_GRANTS, MHI_GRANT_COLUMNS);
    if (s == NULL) {
        return MHE_OK;
    }
    o->grants = calloc((size_t)s->n_samples + 1, sizeof *o->grants);
    if (o->grants == NULL) {
        return no_memory(err);
    }
    int64_t last = 0;
    for (int64_t k = 0; k < s->n_samples; k++) {
        const double *row = s->values + k * MHI_GRANT_COLUMNS;
        mhe_grant *g = &o->grants[k];
        if (!(row[0] >= (double)last && row[0] < (double)o->face.n_arrivals)) {
            return mhe_fail(err, MHE_E_INPUT, "%s: frame %lld is of no packet that is there",
                            o->xdf->path, (long long)k);
        }
        last = (int64_t)row[0];
        *g = (mhe_grant){last,
                         whole(row[1], 0, MHE_GRANT_STOPPED),
                         row[2] != 0,
                         whole(row[3], -1, INT32_MAX),
                         {0}};
        for (int32_t i = 0; i < MHE_GRANT_LOOKS; i++) {
            g->looks[i] = whole(row[4 + i], 0, INT32_MAX);
        }
    }
    o->face.grants = o->grants;
    o->face.n_grants = s->n_samples;
    return MHE_OK;
}

/* Maxima of electrodes that were found meanwhile. */
static mhe_status take_maxima(owned *o, mhe_error *err) {
    const mhi_xdf_stream *s = find_ours(o->xdf, MHI_MAXIMA, MHI_MAXIMUM_COLUMNS);
    if (s == NULL) {
        return MHE_OK;
    }
    o->maxima = calloc((size_t)s->n_samples + 1, sizeof *o->maxima);
    if (o->maxima == NULL) {
        return no_memory(err);
    }
    double last = 0;
    for (int64_t k = 0; k < s->n_samples; k++) {
        const double *row = s->values + k * MHI_MAXIMUM_COLUMNS;
        if (!(row[0] >= last && row[0] <= (double)o->face.n_arrivals) || !(row[2] > 0)) {
            return mhe_fail(err, MHE_E_INPUT, "%s: maximum %lld is none, or of no packet",
                            o->xdf->path, (long long)k);
        }
        last = row[0];
        o->maxima[k] = (mhe_maximum){(int64_t)row[0], row[2], whole(row[1], -1, INT32_MAX)};
    }
    o->face.maxima = o->maxima;
    o->face.n_maxima = s->n_samples;
    return MHE_OK;
}

/* A stream that was described again is another from then on. */
static void take_descriptions(owned *o, const int32_t *number, uint32_t most) {
    const mhi_xdf_stream *s = find_ours(o->xdf, MHI_DESCRIPTIONS, MHI_DESCRIPTION_COLUMNS);
    for (int64_t k = 0; s != NULL && k < s->n_samples; k++) {
        const double *row = s->values + k * MHI_DESCRIPTION_COLUMNS;
        const int32_t i = row[0] >= 1 && row[0] <= most ? number[(uint32_t)row[0]] : -1;
        if (i < 0) {
            continue;
        }
        mhe_recorded_stream *stream = &o->streams[i];
        stream->about.delay = isfinite(row[4]) ? row[4] : 0;
        stream->from = row[3] >= 0 && row[3] <= 9e15 ? (int64_t)row[3] : 0;
        for (int64_t before = k; before-- > 0 && stream->replaces < 0;) {
            const double *other = s->values + before * MHI_DESCRIPTION_COLUMNS;
            if (other[1] == row[1] && other[2] == row[2] && other[0] >= 1 && other[0] <= most) {
                const int32_t j = number[(uint32_t)other[0]];
                stream->replaces = j < i ? j : -1; /* streams stand in the order of their numbers */
            }
        }
    }
}

static mhe_status take_arrivals(owned *o, const mhi_xdf_stream *a, const int32_t *number,
                                uint32_t most, mhe_error *err) {
    o->arrivals = calloc((size_t)a->n_samples + 1, sizeof *o->arrivals);
    if (o->arrivals == NULL) {
        return no_memory(err);
    }
    for (int64_t k = 0; k < a->n_samples; k++) {
        const double *row = a->values + k * MHI_ARRIVAL_COLUMNS;
        const int known = row[0] >= 1 && row[0] <= most && number[(uint32_t)row[0]] >= 0;
        if (!known || !(row[1] >= 1 && row[1] <= 1e9)) {
            return mhe_fail(err, MHE_E_INPUT, "%s: arrival %lld is of no stream that is there",
                            o->xdf->path, (long long)k);
        }
        o->arrivals[k] =
            (mhe_arrival){number[(uint32_t)row[0]], (int32_t)row[1], row[2], row[3], row[4] != 0};
    }
    o->face.arrivals = o->arrivals;
    o->face.n_arrivals = a->n_samples;
    return MHE_OK;
}

static mhe_status from_xdf(owned *o, mhe_error *err) {
    const mhi_xdf_stream *arrivals = find_ours(o->xdf, MHI_ARRIVALS, MHI_ARRIVAL_COLUMNS);
    uint32_t most = 0;
    for (int32_t i = 0; i < o->xdf->n_streams; i++) {
        most = o->xdf->streams[i].id > most ? o->xdf->streams[i].id : most;
    }
    int32_t *number = most > 1u << 20 ? NULL : malloc(sizeof *number * ((size_t)most + 1));
    mhe_status status = number == NULL ? no_memory(err) : take_room(o, o->xdf->n_streams, err);
    for (uint32_t k = 0; number != NULL && k <= most; k++) {
        number[k] = -1;
    }
    for (int32_t i = 0; i < o->xdf->n_streams && status == MHE_OK; i++) {
        const mhi_xdf_stream *s = &o->xdf->streams[i];
        if (s->format != MHI_XDF_STRING && s->n_channels > 0 && strncmp(s->type, "mhe-", 4) != 0) {
            number[s->id] = o->face.n_streams;
            status = add_xdf_stream(o, s, arrivals != NULL, err);
        }
    }
    if (status == MHE_OK && o->face.n_streams == 0) {
        status = mhe_fail(err, MHE_E_INPUT, "%s: holds no stream of numbers", o->xdf->path);
    }
    if (status == MHE_OK && arrivals != NULL) {
        status = take_arrivals(o, arrivals, number, most, err);
        status = status == MHE_OK ? take_grants(o, err) : status;
        status = status == MHE_OK ? take_maxima(o, err) : status;
        take_descriptions(o, number, most);
    }
    free(number);
    return status;
}

static mhe_status recorded_read(const char *path, int32_t kind, const mhe_recorded **out,
                                mhe_error *err) {
    const char *dot = strrchr(path, '.');
    owned *o = calloc(1, sizeof *o);
    *out = NULL;
    if (o == NULL) {
        return no_memory(err);
    }
    o->face.size = sizeof o->face;
    o->face.stream_size = sizeof *o->streams;
    o->face.arrival_size = sizeof *o->arrivals;
    o->face.grant_size = sizeof *o->grants;
    o->face.maximum_size = sizeof *o->maxima;
    mhe_status status;
    if (dot != NULL && strcasecmp(dot, ".xdf") == 0) {
        status = mhi_xdf_read(path, &o->xdf, err);
        status = status == MHE_OK ? from_xdf(o, err) : status;
    } else {
        status = kind == MHE_STREAM_MARKERS ? mhi_markers_read(path, &o->table, err)
                                            : mhi_signals_read(path, &o->table, err);
        status = status == MHE_OK ? from_table(o, kind, err) : status;
    }
    o->face.streams = o->streams;
    if (status != MHE_OK) {
        recorded_free(&o->face);
        return status;
    }
    *out = &o->face;
    return MHE_OK;
}

const mhe_recorded_service mhi_recorded_service = {
    .size = sizeof mhi_recorded_service, .read = recorded_read, .free = recorded_free};
