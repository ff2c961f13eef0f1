/* SPDX-License-Identifier: Apache-2.0 */
/* mailbox.c: packets and the queue between sources and the estimator's thread. */
#include "live/intake.h"

#include "base/clock.h"
#include "live/priority.h"

#include <math.h>
#include <pthread.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

struct mhi_mailbox {
    pthread_mutex_t mutex;
    pthread_cond_t filled; /* on CLOCK_MONOTONIC */
    mhi_packet *first, *last;
    int32_t n, woken;
};

static void free_stream(mhi_stream *s) {
    for (int32_t i = 0; s != NULL && i < s->n_channels; i++) {
        free(s->labels == NULL ? NULL : s->labels[i]);
        free(s->units == NULL ? NULL : s->units[i]);
        free(s->came == NULL ? NULL : s->came[i]);
    }
    if (s != NULL) {
        free(s->labels);
        free(s->units);
        free(s->came);
        free(s->named);
        free(s->name);
        free(s);
    }
}

void mhi_packet_free(mhi_packet *p) {
    if (p != NULL) {
        free_stream(p->about);
        free(p->stamp);
        free(p->values);
        free(p->grants);
        free(p->maxima);
        free(p->text);
        free(p);
    }
}

static mhi_packet *new_packet(int32_t kind, int32_t source, int32_t stream) {
    mhi_packet *p = calloc(1, sizeof *p);
    if (p != NULL) {
        p->kind = kind;
        p->source = source;
        p->stream = stream;
        p->offset = NAN;
    }
    return p;
}

static char *copy(const char *text) {
    return strdup(text == NULL ? "" : text);
}

mhi_packet *mhi_packet_stream(int32_t source, int32_t stream, const mhe_stream_info *info) {
    mhi_packet *p = new_packet(MHI_PACKET_STREAM, source, stream);
    mhi_stream *s = calloc(1, sizeof *s);
    if (p == NULL || s == NULL) {
        free(s);
        mhi_packet_free(p);
        return NULL;
    }
    p->about = s;
    s->kind = info->kind;
    s->n_channels = info->n_channels;
    s->up = info->up;
    s->rate = info->rate;
    s->delay = info->delay;
    s->name = copy(info->name);
    s->labels = calloc((size_t)info->n_channels + 1, sizeof *s->labels);
    s->units = calloc((size_t)info->n_channels + 1, sizeof *s->units);
    s->came = calloc((size_t)info->n_channels + 1, sizeof *s->came);
    s->named = calloc((size_t)info->n_channels + 1, 1);
    int whole = s->name != NULL && s->labels != NULL && s->units != NULL && s->came != NULL &&
                s->named != NULL;
    for (int32_t i = 0; i < info->n_channels && whole; i++) {
        s->named[i] = info->named != NULL && info->named[i];
        s->labels[i] = copy(info->labels[i]);
        s->units[i] = copy(info->units == NULL ? NULL : info->units[i]);
        s->came[i] = copy(info->labels[i]);
        whole = s->labels[i] != NULL && s->units[i] != NULL && s->came[i] != NULL;
    }
    if (!whole) {
        mhi_packet_free(p);
        return NULL;
    }
    return p;
}

/* n structs of a source's size as such of ours; NULL: no memory. */
static void *copy_structs(const void *from, int32_t n, size_t stride, size_t size) {
    char *to = calloc((size_t)n + 1, size);
    for (int32_t i = 0; i < n && to != NULL; i++) {
        memcpy(to + (size_t)i * size, (const char *)from + (size_t)i * stride,
               stride < size ? stride : size);
    }
    return to;
}

#define CHUNK_HAS(chunk, field) \
    ((chunk)->size >= offsetof(mhe_chunk, field) + sizeof(chunk)->field && (chunk)->field != NULL)

/* What a repetition says of the samples. 0: no memory. */
static int copy_recorded(mhi_packet *p, const mhe_chunk *c) {
    if (CHUNK_HAS(c, grants)) {
        p->grants = copy_structs(c->grants, c->n_grants, c->grant_size, sizeof *p->grants);
        p->n_grants = p->grants == NULL ? 0 : c->n_grants;
    }
    if (CHUNK_HAS(c, maxima)) {
        p->maxima = copy_structs(c->maxima, c->n_maxima, c->maximum_size, sizeof *p->maxima);
        p->n_maxima = p->maxima == NULL ? 0 : c->n_maxima;
    }
    return (!CHUNK_HAS(c, grants) || p->grants != NULL) &&
           (!CHUNK_HAS(c, maxima) || p->maxima != NULL);
}

