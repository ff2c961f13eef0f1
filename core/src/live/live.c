/* SPDX-License-Identifier: Apache-2.0 */
/* live.c: the run: packets in, estimates out, requests in between. */
#include "live/live_private.h"

#include "base/clock.h"
#include "config/tree.h"
#include "estimator/create.h"
#include "live/recorded.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define LOOK 0.02        /* s of one wait for a packet */
#define STATE_EVERY 0.25 /* s */
#define TELL_EVERY 5.0   /* s between two lines about what is missing */

/* ---- the host that sources and sinks see ---- */

static void host_log(const mhe_host *host, int32_t level, const char *text) {
    const mhe_live *l = host->data;
    l->host->log(l->host, level, text);
}

static const void *host_service(const mhe_host *host, const char *id) {
    const mhe_live *l = host->data;
    return strcmp(id, MHE_RECORDED_SERVICE) == 0 ? &mhi_recorded_service
                                                 : l->host->service(l->host, id);
}

/* ---- open ---- */

static mhe_status start_sources(mhe_live *l, mhe_error *err) {
    const mhi_use_list *list = &l->run->sources;
    if (list->n == 0) {
        const mhi_node *empty = mhi_node_find(mhi_tree_root(l->run->tree), "sources");
        return mhi_fail_at(err, MHE_E_CONFIG, l->run->tree, empty,
                           "%s: where do the data come from? As in sources: [{plugin: ID, ...}] "
                           "(mhe-run --list-plugins)",
                           empty == NULL ? "there is no section 'sources'"
                                         : "the section 'sources' is empty");
    }
    l->intakes = calloc((size_t)list->n, sizeof(mhi_intake *));
    if (l->intakes == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < list->n && status == MHE_OK; i++) {
        mhe_error why = {0};
        status = mhi_intake_start(&l->own_host, list->uses[i].plugin, list->uses[i].config, i,
                                  list->uses[i].delay, l->box, &l->intakes[i], &why);
        if (status != MHE_OK) {
            return mhi_fail_at(err, status, l->run->tree, list->uses[i].node, "%s", why.text);
        }
    }
    return status;
}

static void take_estimate(void *data, const mhe_estimate *estimate, double host_time) {
    mhe_live *l = data;
    mhi_outlets_give(l->outlets, estimate, host_time);
    if (l->record != NULL) {
        mhe_error err = {0};
        if (mhi_taping_frame(l->record, estimate, host_time, &err) != MHE_OK) {
            mhi_live_end_record(l, err.text);
        }
    }
    l->newest = host_time;
    l->work = 1;
}

static void take_grant(void *data, const mhe_grant *grant, double host_time) {
    mhe_live *l = data;
    mhe_error err = {0};
    if (l->record != NULL && mhi_taping_grant(l->record, grant, host_time, &err) != MHE_OK) {
        mhi_live_end_record(l, err.text);
    }
}

static mhe_status open_estimator(mhe_live *l, mhe_error *err) {
    mhe_status status = mhi_config_model(l->config, &l->model, err);
    if (status == MHE_OK) {
        status = mhe_estimator_create(l->config, &l->estimator, err);
    }
    if (status == MHE_OK) {
        mhi_estimator_set_stop(l->estimator, &l->stop);
        status = mhi_feed_open(&l->feed, l->host, l->run, l->model, l->estimator, err);
    }
    if (status == MHE_OK && strcmp(l->run->output.node_name, "auto") == 0) {
        mhi_estimator_set_node(l->estimator, l->run->horizon.window); /* of the newest frame */
    }
    l->feed.taker = take_estimate;
    l->feed.pusher = take_grant;
    l->feed.data = l;
    return status;
}

mhe_status mhe_live_open(mhe_config *config, const mhe_live_setup *setup, mhe_live **live,
                         mhe_error *err) {
    if (live == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "there is no place for the live run");
    }
    *live = NULL;
    if (config == NULL || setup == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "a live run needs a config and a setup");
    }
    mhe_live *l = calloc(1, sizeof *l);
    if (l == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    l->config = config;
    l->run = config->run;
    l->host = config->host;
    l->own_host = (mhe_host){sizeof l->own_host, l, host_log, host_service};
    l->folder = setup->folder == NULL ? "." : setup->folder;
    l->wait = setup->wait;
    l->mvc_channel = -1;
    mhi_priority_mutex(&l->mutex, l->run->realtime.priority > 0);
    l->box = mhi_mailbox_create(l->run->realtime.priority > 0); /* sinks' requests wake it */
    mhe_status status =
        l->box == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : open_estimator(l, err);
    if (status == MHE_OK) {
        mhi_live_set_control(l);
        const mhi_outlets_setup sinks = {&l->own_host,  l->run,    l->model,
                                         &l->feed.info, l->folder, &l->control};
        status = mhi_outlets_start(&sinks, &l->outlets, err);
    }
    if (status == MHE_OK && setup->record != NULL) {
        status = mhi_taping_open(setup->record, l->run->name, &l->record, err);
    }
    if (status == MHE_OK) {
        status = start_sources(l, err);
    }
    if (status != MHE_OK) {
        mhe_live_close(l);
        return status;
    }
    *live = l;
    return MHE_OK;
}

