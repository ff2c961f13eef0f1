/* SPDX-License-Identifier: Apache-2.0 */
#include "live/intake.h"

#include "base/clock.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <time.h>

#define OPEN_TRY 0.5 /* s that one try to connect may take, about */
#define READ_TRY 0.05
#define PAUSE 0.2 /* s between two tries */

struct mhi_intake {
    const mhe_source_ops *ops;
    void *self;
    int32_t number;
    double delay;
    mhi_mailbox *box;
    pthread_t thread;
    int32_t *channels; /* [count] of each stream, as described last */
    int32_t n_streams;
    atomic_int stop;
    pthread_mutex_t mutex; /* of what follows */
    int32_t ready, ended;
    mhe_status status;
    mhe_error why;
};

static void set_state(mhi_intake *in, int32_t ready, int32_t ended, mhe_status status,
                      const mhe_error *why) {
    (void)pthread_mutex_lock(&in->mutex);
    in->ready = ready;
    in->ended = ended;
    in->status = status;
    in->why = why == NULL ? (mhe_error){0} : *why;
    (void)pthread_mutex_unlock(&in->mutex);
}

/* Puts descriptions of all streams (or of one) into the mailbox. */
static mhe_status describe(mhi_intake *in, int32_t only, mhe_error *err) {
    const int32_t n = in->ops->count(in->self);
    if (n != in->n_streams) {
        int32_t *grown = realloc(in->channels, sizeof *grown * ((size_t)n + 1));
        if (grown == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        in->channels = grown;
        in->n_streams = n;
        only = -1;
    }
    for (int32_t i = only < 0 ? 0 : only; i < (only < 0 ? n : only + 1); i++) {
        mhe_stream_info info = {.size = sizeof info, .up = -1};
        const mhe_status status = in->ops->stream(in->self, i, &info, err);
        if (status != MHE_OK) {
            return status;
        }
        if (info.n_channels < 1 || info.labels == NULL) {
            return mhe_fail(err, MHE_E_PLUGIN, "a stream without channels or labels");
        }
        in->channels[i] = info.n_channels;
        info.delay += in->delay;
        mhi_mailbox_put(in->box, mhi_packet_stream(in->number, i, &info));
    }
    return MHE_OK;
}

static void take_chunk(void *data, const mhe_chunk *chunk) {
    mhi_intake *in = data;
    if (chunk->stream < 0 || chunk->stream >= in->n_streams || chunk->n < 1) {
        return;
    }
    mhi_packet *p = mhi_packet_samples(in->number, in->channels[chunk->stream], chunk);
    double offset = 0;
    if (p != NULL && in->ops->clock_offset != NULL &&
        in->ops->clock_offset(in->self, chunk->stream, &offset, NULL) == MHE_OK) {
        p->offset = offset;
    }
    mhi_mailbox_put(in->box, p);
}

static void take_event(void *data, int32_t event, int32_t stream, const char *text) {
    mhi_intake *in = data;
    if (event == MHE_SOURCE_CHANGED) {
        (void)describe(in, stream, NULL);
    }
    if (event == MHE_SOURCE_ENDED) {
        set_state(in, 1, 1, MHE_OK, NULL);
    }
    mhi_mailbox_put(in->box, mhi_packet_event(in->number, event, stream, text));
}

static int stopped(const mhi_intake *in) {
    return atomic_load_explicit(&in->stop, memory_order_relaxed);
}

static void rest(double seconds) {
    const struct timespec t = {0, (long)(1e9 * seconds)};
    (void)nanosleep(&t, NULL);
}

static mhe_status open_source(mhi_intake *in, mhe_error *err) {
    mhe_status status = MHE_RETRY;
    while (status == MHE_RETRY && !stopped(in)) {
        mhe_error why = {0};
        status = in->ops->open(in->self, mhi_seconds() + OPEN_TRY, &why);
        if (status == MHE_RETRY) {
            set_state(in, 0, 0, MHE_OK, &why);
            rest(PAUSE);
        } else if (status != MHE_OK) {
            return mhe_fail(err, status, "%s", why.text);
        }
    }
    return status == MHE_OK ? describe(in, -1, err) : status;
}

static void *run(void *data) {
    mhi_intake *in = data;
    const mhe_source_taker taker = {sizeof taker, in, take_chunk, take_event};
    mhe_error err = {0};
    /* A thread that rests between two looks is woken when it asked for, not 50 us later. */
    (void)prctl(PR_SET_TIMERSLACK, 1000UL, 0UL, 0UL, 0UL);
    mhe_status status = open_source(in, &err);
    if (status == MHE_OK) {
        set_state(in, 1, 0, MHE_OK, NULL);
    }
    int32_t ended = 0;
    while (status == MHE_OK && !stopped(in) && !ended) {
        status = in->ops->read(in->self, mhi_seconds() + READ_TRY, &taker, &err);
        (void)mhi_intake_status(in, &ended, NULL);
    }
    if (status != MHE_OK && !stopped(in)) {
        set_state(in, 0, 1, status, &err);
        mhi_mailbox_put(in->box, mhi_packet_event(in->number, MHE_SOURCE_LOST, -1, err.text));
    }
    return NULL;
}

mhe_status mhi_intake_start(const mhe_host *host, const mhe_plugin *plugin, const void *config,
                            int32_t number, double delay, mhi_mailbox *box, mhi_intake **intake,
                            mhe_error *err) {
    *intake = NULL;
    mhi_intake *in = calloc(1, sizeof *in);
    if (in == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    in->ops = plugin->ops;
    in->number = number;
    in->delay = delay;
    in->box = box;
    mhe_error why = {0};
    const mhe_status status = in->ops->create(host, config, &in->self, &why);
    if (status != MHE_OK) {
        free(in);
        return mhe_fail(err, status, "%s: %s", plugin->id, why.text);
    }
    (void)pthread_mutex_init(&in->mutex, NULL);
    if (pthread_create(&in->thread, NULL, run, in) != 0) {
        in->ops->destroy(in->self);
        (void)pthread_mutex_destroy(&in->mutex);
        free(in);
        return mhe_fail(err, MHE_E_MEMORY, "a thread cannot be started");
    }
    *intake = in;
    return MHE_OK;
}

int32_t mhi_intake_ready(mhi_intake *in, char *missing, size_t room) {
    (void)pthread_mutex_lock(&in->mutex);
    const int32_t ready = in->ready;
    (void)snprintf(missing, room, "%s", in->why.text);
    (void)pthread_mutex_unlock(&in->mutex);
    return ready;
}

mhe_status mhi_intake_status(mhi_intake *in, int32_t *ended, mhe_error *err) {
    (void)pthread_mutex_lock(&in->mutex);
    const mhe_status status = in->status;
    *ended = in->ended;
    if (status != MHE_OK && err != NULL) {
        *err = in->why;
    }
    (void)pthread_mutex_unlock(&in->mutex);
    return status;
}

void mhi_intake_stop(mhi_intake *in) {
    if (in == NULL) {
        return;
    }
    atomic_store(&in->stop, 1);
    (void)pthread_join(in->thread, NULL);
    in->ops->destroy(in->self);
    (void)pthread_mutex_destroy(&in->mutex);
    free(in->channels);
    free(in);
}
