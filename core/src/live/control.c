/* SPDX-License-Identifier: Apache-2.0 */
/* control.c: requests (stop, record, maximal contractions, labels), from sinks and as lines. */
#include "live/live_private.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static mhe_status ask(mhe_live *l, const mhi_live_request *r, mhe_error *err) {
    mhe_status status = MHE_OK;
    (void)pthread_mutex_lock(&l->mutex);
    if (l->n_requests == MHI_LIVE_REQUESTS) {
        status = mhe_fail(err, MHE_RETRY, "too many requests at once");
    } else {
        l->requests[l->n_requests++] = *r;
    }
    (void)pthread_mutex_unlock(&l->mutex);
    mhi_mailbox_wake(l->box); /* it is served at once, whatever comes or does not */
    return status;
}

static mhe_status request(void *data, int32_t what, const char *text, mhe_error *err) {
    mhi_live_request r = {.what = what};
    (void)snprintf(r.text, sizeof r.text, "%s", text == NULL ? "" : text);
    return ask(data, &r, err);
}

mhe_status mhe_live_command(mhe_live *l, const char *line, mhe_error *err) {
    mhi_live_request r;
    if (l == NULL || line == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "a command needs a live run and a line");
    }
    const mhe_status status = mhi_live_parse(line, &r, err);
    return status == MHE_OK ? ask(l, &r, err) : status;
}

mhe_status mhe_live_state(mhe_live *l, char **json, mhe_error *err) {
    if (l == NULL || json == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "a state needs a live run and a place");
    }
    (void)pthread_mutex_lock(&l->mutex);
    *json = strdup(l->state);
    (void)pthread_mutex_unlock(&l->mutex);
    return *json == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}

static int32_t state(void *data, char *json, int32_t size) {
    mhe_live *l = data;
    (void)pthread_mutex_lock(&l->mutex);
    const int32_t n = l->state_length < size ? l->state_length : 0;
    memcpy(json, n > 0 ? l->state : "{}", (size_t)(n > 0 ? n : 2));
    (void)pthread_mutex_unlock(&l->mutex);
    return n > 0 ? n : 2;
}

void mhi_live_set_control(mhe_live *l) {
    l->control = (mhe_sink_control){sizeof l->control, l, request, state};
    l->state_length = 2;
    memcpy(l->state, "{}", 3);
}

/* ---- recording ---- */

/* The name is made here, never by who asks: <config>-<date>-<time>[-n].xdf in the run's folder. */
static void begin_record(mhe_live *l) {
    char path[1024], date[32];
    const time_t now = time(NULL);
    struct tm day;
    mhe_error err = {0};
    mhe_status status = MHE_E_IO;
    if (l->record != NULL) {
        return;
    }
    (void)localtime_r(&now, &day);
    (void)strftime(date, sizeof date, "%Y%m%d-%H%M%S", &day);
    for (int32_t n = 0; n < 100 && status == MHE_E_IO && l->record == NULL; n++) {
        char number[16] = "";
        if (n > 0) {
            (void)snprintf(number, sizeof number, "-%d", (int)n);
        }
        (void)snprintf(path, sizeof path, "%.700s/%.200s-%s%s.xdf", l->folder, l->run->name, date,
                       number);
        status = mhi_taping_open(path, l->run->name, &l->record, &err);
        if (access(path, F_OK) != 0) {
            break; /* not because it is there */
        }
    }
    for (const mhi_packet *p = l->streams; p != NULL && status == MHE_OK; p = p->next) {
        status = mhi_taping_take(l->record, p, &err);
    }
    for (int32_t i = 0; i < MHI_FEED_MAXIMA && status == MHE_OK; i++) {
        status = l->feed.maxima[i] > 0 ? mhi_taping_maximum(l->record, i, l->feed.maxima[i], &err)
                                       : MHE_OK;
    }
    l->n_recordings += status == MHE_OK;
    if (status != MHE_OK) {
        mhi_live_end_record(l, err.text);
        l->record_status = MHE_OK; /* told; a run that was not to be recorded goes on */
    }
}

static void tell(const mhe_live *l, int32_t level, const char *what, const char *text) {
    char line[MHE_ERROR_TEXT];
    (void)snprintf(line, sizeof line, "%s: %.600s", what, text);
    l->host->log(l->host, level, line);
}

static void serve(mhe_live *l, const mhi_live_request *r) {
    mhe_error err = {0};
    switch (r->what) {
    case MHE_CONTROL_STOP:
        mhe_live_stop(l);
        break;
    case MHE_CONTROL_RECORD_START:
        begin_record(l);
        if (l->record != NULL) {
            tell(l, MHE_LOG_INFO, "recording", mhi_taping_path(l->record));
        }
        break;
    case MHE_CONTROL_RECORD_STOP:
        if (l->record != NULL) {
            tell(l, MHE_LOG_INFO, "recorded", mhi_taping_path(l->record));
            mhi_live_end_record(l, NULL);
        }
        break;
    case MHE_CONTROL_MVC_START:
        mhi_live_begin_mvc(l, r->text);
        if (l->mvc_channel < 0) {
            tell(l, MHE_LOG_WARNING, "there is no such electrode (emg.channels)", r->text);
        }
        break;
    case MHE_CONTROL_MVC_STOP:
        mhi_live_end_mvc(l);
        break;
    default:
        if (mhi_live_relabel(l, r->text, &err) != MHE_OK) {
            tell(l, MHE_LOG_WARNING, "label", err.text);
        }
        break;
    }
}

void mhi_live_serve(mhe_live *l) {
    mhi_live_request all[MHI_LIVE_REQUESTS];
    (void)pthread_mutex_lock(&l->mutex);
    const int32_t n = l->n_requests;
    memcpy(all, l->requests, sizeof *all * (size_t)n);
    l->n_requests = 0;
    (void)pthread_mutex_unlock(&l->mutex);
    for (int32_t i = 0; i < n; i++) {
        serve(l, &all[i]);
    }
    if (n > 0) {
        mhi_live_publish(l);
    }
}
