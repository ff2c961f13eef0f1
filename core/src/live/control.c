/* SPDX-License-Identifier: Apache-2.0 */
/* control.c: requests of sinks (stop, record, maximal contractions), and the state of the run. */
#include "live/live_private.h"

#include "base/clock.h"
#include "base/text.h"

#include <cJSON.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define MVC_MOST 64

static mhe_status request(void *data, int32_t what, const char *text, mhe_error *err) {
    mhe_live *l = data;
    mhe_status status = MHE_OK;
    (void)pthread_mutex_lock(&l->mutex);
    if (l->n_requests == MHI_LIVE_REQUESTS) {
        status = mhe_fail(err, MHE_RETRY, "too many requests at once");
    } else {
        mhi_live_request *r = &l->requests[l->n_requests++];
        r->what = what;
        (void)snprintf(r->text, sizeof r->text, "%s", text == NULL ? "" : text);
    }
    (void)pthread_mutex_unlock(&l->mutex);
    return status;
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
    l->n_recordings += status == MHE_OK;
    if (status != MHE_OK) {
        mhi_live_end_record(l, err.text);
        l->record_status = MHE_OK; /* told; a run that was not to be recorded goes on */
    }
}

/* ---- maximal voluntary contractions ---- */

static mhi_inlet *electrodes_of(mhe_live *l) {
    for (int32_t i = 0; i < l->feed.n_inlets; i++) {
        if (l->feed.inlets[i].is_raw && l->feed.inlets[i].channel >= 0) {
            return &l->feed.inlets[i];
        }
    }
    return NULL;
}

static void begin_mvc(mhe_live *l, const char *name) {
    mhi_inlet *in = electrodes_of(l);
    double before = 0;
    l->mvc_channel = -1;
    for (int32_t i = 0; in != NULL && i < l->run->emg.n_channels && i < MVC_MOST; i++) {
        if (strcmp(l->run->emg.channels[i].name, name) == 0 &&
            mhi_electrodes_peak(in->electrodes, i, 1, &before)) {
            l->mvc_channel = i;
            l->mvc_began = mhi_seconds();
        }
    }
}

/* All maxima found so far, as the config's section takes them. */
static void write_mvc(mhe_live *l) {
    mhi_text text = {0};
    char path[1100];
    mhi_text_add(&text,
                 "# Envelopes at maximal contraction, in the channels' units: write them into "
                 "emg.channels as mvc.\n");
    for (int32_t i = 0; i < l->run->emg.n_channels && i < MVC_MOST; i++) {
        if (l->mvc[i] > 0) {
            mhi_text_add(&text, "- {name: \"%s\", mvc: %.6g}\n", l->run->emg.channels[i].name,
                         l->mvc[i]);
        }
    }
    (void)snprintf(path, sizeof path, "%.1000s/mvc.yaml", l->folder);
    const int file = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
    const int whole =
        file >= 0 && !text.failed && write(file, text.data, text.length) == (ssize_t)text.length;
    if (file >= 0) {
        (void)close(file);
    }
    if (whole) {
        (void)snprintf(l->mvc_file, sizeof l->mvc_file, "%.500s", path);
    } else {
        char line[1200];
        (void)snprintf(line, sizeof line, "%s: cannot be written: %s", path, strerror(errno));
        l->host->log(l->host, MHE_LOG_ERROR, line);
    }
    mhi_text_free(&text);
}

static void end_mvc(mhe_live *l) {
    mhi_inlet *in = electrodes_of(l);
    double peak = 0;
    if (l->mvc_channel >= 0 && in != NULL &&
        mhi_electrodes_peak(in->electrodes, l->mvc_channel, 0, &peak) && peak > 0) {
        l->mvc[l->mvc_channel] = peak;
        write_mvc(l);
    }
    l->mvc_channel = -1;
}

