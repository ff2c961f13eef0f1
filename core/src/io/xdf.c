/* SPDX-License-Identifier: Apache-2.0 */
/* xdf.c: the chunks of an .xdf file. */
#include "io/xdf.h"

#include "io/slurp.h"
#include "io/xdf_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { TAG_FILE_HEADER = 1, TAG_STREAM_HEADER, TAG_SAMPLES, TAG_CLOCK_OFFSET, TAG_BOUNDARY };

#define LATEST 1e12 /* s: no clock is beyond */

size_t mhi_xdf_left(const mhi_xdf_cursor *c) {
    return (size_t)(c->end - c->at);
}

mhe_status mhi_xdf_no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

mhe_status mhi_xdf_wrong(const mhi_xdf_reader *r, const char *what) {
    return mhe_fail(r->err, MHE_E_INPUT, "%s: %s", r->xdf->path, what);
}

void mhi_xdf_warn(mhi_xdf *xdf, const char *text) {
    char **grown = realloc(xdf->warnings, sizeof *grown * (size_t)(xdf->n_warnings + 1));
    if (grown == NULL) {
        return;
    }
    xdf->warnings = grown;
    char line[MHE_ERROR_TEXT];
    (void)snprintf(line, sizeof line, "%.180s: %s", xdf->path, text);
    grown[xdf->n_warnings] = strdup(line);
    xdf->n_warnings += grown[xdf->n_warnings] != NULL;
}

/* Little-endian, whatever the machine; 0: too few bytes are left. */
int mhi_xdf_integer(mhi_xdf_cursor *c, size_t bytes, uint64_t *value) {
    if (mhi_xdf_left(c) < bytes) {
        return 0;
    }
    *value = 0;
    for (size_t i = bytes; i-- > 0;) {
        *value = *value << 8 | c->at[i];
    }
    c->at += bytes;
    return 1;
}

static int take_double(mhi_xdf_cursor *c, double *value) {
    uint64_t bits;
    if (!mhi_xdf_integer(c, 8, &bits)) {
        return 0;
    }
    memcpy(value, &bits, sizeof *value);
    return 1;
}

/* A length: a byte that says how many bytes follow it (1, 4 or 8), then these. */
static int take_length(mhi_xdf_cursor *c, uint64_t *value) {
    uint64_t bytes;
    return mhi_xdf_integer(c, 1, &bytes) && (bytes == 1 || bytes == 4 || bytes == 8) &&
           mhi_xdf_integer(c, bytes, value);
}

mhi_xdf_stream *mhi_xdf_find(const mhi_xdf *xdf, uint64_t id) {
    for (int32_t i = 0; i < xdf->n_streams; i++) {
        if (xdf->streams[i].id == id) {
            return &xdf->streams[i];
        }
    }
    return NULL;
}

/* ---- samples ---- */

static size_t sample_bytes(int32_t format) {
    static const size_t bytes[] = {4, 8, 1, 2, 4, 8, 0};
    return bytes[format];
}

static int take_value(mhi_xdf_cursor *c, int32_t format, double *value) {
    uint64_t bits;
    if (!mhi_xdf_integer(c, sample_bytes(format), &bits)) {
        return 0;
    }
    switch (format) {
    case MHI_XDF_FLOAT32: {
        const uint32_t low = (uint32_t)bits;
        float narrow;
        memcpy(&narrow, &low, sizeof narrow);
        *value = (double)narrow;
        break;
    }
    case MHI_XDF_DOUBLE64:
        memcpy(value, &bits, sizeof *value);
        break;
    case MHI_XDF_INT8:
        *value = (int8_t)bits;
        break;
    case MHI_XDF_INT16:
        *value = (int16_t)bits;
        break;
    case MHI_XDF_INT32:
        *value = (int32_t)bits;
        break;
    default:
        *value = (double)(int64_t)bits;
        break;
    }
    return 1;
}

static int take_text(mhi_xdf_cursor *c, char **text) {
    uint64_t length;
    if (!take_length(c, &length) || length > mhi_xdf_left(c)) {
        return 0;
    }
    *text = strndup((const char *)c->at, length);
    c->at += length;
    return 1;
}

