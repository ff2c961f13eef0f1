/* SPDX-License-Identifier: Apache-2.0 */
/* qtm_server.h: the real-time protocol of Qualisys Track Manager from the other side, on a port of
 * loopback that the system chooses. What it streams is a formula of the frame's number, so that
 * every client can be asked for it. */
#ifndef TEST_QTM_SERVER_H
#define TEST_QTM_SERVER_H

#include <stdint.h>

/* What it does from now on. */
enum {
    QTM_STREAM,  /* frames, as asked for */
    QTM_PAUSE,   /* nothing */
    QTM_CLOSE,   /* closes the connections and takes none */
    QTM_GARBAGE, /* bytes of no protocol */
    QTM_HUGE,    /* a packet that says it is of 4 GB */
    QTM_CUT,     /* data packets whose components are cut short */
    QTM_OTHER,   /* tells that settings changed, streams marker C for B */
    QTM_FEWER,   /* without telling streams marker A alone */
    QTM_END,     /* no more data */
    QTM_BAD_XML, /* parameters that are none */
    QTM_LOSE,    /* every other frame's analog samples are lost */
    QTM_TURNED,  /* welcomes in the other byte order */
    QTM_OLD,     /* does not know the protocol's version */
    QTM_BARE,    /* has no labelled markers */
    QTM_2D,      /* data of another component than 3D */
    QTM_BACK,    /* frames begin anew at time 0 */
    QTM_AMID,    /* half a packet, then nothing */
    QTM_UNLIKE,  /* data of three markers, described as two */
    QTM_SPEED,   /* tells that settings changed: analog samples come at 1000 Hz */
    QTM_SIZE,    /* components that say they are larger than their packet */
    QTM_SAYS     /* an error, of two lines */
};

typedef struct qtm_server qtm_server;

qtm_server *qtm_server_start(int32_t port); /* 0: the system chooses; NULL: it cannot */
int32_t qtm_server_port(const qtm_server *server);
void qtm_server_set(qtm_server *server, int what);
void qtm_server_stop(qtm_server *server); /* NULL is fine */

/* The formula: mm of marker i, axis a, in frame k (NaN: not seen); volts of channel c, sample n. */
float qtm_marker(int64_t k, int32_t i, int32_t a);
float qtm_analog(int64_t n, int32_t c);
#define QTM_SAMPLES 5 /* of each channel a frame */

#endif
