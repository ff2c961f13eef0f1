/* SPDX-License-Identifier: Apache-2.0 */
/* rt.h: the real-time protocol of Qualisys Track Manager (version 1.22, little-endian), as bytes.
 *
 * A packet is its size (uint32, with these eight bytes), its type (uint32) and a body. Nothing here
 * touches a socket: bytes in, samples out. */
#ifndef QUALISYS_RT_H
#define QUALISYS_RT_H

#include <mhe/abi.h>

#define RT_ERROR 0
#define RT_COMMAND 1
#define RT_XML 2
#define RT_DATA 3
#define RT_NO_MORE_DATA 4
#define RT_EVENT 6
#define RT_HEADER 8
#define RT_LARGEST (64u << 20) /* bytes of a packet that is believed */

#define RT_EVENT_CHANGED 11 /* camera settings changed */
#define RT_EVENT_CLOSED 12  /* QTM is shutting down */

typedef struct rt_packet {
    uint32_t type;
    const uint8_t *body;
    size_t length;
} rt_packet;

/* The first packet of `data`. MHE_OK: *used bytes of it; MHE_RETRY: more bytes are needed;
 * MHE_E_INPUT: this is no such protocol. */
mhe_status rt_take_packet(const uint8_t *data, size_t length, rt_packet *out, size_t *used,
                          mhe_error *err);

/* What the parameters say (GetParameters 3D Analog). Arrays are its own. */
typedef struct rt_analog_device {
    int32_t id, n_channels;
    double rate;
    char *name;
    char **labels, **units;
} rt_analog_device;

typedef struct rt_parameters {
    double frequency; /* Hz, of the capture; 0: not said */
    int32_t up;       /* vertical axis 0..2; -1: not said */
    int32_t n_markers;
    char **markers;
    int32_t n_devices;
    rt_analog_device *devices;
} rt_parameters;

mhe_status rt_parse_parameters(const char *xml, size_t length, rt_parameters *out, mhe_error *err);
void rt_free_parameters(rt_parameters *p);

/* Samples of one data packet. */
typedef struct rt_taker {
    void *data;
    /* Position of the n markers [3 n], m, NaN where not seen. */
    void (*markers)(void *data, double time, int32_t n, const double *position);
    /* n samples of a device's channels [n x n_channels]; the number of the first. */
    void (*analog)(void *data, double time, int32_t device, int32_t n_channels, int32_t n,
                   uint32_t first, const double *values);
} rt_taker;

/* Hands out what stands in the body of a data packet, markers last: a frame has its own EMG.
 * `scratch` [room]: as many doubles as may be needed for one component; what does not fit is
 * MHE_E_INPUT, as is a body that is cut short. Time: s of QTM's own clock. */
mhe_status rt_parse_data(const rt_packet *packet, double *scratch, size_t room,
                         const rt_taker *taker, mhe_error *err);

/* Writes a command packet (its text with a final NUL); returns its bytes, 0: no room. */
size_t rt_write_command(const char *text, uint8_t *out, size_t room);

#endif