static mhe_status grow(mhi_xdf_stream *s, int64_t more, mhe_error *err) {
    const int64_t n = s->n_samples + more;
    if (n <= s->samples_capacity) {
        return MHE_OK;
    }
    const int64_t capacity = n > 2 * s->samples_capacity ? n : 2 * s->samples_capacity;
    const size_t width = (size_t)s->n_channels + 1; /* none is room for one */
    double *stamp = realloc(s->stamp, sizeof *stamp * (size_t)capacity);
    s->stamp = stamp == NULL ? s->stamp : stamp;
    const size_t bytes = s->format == MHI_XDF_STRING ? sizeof(char *) : sizeof(double);
    void **place = s->format == MHI_XDF_STRING ? (void **)&s->texts : (void **)&s->values;
    void *values = realloc(*place, bytes * width * (size_t)capacity);
    *place = values == NULL ? *place : values;
    if (stamp == NULL || values == NULL) {
        return mhi_xdf_no_memory(err);
    }
    s->samples_capacity = capacity;
    return MHE_OK;
}

/* One sample. 0: the chunk ends before it does. A stamp that is left out follows the last by the
 * nominal rate. */
static int take_sample(mhi_xdf_cursor *c, mhi_xdf_stream *s) {
    uint64_t stamped;
    const int64_t k = s->n_samples;
    double *stamp = &s->stamp[k];
    if (!mhi_xdf_integer(c, 1, &stamped) || (stamped != 0 && stamped != 8)) {
        return 0;
    }
    if (stamped == 8) {
        if (!take_double(c, stamp)) {
            return 0;
        }
    } else {
        *stamp = (k > 0 ? s->stamp[k - 1] : 0) + (s->rate > 0 ? 1 / s->rate : 0);
    }
    for (int32_t i = 0; i < s->n_channels; i++) {
        const int64_t at = k * s->n_channels + i;
        if (s->format == MHI_XDF_STRING) {
            s->texts[at] = NULL;
        }
        if (!(s->format == MHI_XDF_STRING ? take_text(c, &s->texts[at])
                                          : take_value(c, s->format, &s->values[at]))) {
            for (int64_t j = k * s->n_channels; s->format == MHI_XDF_STRING && j < at; j++) {
                free(s->texts[j]);
            }
            return 0;
        }
    }
    s->n_samples = k + 1;
    return 1;
}

static mhe_status read_samples(const mhi_xdf_reader *r, mhi_xdf_cursor c) {
    uint64_t id, n;
    if (!mhi_xdf_integer(&c, 4, &id) || !take_length(&c, &n)) {
        return mhi_xdf_wrong(r, "a chunk of samples is cut short");
    }
    mhi_xdf_stream *s = mhi_xdf_find(r->xdf, id);
    if (s == NULL) {
        return mhi_xdf_wrong(r, "samples of a stream that has no header");
    }
    const size_t value = s->format == MHI_XDF_STRING ? 2 : sample_bytes(s->format); /* at least */
    if (n > mhi_xdf_left(&c) / (1 + value * (size_t)s->n_channels)) {
        return mhi_xdf_wrong(r, "a chunk promises more samples than it has bytes");
    }
    const mhe_status status = grow(s, (int64_t)n, r->err);
    for (uint64_t i = 0; i < n && status == MHE_OK; i++) {
        if (!take_sample(&c, s)) {
            return mhi_xdf_wrong(r, "a chunk of samples is cut short");
        }
    }
    return status;
}

static mhe_status read_offset(const mhi_xdf_reader *r, mhi_xdf_cursor c) {
    uint64_t id;
    double time, offset;
    if (!mhi_xdf_integer(&c, 4, &id) || !take_double(&c, &time) || !take_double(&c, &offset)) {
        return mhi_xdf_wrong(r, "a clock offset is cut short");
    }
    mhi_xdf_stream *s = mhi_xdf_find(r->xdf, id);
    if (s == NULL || !(fabs(time) < LATEST) || !(fabs(offset) < LATEST)) {
        return MHE_OK; /* says nothing about any sample */
    }
    if (s->n_offsets == s->offsets_capacity) {
        const int64_t capacity = 2 * s->offsets_capacity + 16;
        double *times = realloc(s->offset_time, sizeof(double) * (size_t)capacity);
        s->offset_time = times == NULL ? s->offset_time : times;
        double *offsets = realloc(s->offset, sizeof(double) * (size_t)capacity);
        s->offset = offsets == NULL ? s->offset : offsets;
        if (times == NULL || offsets == NULL) {
            return mhi_xdf_no_memory(r->err);
        }
        s->offsets_capacity = capacity;
    }
    s->offset_time[s->n_offsets] = time;
    s->offset[s->n_offsets++] = offset;
    return MHE_OK;
}