void mhi_live_serve(mhe_live *l) {
    mhi_live_request all[MHI_LIVE_REQUESTS];
    (void)pthread_mutex_lock(&l->mutex);
    const int32_t n = l->n_requests;
    memcpy(all, l->requests, sizeof *all * (size_t)n);
    l->n_requests = 0;
    (void)pthread_mutex_unlock(&l->mutex);
    for (int32_t i = 0; i < n; i++) {
        switch (all[i].what) {
        case MHE_CONTROL_STOP:
            mhe_live_stop(l);
            break;
        case MHE_CONTROL_RECORD_START:
            begin_record(l);
            break;
        case MHE_CONTROL_RECORD_STOP:
            if (l->record != NULL) {
                mhi_live_end_record(l, NULL);
            }
            break;
        case MHE_CONTROL_MVC_START:
            begin_mvc(l, all[i].text);
            break;
        default:
            end_mvc(l);
            break;
        }
    }
    if (n > 0) {
        mhi_live_publish(l);
    }
}

/* ---- the state ---- */

static void add_names(cJSON *list, char **names) {
    for (int32_t i = 0; names != NULL && names[i] != NULL && cJSON_GetArraySize(list) < 100; i++) {
        cJSON_AddItemToArray(list, cJSON_CreateString(names[i]));
    }
}

static void add_streams(const mhe_live *l, cJSON *root) {
    cJSON *streams = cJSON_AddArrayToObject(root, "streams");
    cJSON *missing = cJSON_AddArrayToObject(root, "missing");
    cJSON *unused = cJSON_AddArrayToObject(root, "unused");
    for (int32_t i = 0; i < l->feed.n_inlets; i++) {
        const mhi_inlet *in = &l->feed.inlets[i];
        cJSON *s = cJSON_CreateObject();
        cJSON_AddItemToArray(streams, s);
        cJSON_AddStringToObject(s, "name", in->name);
        cJSON_AddNumberToObject(s, "rate", in->rate);
        cJSON_AddNumberToObject(s, "found", in->n_found);
        cJSON_AddNumberToObject(s, "of", in->n_labels);
        cJSON_AddNumberToObject(s, "samples", (double)in->n_samples);
        cJSON_AddNumberToObject(s, "gaps", (double)in->stamp.n_gaps);
        cJSON_AddNumberToObject(s, "clock_set", (double)in->stamp.n_jumps);
        cJSON_AddStringToObject(s, "state",
                                in->channel < 0 ? "not used"
                                : in->lost      ? "lost"
                                                : "running");
        add_names(missing, in->missing);
        add_names(unused, in->unused);
    }
}

static void add_electrodes(mhe_live *l, cJSON *root) {
    cJSON *list = cJSON_AddArrayToObject(root, "electrodes");
    mhi_inlet *in = electrodes_of(l);
    for (int32_t i = 0; in != NULL && i < l->run->emg.n_channels && i < MVC_MOST; i++) {
        cJSON *e = cJSON_CreateObject();
        cJSON_AddItemToArray(list, e);
        cJSON_AddStringToObject(e, "name", l->run->emg.channels[i].name);
        if (l->mvc[i] > 0) {
            cJSON_AddNumberToObject(e, "max", l->mvc[i]);
        }
    }
    double peak = 0;
    if (l->mvc_channel >= 0 && in != NULL &&
        mhi_electrodes_peak(in->electrodes, l->mvc_channel, 0, &peak)) {
        cJSON *m = cJSON_AddObjectToObject(root, "mvc");
        cJSON_AddStringToObject(m, "name", l->run->emg.channels[l->mvc_channel].name);
        cJSON_AddNumberToObject(m, "max", isfinite(peak) ? peak : 0);
        cJSON_AddNumberToObject(m, "seconds", mhi_seconds() - l->mvc_began);
    }
    if (l->mvc_file[0] != '\0') {
        cJSON_AddStringToObject(root, "mvc_file", l->mvc_file);
    }
}

