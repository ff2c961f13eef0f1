/* SPDX-License-Identifier: Apache-2.0 */
#include "c3d_writer.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct writer {
    const test_c3d *c;
    uint8_t *data;
    size_t n, room;
} writer;

static void put(writer *w, const void *bytes, size_t n) {
    if (w->n + n > w->room) {
        w->room = 2 * (w->n + n);
        w->data = realloc(w->data, w->room);
    }
    memcpy(w->data + w->n, bytes, n);
    w->n += n;
}

static void put_byte(writer *w, int32_t value) {
    const uint8_t byte = (uint8_t)value;
    put(w, &byte, 1);
}

static void put_word(writer *w, int32_t value) {
    const int mips = w->c->processor == 86;
    put_byte(w, mips ? value >> 8 & 0xff : value & 0xff);
    put_byte(w, mips ? value & 0xff : value >> 8 & 0xff);
}

static void put_float(writer *w, double value) {
    static const int orders[3][4] = {{0, 1, 2, 3}, {2, 3, 0, 1}, {3, 2, 1, 0}};
    const int32_t kind = w->c->processor - 84;
    const float single = (float)(kind == 1 ? 4 * value : value); /* DEC: two more exponents */
    uint32_t bits;
    memcpy(&bits, &single, sizeof bits);
    for (int i = 0; i < 4; i++) {
        put_byte(w, (int32_t)(bits >> (8 * orders[kind][i]) & 0xff));
    }
}

static void pad(writer *w) {
    while (w->n % 512 != 0) {
        put_byte(w, 0);
    }
}

/* ---- parameters ---- */

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

static void numbers(writer *w, int32_t id, const char *name, int32_t type, int32_t n, double first,
                    double step) {
    begin(w, id, name, 3 + (size_t)(type * n));
    put_byte(w, type);
    put_byte(w, 1);
    put_byte(w, n);
    for (int32_t i = 0; i < n; i++) {
        if (type == 2) {
            put_word(w, (int32_t)(first + step * i));
        } else {
            put_float(w, first + step * i);
        }
    }
    put_byte(w, 0);
}

static void number(writer *w, int32_t id, const char *name, int32_t type, double value) {
    numbers(w, id, name, type, 1, value, 0);
}

static void text(writer *w, int32_t id, const char *name, const char *value) {
    begin(w, id, name, 3 + strlen(value));
    put_byte(w, -1);
    put_byte(w, 1);
    put_byte(w, (int32_t)strlen(value));
    put(w, value, strlen(value));
    put_byte(w, 0);
}

/* 255 in a parameter, padded with blanks. */
static void labels(writer *w, int32_t id, const char *const *names, const char *letter,
                   int32_t n_names) {
    for (int32_t done = 0, part = 1; done < n_names; done += 255, part++) {
        const int32_t n = n_names - done < 255 ? n_names - done : 255;
        char name[32] = "LABELS";
        if (part > 1) {
            (void)snprintf(name, sizeof name, "LABELS%d", (int)part);
        }
        begin(w, id, name, 4 + 16 * (size_t)n);
        put_byte(w, -1);
        put_byte(w, 2);
        put_byte(w, 16);
        put_byte(w, n);
        for (int32_t i = done; i < done + n; i++) {
            char made[16], padded[32];
            (void)snprintf(made, sizeof made, "%s%d", letter, (int)i + 1);
            (void)snprintf(padded, sizeof padded, "%-16.16s", names != NULL ? names[i] : made);
            put(w, padded, 16);
        }
        put_byte(w, 0);
    }
}

static void parameters(writer *w, int32_t data_block) {
    const test_c3d *c = w->c;
    const char parts[] = {1, 0x50, 0, (char)c->processor};
    put(w, parts, 4);
    group(w, 1, "POINT");
    group(w, 2, "ANALOG");
    number(w, 1, "USED", 2, c->n_points);
    number(w, 1, "SCALE", 4, c->is_float ? -c->scale : c->scale);
    number(w, 1, "RATE", 4, c->rate);
    number(w, 1, "DATA_START", 2, data_block);
    if (c->unit != NULL) {
        text(w, 1, "UNITS", c->unit);
    }
    labels(w, 1, c->labels, "P", c->n_points);
    number(w, 2, "USED", 2, c->n_channels);
    if (c->n_channels > 0) {
        labels(w, 2, c->channels, "C", c->n_channels);
        number(w, 2, "GEN_SCALE", 4, c->general);
        numbers(w, 2, "SCALE", 4, c->n_channels, c->gain, c->gain);
        numbers(w, 2, "OFFSET", 2, c->n_channels, c->offset, 0);
        text(w, 2, "FORMAT", c->is_unsigned ? "UNSIGNED" : "SIGNED");
    }
    if (c->long_frames) {
        const int32_t last = c->first + c->n_frames - 1;
        group(w, 3, "TRIAL");
        numbers(w, 3, "ACTUAL_START_FIELD", 2, 2, c->first & 0xffff,
                (c->first >> 16) - (c->first & 0xffff));
        numbers(w, 3, "ACTUAL_END_FIELD", 2, 2, last & 0xffff, (last >> 16) - (last & 0xffff));
    }
    put_byte(w, 0);
    pad(w);
}

/* ---- header and frames ---- */

static void header(writer *w, int32_t data_block) {
    const test_c3d *c = w->c;
    const int32_t last = c->first + c->n_frames - 1;
    put_byte(w, 2);
    put_byte(w, 0x50);
    put_word(w, c->n_points);
    put_word(w, c->n_channels * c->per_frame);
    put_word(w, c->first);
    put_word(w, last < 0xffff ? last : 0xffff);
    put_word(w, 0);
    put_float(w, c->is_float ? -c->scale : c->scale);
    put_word(w, data_block);
    put_word(w, c->per_frame);
    put_float(w, c->rate);
    pad(w);
}

static void value(writer *w, double number_) {
    if (w->c->is_float) {
        put_float(w, number_);
    } else {
        put_word(w, (int32_t)lround(number_));
    }
}

static void frame(writer *w, int32_t k) {
    const test_c3d *c = w->c;
    for (int32_t i = 0; i < c->n_points; i++) {
        double xyz[3];
        c->point(k, i, xyz);
        const int gap = !isfinite(xyz[0]);
        for (int axis = 0; axis < 3; axis++) {
            value(w, gap ? 0.5 : xyz[axis] / (c->is_float ? 1 : c->scale));
        }
        value(w, gap ? -1 : 3);
    }
    for (int32_t row = k * c->per_frame; row < (k + 1) * c->per_frame; row++) {
        for (int32_t i = 0; i < c->n_channels; i++) {
            value(w, c->sample(row, i));
        }
    }
}

uint8_t *test_c3d_make(const test_c3d *c3d, size_t *size) {
    int32_t data_block = 1;
    writer w = {.c = c3d};
    for (int32_t round = 0; round < 2; round++) { /* the first tells where the data begin */
        w.n = 0;
        header(&w, data_block);
        parameters(&w, data_block);
        data_block = (int32_t)(w.n / 512) + 1;
    }
    for (int32_t k = 0; k < c3d->n_frames; k++) {
        frame(&w, k);
    }
    pad(&w);
    *size = w.n;
    return w.data;
}

int test_c3d_write(const test_c3d *c3d, const char *path) {
    size_t size = 0;
    uint8_t *data = test_c3d_make(c3d, &size);
    FILE *file = fopen(path, "wb");
    int failed = file == NULL || fwrite(data, 1, size, file) != size;
    failed = (file != NULL && fclose(file) != 0) || failed;
    free(data);
    return failed;
}
