/* SPDX-License-Identifier: Apache-2.0 */
/* xdf.c: the chunks of an .xdf file. */
#include "io/xdf.h"

#include "base/number.h"
#include "io/slurp.h"

#include <libxml/parser.h>
#include <libxml/tree.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { TAG_FILE_HEADER = 1, TAG_STREAM_HEADER, TAG_SAMPLES, TAG_CLOCK_OFFSET, TAG_BOUNDARY };

#define MOST_CHANNELS 4096
#define MOST_STREAMS 1024
#define LATEST 1e12 /* s: no clock is beyond */

/* Bytes that are still to be read. */
typedef struct cursor {
    const uint8_t *at, *end;
} cursor;

typedef struct reader {
    mhi_xdf *xdf;
    mhe_error *err;
} reader;

static size_t left(const cursor *c) {
    return (size_t)(c->end - c->at);
}

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

static mhe_status wrong(const reader *r, const char *what) {
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
static int take_integer(cursor *c, size_t bytes, uint64_t *value) {
    if (left(c) < bytes) {
        return 0;
    }
    *value = 0;
    for (size_t i = bytes; i-- > 0;) {
        *value = *value << 8 | c->at[i];
    }
    c->at += bytes;
    return 1;
}

static int take_double(cursor *c, double *value) {
    uint64_t bits;
    if (!take_integer(c, 8, &bits)) {
        return 0;
    }
    memcpy(value, &bits, sizeof *value);
    return 1;
}

/* A length: a byte that says how many bytes follow it (1, 4 or 8), then these. */
static int take_length(cursor *c, uint64_t *value) {
    uint64_t bytes;
    return take_integer(c, 1, &bytes) && (bytes == 1 || bytes == 4 || bytes == 8) &&
           take_integer(c, bytes, value);
}

/* ---- stream headers ---- */

static xmlNode *child(const xmlNode *parent, const char *name) {
    xmlNode *node = parent == NULL ? NULL : parent->children;
    while (node != NULL && xmlStrcmp(node->name, (const xmlChar *)name) != 0) {
        node = node->next;
    }
    return node;
}

/* Text of a child, "" where there is none; NULL: no memory. */
static char *text_of(const xmlNode *parent, const char *name) {
    const xmlNode *node = child(parent, name);
    xmlChar *content = node == NULL ? NULL : xmlNodeGetContent(node);
    char *text = strdup(content == NULL ? "" : (const char *)content);
    xmlFree(content);
    for (char *c = text; c != NULL && *c != '\0'; c++) {
        if ((unsigned char)*c < ' ') {
            *c = ' ';
        }
    }
    return text;
}

static double number_of(const xmlNode *parent, const char *name) {
    char *text = text_of(parent, name);
    double value = NAN;
    if (text != NULL) {
        const mhi_c_locale locale = mhi_c_locale_begin();
        const mhi_cell cell = {text, strlen(text)};
        if (!mhi_number(cell, &value)) {
            value = NAN;
        }
        mhi_c_locale_end(locale);
    }
    free(text);
    return value;
}

static int32_t format_of(const char *text) {
    static const char *const names[] = {"float32", "double64", "int8",  "int16",
                                        "int32",   "int64",    "string"};
    for (int32_t i = 0; i <= MHI_XDF_STRING; i++) {
        if (strcasecmp(text, names[i]) == 0) {
            return i;
        }
    }
    return -1;
}

static mhe_status read_channels(mhi_xdf_stream *s, const xmlNode *info, mhe_error *err) {
    const xmlNode *list = child(child(info, "desc"), "channels");
    const xmlNode *node = list == NULL ? NULL : list->children;
    s->channels = calloc((size_t)s->n_channels + 1, sizeof *s->channels);
    if (s->channels == NULL) {
        return no_memory(err);
    }
    for (int32_t i = 0; i < s->n_channels; i++) {
        while (node != NULL && xmlStrcmp(node->name, (const xmlChar *)"channel") != 0) {
            node = node->next;
        }
        mhi_xdf_channel *c = &s->channels[i];
        *c = (mhi_xdf_channel){text_of(node, "label"), text_of(node, "unit"), text_of(node, "type"),
                               text_of(node, "marker")};
        if (c->label == NULL || c->unit == NULL || c->type == NULL || c->marker == NULL) {
            return no_memory(err);
        }
        node = node == NULL ? NULL : node->next;
    }
    return MHE_OK;
}

static mhe_status read_info(const reader *r, mhi_xdf_stream *s, const xmlNode *info) {
    char *format = text_of(info, "channel_format");
    const double count = number_of(info, "channel_count");
    s->name = text_of(info, "name");
    s->type = text_of(info, "type");
    s->source_id = text_of(info, "source_id");
    s->format = format == NULL ? -1 : format_of(format);
    free(format);
    if (s->name == NULL || s->type == NULL || s->source_id == NULL) {
        return no_memory(r->err);
    }
    if (s->format < 0) {
        return wrong(r, "a stream header without a known channel_format");
    }
    if (!(count >= 0 && count <= MOST_CHANNELS) || count != floor(count)) {
        return wrong(r, "a stream header without a sensible channel_count");
    }
    s->n_channels = (int32_t)count;
    s->rate = number_of(info, "nominal_srate");
    s->rate = s->rate > 0 && s->rate < 1e7 ? s->rate : 0;
    return read_channels(s, info, r->err);
}

static mhi_xdf_stream *find_stream(const mhi_xdf *xdf, uint64_t id) {
    for (int32_t i = 0; i < xdf->n_streams; i++) {
        if (xdf->streams[i].id == id) {
            return &xdf->streams[i];
        }
    }
    return NULL;
}

static mhe_status read_header(const reader *r, cursor c) {
    uint64_t id;
    mhi_xdf *xdf = r->xdf;
    if (!take_integer(&c, 4, &id) || left(&c) > INT32_MAX) {
        return wrong(r, "a stream header is cut short");
    }
    if (find_stream(xdf, id) != NULL || xdf->n_streams == MOST_STREAMS) {
        return wrong(r, "a stream's header is there twice, or there are over a thousand streams");
    }
    mhi_xdf_stream *grown = realloc(xdf->streams, sizeof *grown * (size_t)(xdf->n_streams + 1));
    if (grown == NULL) {
        return no_memory(r->err);
    }
    xdf->streams = grown;
    mhi_xdf_stream *s = &grown[xdf->n_streams++];
    *s = (mhi_xdf_stream){.id = (uint32_t)id};
    xmlDoc *doc = xmlReadMemory((const char *)c.at, (int)left(&c), "stream header", NULL,
                                XML_PARSE_NONET | XML_PARSE_NOERROR | XML_PARSE_NOWARNING);
    const xmlNode *info = doc == NULL ? NULL : xmlDocGetRootElement(doc);
    const mhe_status status =
        info == NULL ? wrong(r, "a stream header is no valid XML") : read_info(r, s, info);
    xmlFreeDoc(doc);
    return status;
}

/* ---- samples ---- */

static size_t sample_bytes(int32_t format) {
    static const size_t bytes[] = {4, 8, 1, 2, 4, 8, 0};
    return bytes[format];
}

static int take_value(cursor *c, int32_t format, double *value) {
    uint64_t bits;
    if (!take_integer(c, sample_bytes(format), &bits)) {
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

static int take_text(cursor *c, char **text) {
    uint64_t length;
    if (!take_length(c, &length) || length > left(c)) {
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
        return no_memory(err);
    }
    s->samples_capacity = capacity;
    return MHE_OK;
}

/* One sample. 0: the chunk ends before it does. A stamp that is left out follows the last by the
 * nominal rate. */
static int take_sample(cursor *c, mhi_xdf_stream *s) {
    uint64_t stamped;
    const int64_t k = s->n_samples;
    double *stamp = &s->stamp[k];
    if (!take_integer(c, 1, &stamped) || (stamped != 0 && stamped != 8)) {
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

static mhe_status read_samples(const reader *r, cursor c) {
    uint64_t id, n;
    if (!take_integer(&c, 4, &id) || !take_length(&c, &n)) {
        return wrong(r, "a chunk of samples is cut short");
    }
    mhi_xdf_stream *s = find_stream(r->xdf, id);
    if (s == NULL) {
        return wrong(r, "samples of a stream that has no header");
    }
    const size_t value = s->format == MHI_XDF_STRING ? 2 : sample_bytes(s->format); /* at least */
    if (n > left(&c) / (1 + value * (size_t)s->n_channels)) {
        return wrong(r, "a chunk promises more samples than it has bytes");
    }
    const mhe_status status = grow(s, (int64_t)n, r->err);
    for (uint64_t i = 0; i < n && status == MHE_OK; i++) {
        if (!take_sample(&c, s)) {
            return wrong(r, "a chunk of samples is cut short");
        }
    }
    return status;
}

static mhe_status read_offset(const reader *r, cursor c) {
    uint64_t id;
    double time, offset;
    if (!take_integer(&c, 4, &id) || !take_double(&c, &time) || !take_double(&c, &offset)) {
        return wrong(r, "a clock offset is cut short");
    }
    mhi_xdf_stream *s = find_stream(r->xdf, id);
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
            return no_memory(r->err);
        }
        s->offsets_capacity = capacity;
    }
    s->offset_time[s->n_offsets] = time;
    s->offset[s->n_offsets++] = offset;
    return MHE_OK;
}

/* ---- the file ---- */

static mhe_status read_chunks(const reader *r, cursor c) {
    mhe_status status = MHE_OK;
    while (status == MHE_OK && left(&c) > 0) {
        uint64_t length, tag;
        if (!take_length(&c, &length) || length < 2 || length > left(&c)) {
            mhi_xdf_warn(r->xdf, "the file ends within a chunk: what stands before is taken");
            break;
        }
        cursor content = {c.at, c.at + length};
        c.at += length;
        (void)take_integer(&content, 2, &tag);
        if (tag == TAG_STREAM_HEADER) {
            status = read_header(r, content);
        } else if (tag == TAG_SAMPLES) {
            status = read_samples(r, content);
        } else if (tag == TAG_CLOCK_OFFSET) {
            status = read_offset(r, content);
        } /* file header, boundary and footers say nothing that samples do not */
    }
    return status;
}

static mhe_status check(const reader *r) {
    for (int32_t i = 0; i < r->xdf->n_streams; i++) {
        mhi_xdf_stream *s = &r->xdf->streams[i];
        for (int64_t k = 0; k < s->n_samples; k++) {
            if (!(fabs(s->stamp[k]) < LATEST)) {
                return wrong(r, "a stamp is no time in seconds");
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
        return no_memory(err);
    }
    const reader r = {xdf, err};
    const uint8_t *bytes = (const uint8_t *)data;
    mhe_status status = MHE_OK;
    if (length < 4 || memcmp(data, "XDF:", 4) != 0) {
        status = wrong(&r, "not an .xdf file: it does not begin with 'XDF:'");
    } else {
        status = read_chunks(&r, (cursor){bytes + 4, bytes + length});
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