/* ---- the file ---- */

static mhe_status read_chunks(const mhi_xdf_reader *r, mhi_xdf_cursor c) {
    mhe_status status = MHE_OK;
    while (status == MHE_OK && mhi_xdf_left(&c) > 0) {
        uint64_t length, tag;
        if (!take_length(&c, &length) || length < 2 || length > mhi_xdf_left(&c)) {
            mhi_xdf_warn(r->xdf, "the file ends within a chunk: what stands before is taken");
            break;
        }
        mhi_xdf_cursor content = {c.at, c.at + length};
        c.at += length;
        (void)mhi_xdf_integer(&content, 2, &tag);
        if (tag == TAG_STREAM_HEADER) {
            status = mhi_xdf_header(r, content);
        } else if (tag == TAG_SAMPLES) {
            status = read_samples(r, content);
        } else if (tag == TAG_CLOCK_OFFSET) {
            status = read_offset(r, content);
        } /* file header, boundary and footers say nothing that samples do not */
    }
    return status;
}

static mhe_status check(const mhi_xdf_reader *r) {
    for (int32_t i = 0; i < r->xdf->n_streams; i++) {
        mhi_xdf_stream *s = &r->xdf->streams[i];
        for (int64_t k = 0; k < s->n_samples; k++) {
            if (!(fabs(s->stamp[k]) < LATEST)) {
                return mhi_xdf_wrong(r, "a stamp is no time in seconds");
            }
        }
        const mhe_status status = mhi_xdf_synchronise(s, r->err);
        if (status != MHE_OK) {
            return status;
        }
    }
    return MHE_OK;
}

mhe_status mhi_xdf_parse(const char *name, const char *data, size_t length, mhi_xdf **out,
                         mhe_error *err) {
    *out = NULL;
    mhi_xdf *xdf = calloc(1, sizeof *xdf);
    if (xdf == NULL || (xdf->path = strdup(name)) == NULL) {
        free(xdf);
        return mhi_xdf_no_memory(err);
    }
    const mhi_xdf_reader r = {xdf, err};
    const uint8_t *bytes = (const uint8_t *)data;
    mhe_status status = MHE_OK;
    if (length < 4 || memcmp(data, "XDF:", 4) != 0) {
        status = mhi_xdf_wrong(&r, "not an .xdf file: it does not begin with 'XDF:'");
    } else {
        status = read_chunks(&r, (mhi_xdf_cursor){bytes + 4, bytes + length});
    }
    if (status == MHE_OK) {
        status = check(&r);
    }
    if (status != MHE_OK) {
        mhi_xdf_free(xdf);
        return status;
    }
    *out = xdf;
    return MHE_OK;
}

mhe_status mhi_xdf_read(const char *path, mhi_xdf **xdf, mhe_error *err) {
    char *data = NULL;
    size_t length = 0;
    *xdf = NULL;
    mhe_status status = mhi_slurp(path, &data, &length, err);
    if (status == MHE_OK) {
        status = mhi_xdf_parse(path, data, length, xdf, err);
    }
    free(data);
    return status;
}

static void free_stream(mhi_xdf_stream *s) {
    for (int32_t i = 0; i < s->n_channels && s->channels != NULL; i++) {
        free(s->channels[i].label);
        free(s->channels[i].unit);
        free(s->channels[i].type);
        free(s->channels[i].marker);
    }
    for (int64_t i = 0; i < s->n_samples * s->n_channels && s->texts != NULL; i++) {
        free(s->texts[i]);
    }
    free(s->channels);
    free(s->name);
    free(s->type);
    free(s->source_id);
    free(s->time);
    free(s->stamp);
    free(s->values);
    free(s->texts);
    free(s->offset_time);
    free(s->offset);
}

void mhi_xdf_free(mhi_xdf *xdf) {
    if (xdf == NULL) {
        return;
    }
    for (int32_t i = 0; i < xdf->n_streams; i++) {
        free_stream(&xdf->streams[i]);
    }
    for (int32_t i = 0; i < xdf->n_warnings; i++) {
        free(xdf->warnings[i]);
    }
    free(xdf->streams);
    free(xdf->warnings);
    free(xdf->path);
    free(xdf);
}
