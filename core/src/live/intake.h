/* SPDX-License-Identifier: Apache-2.0 */
/* intake.h: a source on a thread of its own, and the queue of what has come. */
#ifndef MHI_INTAKE_H
#define MHI_INTAKE_H

#include <mhe/host.h>
#include <mhe/plugin.h>
#include <mhe/source.h>
#include <stdatomic.h>

/* A description of a stream that stays, whatever the source does. */
typedef struct mhi_stream {
    int32_t kind, n_channels, up;
    double rate, delay;
    char *name;
    char **labels, **units; /* [n_channels] */
    char **came;            /* [n_channels] labels as the sender writes them */
    uint8_t *named;         /* [n_channels] 1: the label has the last word */
} mhi_stream;

/* What came, in the order in which it came. */
#define MHI_PACKET_SAMPLES 0
#define MHI_PACKET_EVENT 1
#define MHI_PACKET_STREAM \
    2 /* description of a stream: before its first samples, and when it changes */

typedef struct mhi_packet mhi_packet;
struct mhi_packet {
    mhi_packet *next;
    int32_t kind;   /* MHI_PACKET_* */
    int32_t source; /* number of the intake */
    int32_t stream; /* -1: the source as a whole */
    int32_t event;  /* MHE_SOURCE_* */
    int32_t n;      /* samples */
    int32_t n_channels;
    double put;        /* s of CLOCK_MONOTONIC, when it came into the queue */
    double received;   /* s of CLOCK_MONOTONIC */
    double offset;     /* s to add to stamps; NaN: not known */
    double *stamp;     /* [n]; NULL: the sender has no clock */
    double *values;    /* [n x n_channels] */
    char *text;        /* of an event */
    mhi_stream *about; /* of a description */
    int32_t n_grants;
    mhe_grant *grants; /* [n_grants] of the frames that these samples were, in a repetition; NULL */
    int32_t n_maxima;
    mhe_maximum *maxima; /* [n_maxima] found before these samples, in a repetition; NULL */
};
void mhi_packet_free(mhi_packet *packet);
mhi_packet *mhi_packet_stream(int32_t source, int32_t stream, const mhe_stream_info *info);
mhi_packet *mhi_packet_samples(int32_t source, int32_t n_channels, const mhe_chunk *chunk);
mhi_packet *mhi_packet_event(int32_t source, int32_t event, int32_t stream, const char *text);

/* The queue that all intakes of a run share. */
typedef struct mhi_mailbox mhi_mailbox;
/* `inherits`: whoever holds it goes as first as whoever waits for it; for a thread of real-time
 * priority alone, since such a lock is handed on in turn, which on a busy machine takes ordinary
 * threads a time slice each. NULL: no memory. */
mhi_mailbox *mhi_mailbox_create(int32_t inherits);
void mhi_mailbox_free(mhi_mailbox *box);
void mhi_mailbox_put(mhi_mailbox *box, mhi_packet *packet); /* takes it over; NULL is fine. [any] */
/* The oldest packet, which becomes the caller's; waits for one until `deadline` (s of
 * CLOCK_MONOTONIC); NULL: none came. [any] */
mhi_packet *mhi_mailbox_take(mhi_mailbox *box, double deadline);
void mhi_mailbox_put_back(mhi_mailbox *box, mhi_packet *packet); /* the oldest again. [any] */
int32_t mhi_mailbox_waiting(mhi_mailbox *box);                   /* packets in it. [any] */
void mhi_mailbox_wake(mhi_mailbox *box); /* whoever waits comes back. [any] */

typedef struct mhi_intake mhi_intake;

/* Creates the plugin's instance and starts its thread, which connects, tries again where it must,
 * and reads until mhi_intake_stop. `delay`: s that all its stamps are late by. [cold] */
mhe_status mhi_intake_start(const mhe_host *host, const mhe_plugin *plugin, const void *config,
                            int32_t number, double delay, mhi_mailbox *box, mhi_intake **intake,
                            mhe_error *err);
/* Is it connected? Else `missing` says what it waits for. [any] */
int32_t mhi_intake_ready(mhi_intake *intake, char *missing, size_t room);
/* Why it has ended for good: MHE_OK while it runs or where its recording has ended. [any] */
mhe_status mhi_intake_status(mhi_intake *intake, int32_t *ended, mhe_error *err);
void mhi_intake_stop(mhi_intake *intake); /* NULL is fine. [cold] */

#endif
