/* SPDX-License-Identifier: Apache-2.0 */
/* live_private.h: the live run's parts, shared by its files. */
#ifndef MHI_LIVE_PRIVATE_H
#define MHI_LIVE_PRIVATE_H

#include "library/config.h"
#include "live/feed.h"
#include "live/outlets.h"
#include "live/taping.h"

#include <mhe/live.h>
#include <pthread.h>
#include <stdatomic.h>

#define MHI_LIVE_STATE 12288 /* bytes */
#define MHI_LIVE_REQUESTS 16

typedef struct mhi_live_request {
    int32_t what; /* MHE_CONTROL_* */
    char text[256];
} mhi_live_request;

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
    double mvc[64];      /* maxima found; 0: not yet */
    char mvc_file[512];
    atomic_int stop;
    pthread_mutex_t mutex; /* of what follows: sinks' threads */
    int32_t n_requests;
    mhi_live_request requests[MHI_LIVE_REQUESTS];
    char state[MHI_LIVE_STATE];
    int32_t state_length;
};

mhe_status mhi_live_begin(mhe_live *live, mhe_error *err);
void mhi_live_end_record(mhe_live *live, const char *why); /* NULL: as was wished */

/* control.c: what sinks may ask, and what they are told. */
void mhi_live_set_control(mhe_live *live);
void mhi_live_serve(mhe_live *live);   /* requests that have come */
void mhi_live_publish(mhe_live *live); /* the state as JSON */

#endif
