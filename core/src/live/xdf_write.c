/* SPDX-License-Identifier: Apache-2.0 */
#include "live/xdf_write.h"

#include "base/number.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define TAG_FILE_HEADER 1
#define TAG_STREAM_HEADER 2
#define TAG_SAMPLES 3
#define TAG_CLOCK_OFFSET 4

struct mhi_xdf_writer {
    int file;
    char *path;
    uint32_t n_streams;
    uint8_t *chunk; /* content in work */
    size_t n, room;
    int failed; /* out of memory within a chunk */
};

static void put(mhi_xdf_writer *w, const void *bytes, size_t n) {
    if (w->n + n > w->room) {
        const size_t room = 2 * (w->n + n) + 4096;
        uint8_t *grown = realloc(w->chunk, room);
        if (grown == NULL) {
            w->failed = 1;
            return;
        }
        w->chunk = grown;
        w->room = room;
    }
    memcpy(w->chunk + w->n, bytes, n);
    w->n += n;
}

static void put_integer(mhi_xdf_writer *w, uint64_t value, size_t bytes) {
    uint8_t little[8];
    for (size_t i = 0; i < bytes; i++) {
        little[i] = (uint8_t)(value >> (8 * i));
    }
    put(w, little, bytes);
}

static void put_double(mhi_xdf_writer *w, double value) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_integer(w, bits, 8);
}

static void put_text(mhi_xdf_writer *w, const char *text) {
    put(w, text, strlen(text));
}

/* Text within an element. */
static void put_escaped(mhi_xdf_writer *w, const char *text) {
    for (const char *c = text; *c != '\0'; c++) {
        const char *as = *c == '&' ? "&amp;" : *c == '<' ? "&lt;" : *c == '>' ? "&gt;" : NULL;
        if (as != NULL) {
            put_text(w, as);
        } else if ((unsigned char)*c < ' ' && *c != '\n' && *c != '\t') {
            put(w, " ", 1);
        } else {
            put(w, c, 1);
        }
    }
}

static void put_element(mhi_xdf_writer *w, const char *name, const char *text) {
    if (text != NULL) {
        put_text(w, "<");
        put_text(w, name);
        put_text(w, ">");
        put_escaped(w, text);
        put_text(w, "</");
        put_text(w, name);
        put_text(w, ">");
    }
}

static mhe_status write_all(mhi_xdf_writer *w, const uint8_t *data, size_t n, mhe_error *err) {
    while (n > 0) {
        const ssize_t done = write(w->file, data, n);
        if (done < 0 && errno != EINTR) {
            return mhe_fail(err, MHE_E_IO, "%s: cannot be written: %s", w->path, strerror(errno));
        }
        data += done > 0 ? done : 0;
        n -= done > 0 ? (size_t)done : 0;
    }
    return MHE_OK;
}

/* Writes the content in work as one chunk. Its length takes eight bytes: a chunk is written at
 * once, and its head with it. */
static mhe_status end_chunk(mhi_xdf_writer *w, uint16_t tag, mhe_error *err) {
    uint8_t head[11] = {8};
    const uint64_t length = w->n + 2;
    for (size_t i = 0; i < 8; i++) {
        head[1 + i] = (uint8_t)(length >> (8 * i));
    }
    head[9] = (uint8_t)tag;
    head[10] = (uint8_t)(tag >> 8);
    const int failed = w->failed;
    w->failed = 0;
    const size_t n = w->n;
    w->n = 0;
    if (failed) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const mhe_status status = write_all(w, head, sizeof head, err);
    return status == MHE_OK ? write_all(w, w->chunk, n, err) : status;
}

