/* SPDX-License-Identifier: Apache-2.0 */
#include "io/c3d_parameters.h"

#include "io/decode.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* ---- numbers ---- */

int32_t mhi_c3d_uint16(const mhi_c3d_file *file, const uint8_t *at) {
    return file->processor == MHI_C3D_MIPS ? at[0] << 8 | at[1] : at[1] << 8 | at[0];
}

int32_t mhi_c3d_int16(const mhi_c3d_file *file, const uint8_t *at) {
    const int32_t value = mhi_c3d_uint16(file, at);
    return value < 0x8000 ? value : value - 0x10000;
}

/* DEC's F format: the two words swapped, the exponent two larger. */
double mhi_c3d_float(const mhi_c3d_file *file, const uint8_t *at) {
    static const uint8_t orders[3][4] = {{3, 2, 1, 0}, {1, 0, 3, 2}, {0, 1, 2, 3}};
    const uint8_t *order = orders[file->processor - MHI_C3D_INTEL];
    uint32_t bits = 0;
    for (int32_t i = 0; i < 4; i++) {
        bits = bits << 8 | at[order[i]];
    }
    const int dec = file->processor == MHI_C3D_DEC;
    const int32_t exponent = (int32_t)(bits >> 23 & 0xff);
    if (exponent == 0xff && !dec) {
        return NAN;
    }
    if (exponent == 0 && dec) {
        return 0;
    }
    const double fraction = (double)(bits & 0x7fffff) / 0x800000;
    const double value =
        exponent == 0 ? ldexp(fraction, -126) : ldexp(1 + fraction, exponent - 127 - (dec ? 2 : 0));
    return bits >> 31 ? -value : value;
}

/* ---- parameters ---- */

mhe_status mhi_c3d_open(mhi_c3d_file *file) {
    const uint8_t *d = file->data;
    if (file->length < MHI_C3D_BLOCK || d[1] != 0x50 || d[0] == 0) {
        return mhe_fail(file->err, MHE_E_INPUT,
                        "%s: is no .c3d file (its second byte must be 80, after the block number "
                        "of the parameters)",
                        file->name);
    }
    file->parameters = (size_t)(d[0] - 1) * MHI_C3D_BLOCK;
    if (file->parameters + 4 > file->length) {
        return mhe_fail(file->err, MHE_E_INPUT,
                        "%s: the parameters should begin at byte %zu, but the file ends at %zu",
                        file->name, file->parameters, file->length);
    }
    const uint8_t *p = d + file->parameters;
    file->processor = p[3];
    if (p[3] < MHI_C3D_INTEL || p[3] > MHI_C3D_MIPS) {
        return mhe_fail(file->err, MHE_E_INPUT,
                        "%s: the processor is %d; 84 (Intel), 85 (DEC) or 86 (MIPS) is needed",
                        file->name, p[3]);
    }
    /* the count of blocks is a byte, and wrong where there are many labels: the records say
     * themselves where they end */
    file->beyond = file->length;
    file->parameters += 4;
    return MHE_OK;
}

/* A group or a parameter. */
typedef struct record {
    int32_t id; /* below 0: the group of this number */
    const char *name;
    size_t n_name;
    const uint8_t *body, *end; /* behind the offset; where the next record begins */
} record;

/* The record at *at; steps on. 0: there is none. */
static int32_t next_record(const mhi_c3d_file *file, size_t *at, record *r) {
    if (*at + 2 > file->beyond) {
        return 0;
    }
    const uint8_t *p = file->data + *at;
    const size_t n_name = (size_t)abs((int8_t)p[0]);
    const size_t offset_at = *at + 2 + n_name;
    if (n_name == 0 || offset_at + 2 > file->beyond) {
        return 0;
    }
    const size_t offset = (size_t)mhi_c3d_uint16(file, file->data + offset_at);
    /* 0: the last one, which may reach as far as the file does */
    const size_t end = offset == 0 ? file->beyond : offset_at + offset;
    if (end < offset_at + 2 || end > file->beyond) {
        return 0;
    }
    *r = (record){.id = (int8_t)p[1],
                  .name = (const char *)p + 2,
                  .n_name = n_name,
                  .body = file->data + offset_at + 2,
                  .end = file->data + end};
    *at = offset == 0 ? file->beyond : end;
    return 1;
}

static int32_t is_named(const record *r, const char *name) {
    return strlen(name) == r->n_name && strncasecmp(r->name, name, r->n_name) == 0;
}

static mhi_c3d_parameter take(const record *r) {
    const mhi_c3d_parameter none = {0};
    const size_t room = (size_t)(r->end - r->body);
    if (room < 2) {
        return none;
    }
    const int32_t type = (int8_t)r->body[0], n_dimensions = r->body[1];
    if ((type != -1 && type != 1 && type != 2 && type != 4) || n_dimensions > 7 ||
        room < 2 + (size_t)n_dimensions) {
        return none;
    }
    const uint8_t *dimensions = r->body + 2;
    const size_t size = (size_t)abs(type), left = room - 2 - (size_t)n_dimensions;
    size_t n = 1;
    for (int32_t i = 0; i < n_dimensions; i++) {
        n *= dimensions[i];
        if (n * size > left) {
            return none;
        }
    }
    if (size * n > left) {
        return none;
    }
    const int32_t width = type == -1 && n_dimensions > 0 ? dimensions[0] : 1;
    return (mhi_c3d_parameter){.type = type,
                               .width = width,
                               .n = width == 0 ? 0 : (int32_t)(n / (size_t)width),
                               .data = dimensions + n_dimensions};
}

mhi_c3d_parameter mhi_c3d_find(const mhi_c3d_file *file, const char *group, const char *name) {
    const mhi_c3d_parameter none = {0};
    record r;
    int32_t id = 0;
    for (size_t at = file->parameters; id == 0 && next_record(file, &at, &r);) {
        id = r.id < 0 && is_named(&r, group) ? -r.id : 0;
    }
    for (size_t at = file->parameters; id != 0 && next_record(file, &at, &r);) {
        if (r.id == id && is_named(&r, name)) {
            return take(&r);
        }
    }
    return none;
}

double mhi_c3d_number(const mhi_c3d_file *file, const mhi_c3d_parameter *p, int32_t i,
                      int32_t unsigned_, double fallback) {
    if (i >= p->n) {
        return fallback;
    }
    switch (p->type) {
    case 1:
        return p->data[i];
    case 2:
        return unsigned_ ? mhi_c3d_uint16(file, p->data + 2 * (size_t)i)
                         : mhi_c3d_int16(file, p->data + 2 * (size_t)i);
    case 4:
        return mhi_c3d_float(file, p->data + 4 * (size_t)i);
    default:
        return fallback;
    }
}

char *mhi_c3d_text(const mhi_c3d_parameter *p, int32_t i) {
    if (p->type != -1 || i >= p->n) {
        return strdup("");
    }
    const char *text = (const char *)p->data + (size_t)i * (size_t)p->width;
    size_t n = strnlen(text, (size_t)p->width);
    while (n > 0 && (unsigned char)text[n - 1] <= ' ') {
        n--;
    }
    while (n > 0 && (unsigned char)*text <= ' ') {
        text++;
        n--;
    }
    mhi_decoded d;
    if (mhi_decode("", text, n, &d, NULL) != MHE_OK) { /* labels come in any code page */
        return NULL;
    }
    char *copy = strndup(d.text, d.length);
    free(d.owned);
    for (char *c = copy; c != NULL && *c != '\0'; c++) {
        *c = (unsigned char)*c < ' ' || *c == 0x7f ? '?' : *c; /* a tab would break our tables */
    }
    return copy;
}
