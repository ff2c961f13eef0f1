/* SPDX-License-Identifier: Apache-2.0 */
#include "io/c3d_write.h"

#include "io/c3d_parameters.h"
#include "io/outbox.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define POINT 1
#define ANALOG 2
#define COUNT_MAX 255
#define WORD_MAX 65535
#define SAME_TIME 5e-7 /* s: files print times with six digits */

/* Bytes that grow. What did not fit once is lost, and all that comes behind it. */
typedef struct writer {
    uint8_t *data;
    size_t n, room;
    int failed;
} writer;

static void grow(writer *w, size_t n) {
    const size_t room = 2 * n + MHI_C3D_BLOCK;
    uint8_t *data = realloc(w->data, room);
    if (data == NULL) {
        free(w->data);
        *w = (writer){.failed = 1};
        return;
    }
    w->data = data;
    w->room = room;
}

static void put(writer *w, const void *bytes, size_t n) {
    if (w->n + n > w->room && !w->failed) {
        grow(w, w->n + n);
    }
    if (!w->failed) {
        memcpy(w->data + w->n, bytes, n);
        w->n += n;
    }
}

static void put_byte(writer *w, int32_t value) {
    const uint8_t byte = (uint8_t)value;
    put(w, &byte, 1);
}

static void put_word(writer *w, int32_t value) {
    put_byte(w, value & 0xff);
    put_byte(w, value >> 8 & 0xff);
}

static void put_float(writer *w, double value) {
    const float single = (float)value;
    uint32_t bits;
    memcpy(&bits, &single, sizeof bits);
    put_word(w, (int32_t)(bits & 0xffff));
    put_word(w, (int32_t)(bits >> 16));
}

static void pad(writer *w) {
    while (w->n % MHI_C3D_BLOCK != 0 && !w->failed) {
        put_byte(w, 0);
    }
}

/* ---- parameters ---- */

/* A group (id below 0) or a parameter of n_data bytes, which follow. */
static void begin(writer *w, int32_t id, const char *name, size_t n_data) {
    put_byte(w, (int32_t)strlen(name));
    put_byte(w, id);
    put(w, name, strlen(name));
    put_word(w, (int32_t)(2 + n_data + 1)); /* to the next record, with an empty description */
}

static void group(writer *w, int32_t id, const char *name) {
    begin(w, -id, name, 0);
    put_byte(w, 0);
}

/* A number, or n > 0 equal ones. */
static void numbers(writer *w, int32_t id, const char *name, int32_t type, int32_t n,
                    double value) {
    const int32_t count = n > 0 ? n : 1;
    begin(w, id, name, 2 + (size_t)(n > 0) + (size_t)(type * count));
    put_byte(w, type);
    put_byte(w, n > 0);
    if (n > 0) {
        put_byte(w, n);
    }
    for (int32_t i = 0; i < count; i++) {
        if (type == 2) {
            put_word(w, (int32_t)value);
        } else {
            put_float(w, value);
        }
    }
    put_byte(w, 0);
}

static void number(writer *w, int32_t id, const char *name, int32_t type, double value) {
    numbers(w, id, name, type, 0, value);
}

/* Texts of one width, filled up with blanks; `step` 0: n times the same. */
static void texts(writer *w, int32_t id, const char *name, const char *const *text, int32_t step,
                  int32_t n) {
    size_t width = 1;
    for (int32_t i = 0; i < n; i++) {
        const size_t length = strlen(text[i * step]);
        width = length > width ? length : width;
    }
    width = width < COUNT_MAX ? width : COUNT_MAX;
    begin(w, id, name, 4 + width * (size_t)n);
    put_byte(w, -1);
    put_byte(w, 2);
    put_byte(w, (int32_t)width);
    put_byte(w, n);
    for (int32_t i = 0; i < n; i++) {
        const char *t = text[i * step];
        const size_t length = strlen(t);
        for (size_t j = 0; j < width; j++) {
            put_byte(w, j < length ? t[j] : ' ');
        }
    }
    put_byte(w, 0);
}

static void parameters(writer *w, const mhi_c3d_content *c, int32_t n_blocks, int32_t data_block) {
    const uint8_t head[] = {1, 0x50, (uint8_t)n_blocks, MHI_C3D_INTEL};
    static const char *const millimetres = "mm";
    put(w, head, sizeof head);
    group(w, POINT, "POINT");
    group(w, ANALOG, "ANALOG");
    number(w, POINT, "USED", 2, c->n_markers);
    number(w, POINT, "FRAMES", 2, c->n_frames);
    number(w, POINT, "DATA_START", 2, data_block);
    number(w, POINT, "SCALE", 4, -1); /* below 0: floats */
    number(w, POINT, "RATE", 4, c->rate);
    texts(w, POINT, "UNITS", &millimetres, 0, 1);
    texts(w, POINT, "LABELS", c->markers, 1, c->n_markers);
    number(w, ANALOG, "USED", 2, c->n_channels);
    number(w, ANALOG, "RATE", 4, c->rate * c->per_frame);
    number(w, ANALOG, "GEN_SCALE", 4, 1);
    if (c->n_channels > 0) {
        numbers(w, ANALOG, "SCALE", 4, c->n_channels, 1);
        numbers(w, ANALOG, "OFFSET", 2, c->n_channels, 0);
        texts(w, ANALOG, "UNITS", &c->unit, 0, c->n_channels);
        texts(w, ANALOG, "LABELS", c->channels, 1, c->n_channels);
    }
    put_word(w, 0); /* no further record */
    pad(w);
}