mhe_status mhi_xdf_create(const char *path, mhi_xdf_writer **writer, mhe_error *err) {
    *writer = NULL;
    mhi_xdf_writer *w = calloc(1, sizeof *w);
    if (w == NULL || (w->path = strdup(path)) == NULL) {
        free(w);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    w->file = open(path, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (w->file < 0) {
        const mhe_status status =
            mhe_fail(err, MHE_E_IO, "%s: cannot be begun: %s", path, strerror(errno));
        free(w->path);
        free(w);
        return status;
    }
    mhe_status status = write_all(w, (const uint8_t *)"XDF:", 4, err);
    if (status == MHE_OK) {
        put_text(w, "<?xml version=\"1.0\"?><info><version>1.0</version></info>");
        status = end_chunk(w, TAG_FILE_HEADER, err);
    }
    if (status != MHE_OK) {
        (void)mhi_xdf_close(w, NULL);
        return status;
    }
    *writer = w;
    return MHE_OK;
}

mhe_status mhi_xdf_add_stream(mhi_xdf_writer *w, const char *name, const char *type, double rate,
                              const mhi_xdf_column *columns, int32_t n_columns, const char *note,
                              uint32_t *id, mhe_error *err) {
    char number[40];
    const mhi_c_locale locale = mhi_c_locale_begin();
    *id = ++w->n_streams;
    put_integer(w, *id, 4);
    put_text(w, "<?xml version=\"1.0\"?><info>");
    put_element(w, "name", name);
    put_element(w, "type", type);
    (void)snprintf(number, sizeof number, "%d", (int)n_columns);
    put_element(w, "channel_count", number);
    (void)snprintf(number, sizeof number, "%.17g", rate);
    put_element(w, "nominal_srate", number);
    mhi_c_locale_end(locale);
    put_element(w, "channel_format", "double64");
    put_text(w, "<desc>");
    put_element(w, "note", note);
    put_text(w, "<channels>");
    for (int32_t i = 0; i < n_columns; i++) {
        put_text(w, "<channel>");
        put_element(w, "label", columns[i].label);
        put_element(w, "unit", columns[i].unit);
        put_element(w, "type", columns[i].type);
        put_element(w, "marker", columns[i].marker);
        put_element(w, "named", columns[i].named);
        put_text(w, "</channel>");
    }
    put_text(w, "</channels></desc></info>");
    return end_chunk(w, TAG_STREAM_HEADER, err);
}

mhe_status mhi_xdf_put(mhi_xdf_writer *w, uint32_t id, int32_t n_columns, int32_t n,
                       const double *stamps, const double *values, mhe_error *err) {
    put_integer(w, id, 4);
    put_integer(w, 4, 1);
    put_integer(w, (uint32_t)n, 4);
    for (int32_t k = 0; k < n; k++) {
        put_integer(w, 8, 1);
        put_double(w, stamps[k]);
        for (int32_t i = 0; i < n_columns; i++) {
            put_double(w, values[(ptrdiff_t)k * n_columns + i]);
        }
    }
    return end_chunk(w, TAG_SAMPLES, err);
}

mhe_status mhi_xdf_put_offset(mhi_xdf_writer *w, uint32_t id, double time, double offset,
                              mhe_error *err) {
    put_integer(w, id, 4);
    put_double(w, time);
    put_double(w, offset);
    return end_chunk(w, TAG_CLOCK_OFFSET, err);
}

mhe_status mhi_xdf_flush(mhi_xdf_writer *w, mhe_error *err) {
    return fdatasync(w->file) == 0 || errno == EINVAL
               ? MHE_OK
               : mhe_fail(err, MHE_E_IO, "%s: cannot be written: %s", w->path, strerror(errno));
}

mhe_status mhi_xdf_close(mhi_xdf_writer *w, mhe_error *err) {
    if (w == NULL) {
        return MHE_OK;
    }
    mhe_status status = mhi_xdf_flush(w, err);
    if (close(w->file) != 0 && status == MHE_OK) {
        status = mhe_fail(err, MHE_E_IO, "%s: cannot be closed: %s", w->path, strerror(errno));
    }
    free(w->chunk);
    free(w->path);
    free(w);
    return status;
}