void mhe_live_close(mhe_live *l) {
    if (l == NULL) {
        return;
    }
    for (int32_t i = 0; i < l->run->sources.n && l->intakes != NULL; i++) {
        mhi_intake_stop(l->intakes[i]);
    }
    mhi_outlets_stop(l->outlets);
    (void)mhi_taping_close(l->record, NULL);
    mhi_feed_close(&l->feed);
    mhe_estimator_close(l->estimator);
    mhi_mailbox_free(l->box);
    for (mhi_packet *p = l->streams; p != NULL;) {
        mhi_packet *next = p->next;
        mhi_packet_free(p);
        p = next;
    }
    (void)pthread_mutex_destroy(&l->mutex);
    free((void *)l->intakes);
    free(l->edits);
    free(l);
}

void mhe_live_stop(mhe_live *l) {
    if (l != NULL) {
        atomic_store(&l->stop, 1);
    }
}

/* ---- recording ---- */

void mhi_live_end_record(mhe_live *l, const char *why) {
    char line[MHE_ERROR_TEXT + 32];
    mhe_error err = {0};
    mhi_taping *record = l->record;
    l->record = NULL;
    if (why != NULL) {
        (void)snprintf(line, sizeof line, "the recording has ended: %s", why);
        l->host->log(l->host, MHE_LOG_ERROR, line);
        l->record_status = MHE_E_IO;
        (void)snprintf(l->record_why.text, sizeof l->record_why.text, "%s", why);
    }
    if (mhi_taping_close(record, &err) != MHE_OK && why == NULL) {
        l->host->log(l->host, MHE_LOG_ERROR, err.text);
        l->record_status = MHE_E_IO;
        l->record_why = err;
    }
}

/* Streams are described in a recording that begins later, too. */
static void keep_stream(mhe_live *l, mhi_packet *p) {
    for (mhi_packet **at = &l->streams; *at != NULL; at = &(*at)->next) {
        if ((*at)->source == p->source && (*at)->stream == p->stream) {
            mhi_packet *old = *at;
            p->next = old->next;
            *at = p;
            mhi_packet_free(old);
            return;
        }
    }
    p->next = NULL; /* in the order in which they were described: the first of a kind counts */
    mhi_packet **end = &l->streams;
    while (*end != NULL) {
        end = &(*end)->next;
    }
    *end = p;
}

static void record_packet(mhe_live *l, const mhi_packet *p) {
    mhe_error err = {0};
    if (l->record != NULL && mhi_taping_take(l->record, p, &err) != MHE_OK) {
        mhi_live_end_record(l, err.text);
    }
}

/* ---- the loop ---- */

/* Samples that waited too long in the queue. A source that keeps to no clock (a recording as fast
 * as it goes) says so by another time of receipt: it waits as long as it must. */
static int32_t is_behind(const mhe_live *l, const mhi_packet *p) {
    const double most = l->run->realtime.most_behind;
    return most > 0 && p->kind == MHI_PACKET_SAMPLES && fabs(p->put - p->received) < 1 &&
           mhi_seconds() - p->put > most;
}

mhe_status mhi_live_take(mhe_live *l, mhi_packet *p, mhe_error *err) {
    if (p->kind == MHI_PACKET_STREAM && mhi_live_name(l, p, err) != MHE_OK) {
        mhi_packet_free(p);
        return MHE_E_MEMORY;
    }
    for (int32_t k = 0; k < p->n_maxima && l->feed.running; k++) {
        mhi_live_take_mvc(l, p->maxima[k].channel, p->maxima[k].value);
    }
    if (l->feed.running || p->kind == MHI_PACKET_STREAM) {
        record_packet(l, p);
    }
    l->feed.behind = is_behind(l, p);
    const mhe_status status = mhi_feed_take(&l->feed, p, err);
    if (p->kind == MHI_PACKET_STREAM) {
        keep_stream(l, p);
    } else {
        mhi_packet_free(p);
    }
    return status;
}

static int stopped(const mhe_live *l) {
    return atomic_load_explicit(&l->stop, memory_order_relaxed);
}

/* What sources wait for, in one line; "" where all are there. */
static int32_t list_missing(mhe_live *l, char *text, size_t room) {
    int32_t n = 0;
    size_t at = 0;
    text[0] = '\0';
    for (int32_t i = 0; i < l->run->sources.n; i++) {
        char missing[256];
        if (!mhi_intake_ready(l->intakes[i], missing, sizeof missing)) {
            const int written = snprintf(text + at, room - at, "%s%s: %.200s", n == 0 ? "" : "; ",
                                         l->run->sources.uses[i].plugin->id,
                                         missing[0] == '\0' ? "is being opened" : missing);
            at += written > 0 && (size_t)written < room - at ? (size_t)written : 0;
            n++;
        }
    }
    return n;
}

static mhe_status check_sources(mhe_live *l, int32_t *n_ended, mhe_error *err) {
    *n_ended = 0;
    for (int32_t i = 0; i < l->run->sources.n; i++) {
        int32_t ended = 0;
        const mhe_status status = mhi_intake_status(l->intakes[i], &ended, err);
        *n_ended += ended;
        if (status != MHE_OK && !l->feed.running) {
            return status;
        }
    }
    return MHE_OK;
}

