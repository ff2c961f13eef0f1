/* SPDX-License-Identifier: Apache-2.0 */
/* state.c: what sinks are told of the run while it runs, and its summary. */
#include "base/clock.h"
#include "live/live_private.h"

#include <cJSON.h>
#include <math.h>
#include <string.h>

static void add_names(cJSON *list, char **names) {
    for (int32_t i = 0; names != NULL && names[i] != NULL && cJSON_GetArraySize(list) < 100; i++) {
        cJSON_AddItemToArray(list, cJSON_CreateString(names[i]));
    }
}

static void add_streams(const mhe_live *l, cJSON *root) {
    cJSON *streams = cJSON_AddArrayToObject(root, "streams");
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
        if (in->channel >= 0) {
            add_names(cJSON_AddArrayToObject(s, "missing"), in->missing);
            add_names(cJSON_AddArrayToObject(s, "unused"), in->unused);
        }
    }
}

static void add_electrodes(mhe_live *l, cJSON *root) {
    cJSON *list = cJSON_AddArrayToObject(root, "electrodes");
    mhi_inlet *in = mhi_live_electrodes(l);
    for (int32_t i = 0; in != NULL && i < l->run->emg.n_channels && i < MHI_FEED_MAXIMA; i++) {
        cJSON *e = cJSON_CreateObject();
        cJSON_AddItemToArray(list, e);
        cJSON_AddStringToObject(e, "name", l->run->emg.channels[i].name);
        if (l->feed.maxima[i] > 0) {
            cJSON_AddNumberToObject(e, "max", l->feed.maxima[i]);
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
    cJSON_AddNumberToObject(root, "passed_over", (double)l->feed.n_passed_over);
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
    cJSON_AddNumberToObject(root, "passed_over", (double)l->feed.n_passed_over);
    cJSON_AddNumberToObject(root, "clocks_set", (double)l->feed.n_clock_set);
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
    cJSON_AddNumberToObject(root, "priority", l->priority.raised);
    cJSON_AddBoolToObject(root, "memory_locked", l->priority.locked);
    add_streams(l, root);
    add_sinks(l, root);
    *json = cJSON_Print(root);
    cJSON_Delete(root);
    return *json == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
}
