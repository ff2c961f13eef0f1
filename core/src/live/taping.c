/* SPDX-License-Identifier: Apache-2.0 */
#include "live/taping.h"

#include "live/recorded.h"
#include "live/xdf_write.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A stream of a source, and its number in the file. */
typedef struct entry {
    int32_t source, stream, n_channels;
    uint32_t id;
    double offset_told; /* s of the packet with which the clock's offset was written; -INFINITY */
} entry;

#define OFFSETS 5.0 /* s from one measured offset of a clock to the next, as recorders have it */

struct mhi_taping {
    mhi_xdf_writer *writer;
    char *path;
    uint32_t arrivals, frames, grants, descriptions, maxima;
    int64_t n_arrivals;
    int32_t n_entries, entries_room;
    entry *entries; /* one a description: a sender that comes again and again has many */
    double *stamps; /* [room] of samples that have none */
    int32_t room;
    double last; /* s, of the packet taken last */
};

static const mhi_xdf_column arrival_columns[MHI_ARRIVAL_COLUMNS] = {
    {.label = "stream", .unit = "1"},
    {.label = "samples", .unit = "1"},
    {.label = "received", .unit = "s"},
    {.label = "offset", .unit = "s"},
    {.label = "stamped", .unit = "1"}};
static const mhi_xdf_column frame_columns[MHI_FRAME_COLUMNS] = {
    {.label = "time", .unit = "s"},
    {.label = "status", .unit = "1"},
    {.label = "iterations", .unit = "1"}};

static const mhi_xdf_column grant_columns[MHI_GRANT_COLUMNS] = {
    {.label = "arrival", .unit = "1"},   {.label = "prepared", .unit = "1"},
    {.label = "by_clock", .unit = "1"},  {.label = "refused", .unit = "1"},
    {.label = "in_time", .unit = "1"},   {.label = "late", .unit = "1"},
    {.label = "in_time_2", .unit = "1"}, {.label = "late_2", .unit = "1"},
    {.label = "in_time_3", .unit = "1"}, {.label = "late_3", .unit = "1"},
    {.label = "in_time_4", .unit = "1"}, {.label = "late_4", .unit = "1"}};
static const mhi_xdf_column description_columns[MHI_DESCRIPTION_COLUMNS] = {
    {.label = "id", .unit = "1"},
    {.label = "source", .unit = "1"},
    {.label = "stream", .unit = "1"},
    {.label = "arrivals", .unit = "1"},
    {.label = "delay", .unit = "s"}};

static const mhi_xdf_column maximum_columns[MHI_MAXIMUM_COLUMNS] = {
    {.label = "arrivals", .unit = "1"}, {.label = "channel", .unit = "1"}, {.label = "maximum"}};

static mhe_status add_our_streams(mhi_taping *r, const char *title, mhe_error *err) {
    const struct {
        const char *type;
        const mhi_xdf_column *columns;
        int32_t n;
        uint32_t *id;
    } ours[] = {{MHI_ARRIVALS, arrival_columns, MHI_ARRIVAL_COLUMNS, &r->arrivals},
                {MHI_FRAMES, frame_columns, MHI_FRAME_COLUMNS, &r->frames},
                {MHI_GRANTS, grant_columns, MHI_GRANT_COLUMNS, &r->grants},
                {MHI_DESCRIPTIONS, description_columns, MHI_DESCRIPTION_COLUMNS, &r->descriptions},
                {MHI_MAXIMA, maximum_columns, MHI_MAXIMUM_COLUMNS, &r->maxima}};
    mhe_status status = MHE_OK;
    for (size_t i = 0; i < sizeof ours / sizeof *ours && status == MHE_OK; i++) {
        status = mhi_xdf_add_stream(r->writer, title, ours[i].type, 0, ours[i].columns, ours[i].n,
                                    NULL, ours[i].id, err);
    }
    return status;
}