mhi_packet *mhi_packet_samples(int32_t source, int32_t n_channels, const mhe_chunk *chunk) {
    mhi_packet *p = new_packet(MHI_PACKET_SAMPLES, source, chunk->stream);
    if (p == NULL) {
        return NULL;
    }
    const size_t n = (size_t)chunk->n, numbers = n * (size_t)n_channels;
    p->n = chunk->n;
    p->n_channels = n_channels;
    p->received = chunk->received;
    p->stamp = chunk->stamp == NULL ? NULL : malloc(sizeof(double) * (n + 1));
    p->values = malloc(sizeof(double) * (numbers + 1));
    if (p->values == NULL || (chunk->stamp != NULL && p->stamp == NULL)) {
        mhi_packet_free(p);
        return NULL;
    }
    if (chunk->stamp != NULL) {
        memcpy(p->stamp, chunk->stamp, sizeof(double) * n);
    }
    memcpy(p->values, chunk->values, sizeof(double) * numbers);
    if (!copy_recorded(p, chunk)) {
        mhi_packet_free(p);
        return NULL;
    }
    return p;
}

mhi_packet *mhi_packet_event(int32_t source, int32_t event, int32_t stream, const char *text) {
    mhi_packet *p = new_packet(MHI_PACKET_EVENT, source, stream);
    if (p != NULL) {
        p->event = event;
        p->text = copy(text);
    }
    return p;
}

mhi_mailbox *mhi_mailbox_create(int32_t inherits) {
    mhi_mailbox *box = calloc(1, sizeof *box);
    pthread_condattr_t attributes;
    if (box != NULL) {
        mhi_priority_mutex(&box->mutex, inherits);
        (void)pthread_condattr_init(&attributes);
        (void)pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
        (void)pthread_cond_init(&box->filled, &attributes);
        (void)pthread_condattr_destroy(&attributes);
    }
    return box;
}

void mhi_mailbox_free(mhi_mailbox *box) {
    if (box == NULL) {
        return;
    }
    while (box->first != NULL) {
        mhi_packet *p = box->first;
        box->first = p->next;
        mhi_packet_free(p);
    }
    (void)pthread_cond_destroy(&box->filled);
    (void)pthread_mutex_destroy(&box->mutex);
    free(box);
}

void mhi_mailbox_put(mhi_mailbox *box, mhi_packet *packet) {
    if (packet == NULL) {
        return;
    }
    packet->put = mhi_seconds();
    (void)pthread_mutex_lock(&box->mutex);
    packet->next = NULL;
    *(box->first == NULL ? &box->first : &box->last->next) = packet;
    box->last = packet;
    box->n++;
    (void)pthread_cond_signal(&box->filled);
    (void)pthread_mutex_unlock(&box->mutex);
}

void mhi_mailbox_put_back(mhi_mailbox *box, mhi_packet *packet) {
    (void)pthread_mutex_lock(&box->mutex);
    packet->next = box->first;
    box->last = box->first == NULL ? packet : box->last;
    box->first = packet;
    box->n++;
    (void)pthread_mutex_unlock(&box->mutex);
}

mhi_packet *mhi_mailbox_take(mhi_mailbox *box, double deadline) {
    const struct timespec until = {(time_t)deadline, (long)(1e9 * (deadline - floor(deadline)))};
    int code = 0;
    (void)pthread_mutex_lock(&box->mutex);
    while (box->first == NULL && !box->woken && code == 0) {
        code = pthread_cond_timedwait(&box->filled, &box->mutex, &until);
    }
    box->woken = 0;
    mhi_packet *p = box->first;
    if (p != NULL) {
        box->first = p->next;
        box->n--;
    }
    (void)pthread_mutex_unlock(&box->mutex);
    return p;
}

int32_t mhi_mailbox_waiting(mhi_mailbox *box) {
    (void)pthread_mutex_lock(&box->mutex);
    const int32_t n = box->n;
    (void)pthread_mutex_unlock(&box->mutex);
    return n;
}

void mhi_mailbox_wake(mhi_mailbox *box) {
    (void)pthread_mutex_lock(&box->mutex);
    box->woken = 1;
    (void)pthread_cond_signal(&box->filled);
    (void)pthread_mutex_unlock(&box->mutex);
}