void mhi_live_publish(mhe_live *l) {
    cJSON *root = cJSON_CreateObject();
    const double *g = l->model->gravity;
    cJSON_AddNumberToObject(root, "up", fabs(g[2]) > fabs(g[1]) ? 2 : 1);
    if (l->record != NULL) {
        cJSON_AddStringToObject(root, "recording", mhi_taping_path(l->record));
    }
    cJSON_AddNumberToObject(root, "frames", (double)l->feed.n_frames);
    cJSON_AddNumberToObject(root, "estimates", (double)l->feed.n_estimates);
    add_streams(l, root);
    add_electrodes(l, root);
    char *text = cJSON_PrintUnformatted(root);
    const size_t n = text == NULL ? 0 : strlen(text);
    (void)pthread_mutex_lock(&l->mutex);
    if (n > 0 && n < sizeof l->state) { /* else the last one stays */
        memcpy(l->state, text, n + 1);
        l->state_length = (int32_t)n;
    }
    (void)pthread_mutex_unlock(&l->mutex);
    cJSON_free(text);
    cJSON_Delete(root);
}

static void add_sinks(mhe_live *l, cJSON *root) {
    static const char *const names[4] = {"p50_ms", "p95_ms", "p99_ms", "max_ms"};
    cJSON *list = cJSON_AddArrayToObject(root, "sinks");
    const char *id = NULL;
    int64_t taken = 0, lost = 0;
    double latency[4];
    for (int32_t i = 0; mhi_outlets_report(l->outlets, i, &id, &taken, &lost, latency); i++) {
        cJSON *s = cJSON_CreateObject();
        cJSON_AddItemToArray(list, s);
        cJSON_AddStringToObject(s, "plugin", id);
        cJSON_AddNumberToObject(s, "taken", (double)taken);
        cJSON_AddNumberToObject(s, "lost", (double)lost);
        cJSON *stats = cJSON_AddObjectToObject(s, "latency");
        for (int32_t k = 0; k < 4; k++) {
            if (isfinite(latency[k])) {
                cJSON_AddNumberToObject(stats, names[k], 1e3 * latency[k]);
            }
        }
    }
}

mhe_status mhe_live_summary(mhe_live *l, char **json, mhe_error *err) {
    static const char *const outcomes[] = {"converged", "iteration_limit", "deadline", "predicted",
                                           "begun_again"};
    if (l == NULL || json == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "a summary needs a live run and a place");
    }
    cJSON *root = cJSON_CreateObject();
    cJSON_AddNumberToObject(root, "frames", (double)l->feed.n_frames);
    cJSON_AddNumberToObject(root, "estimates", (double)l->feed.n_estimates);
    cJSON_AddNumberToObject(root, "out_of_order", (double)l->feed.n_out_of_order);
    cJSON *by = cJSON_AddObjectToObject(root, "by_status");
    for (int32_t i = 0; i < 5; i++) {
        cJSON_AddNumberToObject(by, outcomes[i], (double)l->feed.n_by_status[i]);
    }
    mhe_channel_counts counts = {.size = sizeof counts};
    const int32_t emg = mhe_estimator_find_channel(l->estimator, "emg");
    if (emg >= 0 && mhe_estimator_counts(l->estimator, emg, &counts) == MHE_OK) {
        cJSON *c = cJSON_AddObjectToObject(root, "emg");
        cJSON_AddNumberToObject(c, "nodes", (double)counts.n_nodes);
        cJSON_AddNumberToObject(c, "nodes_without", (double)counts.n_empty);
        cJSON_AddNumberToObject(c, "late_nodes", (double)counts.n_late_nodes);
        cJSON_AddNumberToObject(c, "dropped", (double)counts.n_dropped);
    }
    add_streams(l, root);
    add_sinks(l, root);
    *json = cJSON_Print(root);
    cJSON_Delete(root);
    return *json == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}