mhe_status mhi_taping_open(const char *path, const char *title, mhi_taping **record,
                           mhe_error *err) {
    *record = NULL;
    mhi_taping *r = calloc(1, sizeof *r);
    if (r == NULL || (r->path = strdup(path)) == NULL) {
        free(r);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = mhi_xdf_create(path, &r->writer, err);
    if (status == MHE_OK) {
        status = add_our_streams(r, title, err);
    }
    if (status != MHE_OK) {
        (void)mhi_taping_close(r, NULL);
        return status;
    }
    *record = r;
    return MHE_OK;
}

static entry *find(mhi_taping *r, const mhi_packet *p) {
    for (int32_t i = r->n_entries; i-- > 0;) { /* the newest description counts */
        if (r->entries[i].source == p->source && r->entries[i].stream == p->stream) {
            return &r->entries[i];
        }
    }
    return NULL;
}

/* For one more; 0: no memory. */
static int32_t make_room(mhi_taping *r) {
    if (r->n_entries < r->entries_room) {
        return 1;
    }
    const int32_t room = 2 * r->entries_room + 16;
    entry *grown = realloc(r->entries, sizeof *grown * (size_t)room);
    if (grown != NULL) {
        r->entries = grown;
        r->entries_room = room;
    }
    return grown != NULL;
}

/* Markers keep their axes as the community describes them. */
static mhe_status add_stream(mhi_taping *r, const mhi_packet *p, mhe_error *err) {
    static const char *const types[] = {"", "MoCap", "EMG", "Angles"};
    static const char *const axes[] = {"PositionX", "PositionY", "PositionZ"};
    const mhi_stream *s = p->about;
    mhi_xdf_column *columns = calloc((size_t)s->n_channels + 1, sizeof *columns);
    if (columns == NULL || !make_room(r)) {
        free(columns);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < s->n_channels; i++) {
        columns[i].label = s->labels[i];
        columns[i].unit = s->units[i];
        columns[i].named = s->named[i] ? "1" : NULL;
        columns[i].type = s->kind == MHE_STREAM_MARKERS ? axes[i % 3] : NULL;
    }
    entry *e = &r->entries[r->n_entries++];
    *e = (entry){p->source, p->stream, s->n_channels, 0, -INFINITY};
    mhe_status status = mhi_xdf_add_stream(r->writer, s->name, types[s->kind & 3], s->rate, columns,
                                           s->n_channels, NULL, &e->id, err);
    free(columns);
    const double row[MHI_DESCRIPTION_COLUMNS] = {e->id, p->source, p->stream, (double)r->n_arrivals,
                                                 s->delay};
    if (status == MHE_OK) {
        status =
            mhi_xdf_put(r->writer, r->descriptions, MHI_DESCRIPTION_COLUMNS, 1, &r->last, row, err);
    }
    return status;
}

static mhe_status add_samples(mhi_taping *r, const mhi_packet *p, mhe_error *err) {
    entry *e = find(r, p);
    if (e == NULL || e->n_channels != p->n_channels) {
        return MHE_OK;
    }
    const double *stamps = p->stamp;
    if (stamps == NULL && p->n > r->room) {
        double *grown = realloc(r->stamps, sizeof *grown * (size_t)p->n);
        if (grown == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        r->stamps = grown;
        r->room = p->n;
    }
    for (int32_t k = 0; k < p->n && stamps == NULL; k++) {
        r->stamps[k] = p->received;
    }
    const double row[MHI_ARRIVAL_COLUMNS] = {e->id, p->n, p->received, p->offset, stamps != NULL};
    mhe_status status = mhi_xdf_put(r->writer, e->id, p->n_channels, p->n,
                                    stamps == NULL ? r->stamps : stamps, p->values, err);
    if (status == MHE_OK && stamps != NULL && isfinite(p->offset) &&
        p->received - e->offset_told >= OFFSETS) {
        status = mhi_xdf_put_offset(r->writer, e->id, stamps[0], p->offset, err);
        e->offset_told = p->received;
    }
    r->n_arrivals++;
    r->last = p->received;
    if (status == MHE_OK) {
        status =
            mhi_xdf_put(r->writer, r->arrivals, MHI_ARRIVAL_COLUMNS, 1, &p->received, row, err);
    }
    return status;
}

mhe_status mhi_taping_take(mhi_taping *r, const mhi_packet *p, mhe_error *err) {
    return p->kind == MHI_PACKET_STREAM    ? add_stream(r, p, err)
           : p->kind == MHI_PACKET_SAMPLES ? add_samples(r, p, err)
                                           : MHE_OK;
}

mhe_status mhi_taping_frame(mhi_taping *r, const mhe_estimate *estimate, double host_time,
                            mhe_error *err) {
    const double row[MHI_FRAME_COLUMNS] = {estimate->time, estimate->status, estimate->iterations};
    return mhi_xdf_put(r->writer, r->frames, MHI_FRAME_COLUMNS, 1, &host_time, row, err);
}

mhe_status mhi_taping_grant(mhi_taping *r, const mhe_grant *grant, double host_time,
                            mhe_error *err) {
    double row[MHI_GRANT_COLUMNS] = {(double)(r->n_arrivals - 1), grant->prepared, grant->by_clock,
                                     grant->refused};
    for (int32_t i = 0; i < MHE_GRANT_LOOKS; i++) {
        row[4 + i] = grant->looks[i];
    }
    return mhi_xdf_put(r->writer, r->grants, MHI_GRANT_COLUMNS, 1, &host_time, row, err);
}

mhe_status mhi_taping_maximum(mhi_taping *r, int32_t channel, double value, mhe_error *err) {
    const double row[MHI_MAXIMUM_COLUMNS] = {(double)r->n_arrivals, channel, value};
    return mhi_xdf_put(r->writer, r->maxima, MHI_MAXIMUM_COLUMNS, 1, &r->last, row, err);
}

const char *mhi_taping_path(const mhi_taping *r) {
    return r->path;
}

mhe_status mhi_taping_close(mhi_taping *r, mhe_error *err) {
    if (r == NULL) {
        return MHE_OK;
    }
    const mhe_status status = mhi_xdf_close(r->writer, err);
    free(r->stamps);
    free(r->entries);
    free(r->path);
    free(r);
    return status;
}
