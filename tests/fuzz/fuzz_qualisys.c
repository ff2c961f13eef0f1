/* SPDX-License-Identifier: Apache-2.0 */
/* fuzz_qualisys.c: any bytes as what a real-time server of QTM sends: packets one after another,
 * descriptions and data among them. */
#include "fuzz.h"
#include "rt.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define ROOM 4096

static double sum;

static void add(const double *values, int64_t n) {
    for (int64_t i = 0; i < n; i++) {
        sum += isfinite(values[i]) ? values[i] : 0; /* read, so that a bad address is seen */
    }
}

static void take_markers(void *data, double time, int32_t n, const double *position) {
    (void)data, (void)time;
    if (n < 0 || 3 * (int64_t)n > ROOM) {
        abort();
    }
    add(position, 3 * (int64_t)n);
}

static void take_analog(void *data, double time, int32_t device, int32_t n_channels, int32_t n,
                        uint32_t first, const double *values) {
    (void)data, (void)time, (void)device, (void)first;
    if (n_channels < 0 || n < 0 || (int64_t)n_channels * n > ROOM) {
        abort();
    }
    add(values, (int64_t)n_channels * n);
}

static void take(const rt_packet *packet) {
    static double scratch[ROOM];
    static const rt_taker taker = {NULL, take_markers, take_analog};
    mhe_error err = {0};
    rt_parameters parameters;
    mhe_status status = MHE_OK;
    if (packet->type == RT_DATA) {
        status = rt_parse_data(packet, scratch, ROOM, &taker, &err);
    } else if (packet->type == RT_XML) {
        status = rt_parse_parameters((const char *)packet->body, packet->length, &parameters, &err);
        if (status == MHE_OK) {
            for (int32_t i = 0; i < parameters.n_markers; i++) {
                sum += (double)strlen(parameters.markers[i]);
            }
            for (int32_t i = 0; i < parameters.n_devices; i++) {
                const rt_analog_device *d = &parameters.devices[i];
                for (int32_t k = 0; k < d->n_channels; k++) {
                    sum += (double)(strlen(d->labels[k]) + strlen(d->units[k]));
                }
            }
            rt_free_parameters(&parameters);
        }
    }
    if (status != MHE_OK && err.text[0] == '\0') {
        abort(); /* refused without a reason */
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    mhe_error err = {0};
    rt_packet packet;
    size_t used = 0;
    uint8_t *copy = malloc(size + 1); /* of its own, so that what is read behind it is seen */
    memcpy(copy, data, size);
    const uint8_t *at = copy;
    while (rt_take_packet(at, size, &packet, &used, &err) == MHE_OK) {
        if (used < RT_HEADER || used > size) {
            abort();
        }
        take(&packet);
        at += used;
        size -= used;
    }
    free(copy);
    return 0;
}