static mhe_status wait_for_streams(mhe_live *l, mhe_error *err) {
    const double begin = mhi_seconds();
    double told = begin + 1 - TELL_EVERY;
    char missing[1024];
    int32_t ended = 0;
    mhe_status status = MHE_OK;
    while (status == MHE_OK && !stopped(l) && list_missing(l, missing, sizeof missing) > 0) {
        const double now = mhi_seconds();
        if (now - told > TELL_EVERY) {
            char line[1200];
            (void)snprintf(line, sizeof line, "waiting for %s", missing);
            l->host->log(l->host, MHE_LOG_INFO, line);
            told = now;
        }
        if (l->wait > 0 && now - begin > l->wait) {
            return mhe_fail(err, MHE_E_IO, "after %g s still waiting for %.700s", l->wait, missing);
        }
        mhi_packet *p = mhi_mailbox_take(l->box, now + LOOK);
        if (p != NULL && p->kind == MHI_PACKET_SAMPLES &&
            list_missing(l, missing, sizeof missing) == 0) {
            mhi_mailbox_put_back(l->box, p); /* the last source is there: the run's first sample */
            break;
        }
        status = p == NULL ? MHE_OK : mhi_live_take(l, p, err);
        status = status == MHE_OK ? check_sources(l, &ended, err) : status;
        mhi_live_serve(l);
    }
    return status;
}

static mhe_status loop(mhe_live *l, double seconds, mhe_error *err) {
    mhe_status status = MHE_OK;
    double state_told = 0;
    int32_t ended = 0;
    while (status == MHE_OK && !stopped(l)) {
        const double now = mhi_seconds();
        const int idle = mhi_mailbox_waiting(l->box) == 0;
        if (idle && l->work) { /* the time until the next frame */
            l->work = 0;
            mhi_feed_prepare(&l->feed);
        }
        mhi_packet *p = mhi_mailbox_take(l->box, now + LOOK);
        if (p != NULL) {
            status = mhi_live_take(l, p, err);
        } else {
            status = check_sources(l, &ended, err);
            if (ended == l->run->sources.n) {
                break;
            }
        }
        if (now - state_told > STATE_EVERY) {
            state_told = now;
            mhi_live_publish(l);
        }
        mhi_live_serve(l);
        if (seconds > 0 && l->feed.n_estimates > 0 && l->feed.last >= seconds) {
            break;
        }
    }
    return status;
}

mhe_status mhe_live_run(mhe_live *l, double seconds, mhe_error *err) {
    if (l == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "there is no live run");
    }
    mhe_status status = wait_for_streams(l, err);
    if (status == MHE_OK && !stopped(l)) {
        status = mhi_live_begin(l, err);
    }
    mhi_priority_take(l->run, l->host, &l->priority);
    if (status == MHE_OK) {
        status = loop(l, seconds, err);
    }
    mhi_priority_give_back(&l->priority);
    status = status == MHE_E_INTERRUPTED ? MHE_OK : status;
    if (l->record != NULL) {
        mhi_live_end_record(l, NULL);
    }
    if (status == MHE_OK && l->record_status != MHE_OK) {
        status = mhe_fail(err, l->record_status, "%s", l->record_why.text);
    }
    return status;
}

/* Descriptions that are still on their way are taken, samples before them kept for the run. */
static mhe_status take_descriptions(mhe_live *l, mhe_error *err) {
    mhe_status status = MHE_OK;
    mhi_packet *kept = NULL; /* the newest first */
    const double until = mhi_seconds() + 0.2;
    int32_t n = 0;
    while (status == MHE_OK && n < l->run->sources.n && mhi_seconds() < until) {
        mhi_packet *p = mhi_mailbox_take(l->box, mhi_seconds() + LOOK);
        if (p != NULL && p->kind == MHI_PACKET_SAMPLES) {
            p->next = kept;
            kept = p;
        } else if (p != NULL) {
            status = mhi_live_take(l, p, err);
        }
        n = 0;
        for (int32_t i = 0; i < l->run->sources.n; i++) {
            n += mhi_feed_inlet(&l->feed, i, 0) != NULL;
        }
    }
    while (kept != NULL) {
        mhi_packet *p = kept;
        kept = p->next;
        mhi_mailbox_put_back(l->box, p);
    }
    return status;
}

/* All streams that were described so far decide what drives the run. */
mhe_status mhi_live_begin(mhe_live *l, mhe_error *err) {
    mhe_status status = take_descriptions(l, err);
    status = status == MHE_OK ? mhi_feed_begin(&l->feed, err) : status;
    if (status == MHE_OK) {
        const mhi_inlet *in = &l->feed.inlets[l->feed.driver];
        char line[256];
        (void)snprintf(line, sizeof line, "frames come from '%.100s': %d of %d labels found",
                       in->name, (int)in->n_found, (int)in->n_labels);
        l->host->log(l->host, MHE_LOG_INFO, line);
    }
    return status;
}