/* ---- header and frames ---- */

static void header(writer *w, const mhi_c3d_content *c, int32_t data_block) {
    const int32_t first = 1 + (int32_t)lround(c->first * c->rate);
    put_byte(w, 2); /* block of the parameters */
    put_byte(w, 0x50);
    put_word(w, c->n_markers);
    put_word(w, c->n_channels * c->per_frame);
    put_word(w, first);
    put_word(w, first + c->n_frames - 1);
    put_word(w, 0); /* gaps are not filled */
    put_float(w, -1);
    put_word(w, data_block);
    put_word(w, c->per_frame);
    put_float(w, c->rate);
    pad(w);
}

static void frames(writer *w, const mhi_c3d_content *c) {
    for (int32_t k = 0; k < c->n_frames; k++) {
        for (int32_t i = 0; i < c->n_markers; i++) {
            const double *xyz = c->points + 3 * ((ptrdiff_t)k * c->n_markers + i);
            const int gap = !isfinite(xyz[0] + xyz[1] + xyz[2]);
            for (int axis = 0; axis < 3; axis++) {
                put_float(w, gap ? 0 : 1e3 * xyz[axis]);
            }
            put_float(w, gap ? -1 : 0);
        }
        const ptrdiff_t n = (ptrdiff_t)c->per_frame * c->n_channels;
        for (ptrdiff_t i = 0; i < n; i++) {
            put_float(w, c->analog[k * n + i]);
        }
    }
    pad(w);
}

static mhe_status check(const char *name, const mhi_c3d_content *c, mhe_error *err) {
    const double first = c->first * c->rate;
    if (c->n_markers > COUNT_MAX || c->n_channels > COUNT_MAX) {
        return mhe_fail(err, MHE_E_INPUT, "%s: %d markers and %d channels; at most %d each", name,
                        c->n_markers, c->n_channels, COUNT_MAX);
    }
    if ((int64_t)c->n_channels * c->per_frame > WORD_MAX) {
        return mhe_fail(err, MHE_E_INPUT, "%s: more than %d analog samples in a frame", name,
                        WORD_MAX);
    }
    if (!(first > -1e-3 && first + c->n_frames <= WORD_MAX)) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s: %d frames from %g s on at %g Hz; a .c3d has frames 1 to %d, the first "
                        "at 0 s",
                        name, c->n_frames, c->first, c->rate, WORD_MAX);
    }
    if (fabs(first - (double)lround(first)) > SAME_TIME * c->rate) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s: begins at %g s; in a .c3d of %g Hz that must be a multiple of %g s",
                        name, c->first, c->rate, 1 / c->rate);
    }
    const ptrdiff_t n = (ptrdiff_t)c->n_frames * c->per_frame * c->n_channels;
    for (ptrdiff_t i = 0; i < n; i++) {
        if (!isfinite(c->analog[i])) {
            return mhe_fail(err, MHE_E_INPUT,
                            "%s: channel '%s' has no sample in frame %d; a .c3d cannot say so",
                            name, c->channels[i % c->n_channels],
                            (int)(i / c->n_channels / c->per_frame) + 1);
        }
    }
    return MHE_OK;
}

mhe_status mhi_outbox_c3d(mhe_outbox *outbox, const char *name, const mhi_c3d_content *c,
                          mhe_error *err) {
    mhe_status status = check(name, c, err);
    if (status != MHE_OK) {
        return status;
    }
    writer w = {0};
    int32_t data_block = 1;
    for (int32_t round = 0; round < 2; round++) { /* the first tells where the data begin */
        w.n = 0;
        header(&w, c, data_block);
        parameters(&w, c, data_block - 2, data_block);
        data_block = (int32_t)(w.n / MHI_C3D_BLOCK) + 1;
    }
    frames(&w, c);
    mhi_outbox_file *file = NULL;
    status = w.failed ? mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name)
                      : mhi_outbox_add(outbox, name, &file, err);
    if (status == MHE_OK &&
        (fwrite(w.data, 1, w.n, file->stream) != w.n || fflush(file->stream) != 0)) {
        status = mhi_outbox_write_failed(file, err);
    }
    free(w.data);
    return status;
}
