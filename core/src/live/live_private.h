/* SPDX-License-Identifier: Apache-2.0 */
/* live_private.h: the live run's parts, shared by its files. */
#ifndef MHI_LIVE_PRIVATE_H
#define MHI_LIVE_PRIVATE_H

#include "library/config.h"
#include "live/feed.h"
#include "live/outlets.h"
#include "live/priority.h"
#include "live/taping.h"

#include <mhe/live.h>
#include <pthread.h>
#include <stdatomic.h>

#define MHI_LIVE_STATE 61440 /* bytes */
#define MHI_LIVE_REQUESTS 16
#define MHI_LIVE_EDITS 256 /* labels that can be given other names */

typedef struct mhi_live_request {
    int32_t what; /* MHE_CONTROL_* */
    char text[256];
} mhi_live_request;

/* A label of a stream, and what it is called from now on. */
typedef struct mhi_live_edit {
    char came[128], name[128];
} mhi_live_edit;

struct mhe_live {
    mhe_config *config;
    const mhi_run *run;
    const mhe_host *host;
    mhe_host own_host;
    const mhe_description *model;
    const char *folder;
    double wait;
    mhe_estimator *estimator;
    mhi_feed feed;
    mhi_outlets *outlets;
    mhe_sink_control control;
    mhi_mailbox *box;
    mhi_intake **intakes;
    mhi_packet *streams; /* newest description of each stream */
    mhi_taping *record;  /* NULL: none is made */
    mhe_status record_status;
    mhe_error record_why;
    int32_t n_recordings;
    int32_t work;        /* a frame was estimated and the next is not prepared yet */
    double newest;       /* s of CLOCK_MONOTONIC, node of the last estimate */
    int32_t mvc_channel; /* -1: none is looked for */
    double mvc_began;    /* s */
    char mvc_file[512];
    int32_t n_edits;
    mhi_live_edit *edits;  /* [MHI_LIVE_EDITS] */
    mhi_priority priority; /* of the thread of run */
    atomic_int stop;
    pthread_mutex_t mutex; /* of what follows: sinks' threads */
    int32_t n_requests;
    mhi_live_request requests[MHI_LIVE_REQUESTS];
    char state[MHI_LIVE_STATE];
    int32_t state_length;
};

mhe_status mhi_live_begin(mhe_live *live, mhe_error *err);
void mhi_live_end_record(mhe_live *live, const char *why); /* NULL: as was wished */

mhe_status mhi_live_take(mhe_live *live, mhi_packet *packet, mhe_error *err); /* takes it over */

/* control.c: what may be asked. */
void mhi_live_set_control(mhe_live *live);
void mhi_live_serve(mhe_live *live); /* requests that have come */

/* command.c: a request as a line. MHE_E_ARGUMENT: it is none. */
mhe_status mhi_live_parse(const char *line, mhi_live_request *request, mhe_error *err);

/* state.c: what is told. */
void mhi_live_publish(mhe_live *live); /* the state as JSON */

/* labels.c: other names for labels of streams. Such a stream is described anew, so that a recording
 * has it as it was taken. */
mhe_status mhi_live_relabel(mhe_live *live, const char *text, mhe_error *err); /* "CAME=MODEL" */
mhe_status mhi_live_name(const mhe_live *live, mhi_packet *stream, mhe_error *err);

/* mvc.c: maximal contractions. */
mhi_inlet *mhi_live_electrodes(mhe_live *live); /* the stream of electrodes; NULL: none */
void mhi_live_begin_mvc(mhe_live *live, const char *name);
void mhi_live_end_mvc(mhe_live *live);
/* The run takes a maximum from the next packet on, and its recording says so. */
void mhi_live_take_mvc(mhe_live *live, int32_t channel, double value);

#endif
