/* SPDX-License-Identifier: Apache-2.0 */
/* rt.c: packets and data components. */
#include "rt.h"

#include <math.h>
#include <string.h>

#define COMPONENT_3D 1
#define COMPONENT_ANALOG 3

typedef struct cursor {
    const uint8_t *at, *end;
} cursor;

static size_t left(const cursor *c) {
    return (size_t)(c->end - c->at);
}

static int take(cursor *c, size_t bytes, uint64_t *value) {
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

static int take_float(cursor *c, double *value) {
    uint64_t bits;
    if (!take(c, 4, &bits)) {
        return 0;
    }
    const uint32_t low = (uint32_t)bits;
    float narrow;
    memcpy(&narrow, &low, sizeof narrow);
    *value = (double)narrow;
    return 1;
}

mhe_status rt_take_packet(const uint8_t *data, size_t length, rt_packet *out, size_t *used,
                          mhe_error *err) {
    cursor c = {data, data + length};
    uint64_t size, type;
    if (!take(&c, 4, &size) || !take(&c, 4, &type)) {
        return mhe_fail(err, MHE_RETRY, "a packet is not whole yet");
    }
    const uint64_t turned = __builtin_bswap32((uint32_t)size);
    if (type != 0 && __builtin_bswap32((uint32_t)type) <= 16 && turned >= RT_HEADER &&
        turned <= RT_LARGEST) {
        return mhe_fail(err, MHE_E_INPUT,
                        "QTM answers in the other byte order: its little-endian port is one below "
                        "(22223 of 22224)");
    }
    if (size < RT_HEADER || size > RT_LARGEST || type > 16) {
        return mhe_fail(err, MHE_E_INPUT,
                        "a packet of %llu bytes and type %llu: this is no real-time server of QTM",
                        (unsigned long long)size, (unsigned long long)type);
    }
    if (size > length) {
        return mhe_fail(err, MHE_RETRY, "a packet is not whole yet");
    }
    *out = (rt_packet){(uint32_t)type, data + RT_HEADER, (size_t)size - RT_HEADER};
    *used = (size_t)size;
    return MHE_OK;
}

static mhe_status cut(mhe_error *err) {
    return mhe_fail(err, MHE_E_INPUT, "a data packet is cut short or larger than was announced");
}

static mhe_status parse_3d(cursor c, double time, double *scratch, size_t room,
                           const rt_taker *taker, mhe_error *err) {
    uint64_t n, rates;
    if (!take(&c, 4, &n) || !take(&c, 4, &rates) || n * 12 > left(&c) || 3 * n > room) {
        return cut(err);
    }
    for (size_t i = 0; i < 3 * (size_t)n; i++) {
        double mm = NAN;
        (void)take_float(&c, &mm);
        scratch[i] = isfinite(mm) ? 1e-3 * mm : NAN;
    }
    taker->markers(taker->data, time, (int32_t)n, scratch);
    return MHE_OK;
}

/* Floats stand channel by channel; they are handed out sample by sample. */
static mhe_status parse_device(cursor *c, double time, double *scratch, size_t room,
                               const rt_taker *taker, mhe_error *err) {
    uint64_t id, n_channels, n, first;
    if (!take(c, 4, &id) || !take(c, 4, &n_channels) || !take(c, 4, &n)) {
        return cut(err);
    }
    if (n == 0) {
        return MHE_OK; /* and no sample number */
    }
    if (!take(c, 4, &first) || n_channels > left(c) || n > left(c) ||
        n_channels * n > left(c) / 4 || n_channels * n > room) {
        return cut(err);
    }
    for (size_t k = 0; k < (size_t)n_channels; k++) {
        for (size_t i = 0; i < (size_t)n; i++) {
            double value = NAN;
            (void)take_float(c, &value);
            scratch[i * (size_t)n_channels + k] = isfinite(value) ? value : NAN;
        }
    }
    taker->analog(taker->data, time, (int32_t)id, (int32_t)n_channels, (int32_t)n, (uint32_t)first,
                  scratch);
    return MHE_OK;
}

static mhe_status parse_analog(cursor c, double time, double *scratch, size_t room,
                               const rt_taker *taker, mhe_error *err) {
    uint64_t devices;
    if (!take(&c, 4, &devices)) {
        return cut(err);
    }
    mhe_status status = devices > left(&c) ? cut(err) : MHE_OK;
    for (uint64_t i = 0; i < devices && status == MHE_OK; i++) {
        status = parse_device(&c, time, scratch, room, taker, err);
    }
    return status;
}

/* The components of one type. */
static mhe_status parse_components(const rt_packet *packet, uint64_t wanted, double *scratch,
                                   size_t room, const rt_taker *taker, mhe_error *err) {
    cursor c = {packet->body, packet->body + packet->length};
    uint64_t microseconds, frame, components;
    if (!take(&c, 8, &microseconds) || !take(&c, 4, &frame) || !take(&c, 4, &components)) {
        return cut(err);
    }
    const double time = 1e-6 * (double)(int64_t)microseconds;
    mhe_status status = components > left(&c) ? cut(err) : MHE_OK;
    for (uint64_t i = 0; i < components && status == MHE_OK; i++) {
        uint64_t size, type;
        if (!take(&c, 4, &size) || !take(&c, 4, &type) || size < RT_HEADER ||
            size - RT_HEADER > left(&c)) {
            return cut(err);
        }
        const cursor content = {c.at, c.at + (size - RT_HEADER)};
        c.at = content.end;
        if (type == wanted) { /* others were not asked for */
            status = (wanted == COMPONENT_3D ? parse_3d : parse_analog)(content, time, scratch,
                                                                        room, taker, err);
        }
    }
    return status;
}

mhe_status rt_parse_data(const rt_packet *packet, double *scratch, size_t room,
                         const rt_taker *taker, mhe_error *err) {
    const mhe_status analog = parse_components(packet, COMPONENT_ANALOG, scratch, room, taker, err);
    const mhe_status markers =
        parse_components(packet, COMPONENT_3D, scratch, room, taker, analog == MHE_OK ? err : NULL);
    return analog == MHE_OK ? markers : analog;
}

size_t rt_write_command(const char *text, uint8_t *out, size_t room) {
    const size_t length = strlen(text) + 1, size = length + RT_HEADER;
    if (size > room) {
        return 0;
    }
    for (size_t i = 0; i < 4; i++) {
        out[i] = (uint8_t)(size >> (8 * i));
        out[4 + i] = i == 0 ? RT_COMMAND : 0;
    }
    memcpy(out + RT_HEADER, text, length);
    return size;
}
