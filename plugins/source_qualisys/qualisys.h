/* SPDX-License-Identifier: Apache-2.0 */
/* qualisys.h: a connection to Qualisys Track Manager, shared by the source's files. */
#ifndef QUALISYS_H
#define QUALISYS_H

#include "rt.h"

#include <mhe/source.h>

#define ROOM (1u << 20)    /* bytes that are read at once, and grow to a whole packet */
#define NUMBERS (1u << 18) /* of one component */
#define CONNECT 0.5        /* s that connecting anew may take */
#define ANSWER 2.0         /* s that an answer may take */

struct qualisys_config { /* filled by the core from the option table */
    const char *host;
    int32_t port;
    const char *device; /* analog device; "": the first */
    int32_t emg;
    double silence, retry; /* s */
};

/* Stream 0: markers; stream 1: the analog device, where there is one. */
typedef struct qualisys {
    const mhe_host *host;
    struct qualisys_config config;
    int socket; /* -1: none */
    uint8_t *bytes;
    size_t n_bytes, room;
    double *numbers, *stamps;
    rt_parameters parameters;
    int32_t device;         /* number among the parameters' devices; -1: none */
    char **labels, **units; /* of the markers' axes [3 n_markers] */
    const mhe_source_taker *taker;
    double received;
    double tried; /* s, when a connection was tried last */
    int32_t lost;
    int32_t differs;      /* data have other markers or channels than were described */
    double asked;         /* s, when that was asked about last */
    int32_t unlike;       /* that they differ from what is described for good was told */
    double heard;         /* s, of the last 3D data, or the stream's beginning */
    uint32_t next_sample; /* number that the next analog sample should have */
} qualisys;

/* connection.c. Bytes to and fro; MHE_RETRY: not there, closed, or no answer. */
double qualisys_now(void); /* s of CLOCK_MONOTONIC */
mhe_status qualisys_connect(qualisys *s, double deadline, mhe_error *err);
void qualisys_disconnect(qualisys *s);
mhe_status qualisys_send(qualisys *s, const char *command, mhe_error *err);
/* Reads what is there into the buffer, waiting until the deadline. */
mhe_status qualisys_receive(qualisys *s, double deadline, mhe_error *err);
void qualisys_drop(qualisys *s, size_t used);
/* Waits for a packet of a type; others are passed over. Its body is valid until it is dropped. */
mhe_status qualisys_await(qualisys *s, uint32_t type, double deadline, rt_packet *packet,
                          size_t *used, mhe_error *err);
/* What QTM says in a packet of text, in one line. */
mhe_status qualisys_says(const rt_packet *packet, mhe_status status, mhe_error *err);
mhe_status qualisys_ask(qualisys *s, const char *command, uint32_t type, rt_packet *packet,
                        size_t *used, mhe_error *err);

/* settings.c. Asks what is streamed; `same`: nothing is described in another way than before.
 * MHE_RETRY: no markers, not the device. */
mhe_status qualisys_ask_settings(qualisys *s, int *same, mhe_error *err);
void qualisys_free_axes(qualisys *s, int32_t n_markers);

#endif
