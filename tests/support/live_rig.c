/* SPDX-License-Identifier: Apache-2.0 */
#include "live_rig.h"

#include <mhe/table.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#define PATIENCE 60.0 /* s until a test gives up; nothing is judged by its speed */

static char folder[256];

const char *live_rig_folder(void) {
    return folder[0] != '\0' || test_folder(folder, sizeof folder) != NULL ? folder : "";
}

static void keep(const mhe_host *host, int32_t level, const char *text) {
    (void)level;
    live_words *w = host->data;
    (void)pthread_mutex_lock(&w->mutex);
    const size_t n = strlen(text);
    if (w->n + n + 2 < sizeof w->text) {
        memcpy(w->text + w->n, text, n);
        memcpy(w->text + w->n + n, "\n", 2);
        w->n += n + 1;
    }
    (void)pthread_mutex_unlock(&w->mutex);
}

static const void *none(const mhe_host *host, const char *id) {
    (void)host, (void)id;
    return NULL;
}

int32_t live_words_count(live_words *w, const char *text) {
    int32_t n = 0;
    (void)pthread_mutex_lock(&w->mutex);
    for (const char *at = strstr(w->text, text); at != NULL; at = strstr(at + 1, text)) {
        n++;
    }
    (void)pthread_mutex_unlock(&w->mutex);
    return n;
}

int live_words_wait(live_words *w, const char *text, int32_t times) {
    const struct timespec pause = {0, 10000000};
    for (int32_t i = 0; i < (int32_t)(100 * PATIENCE); i++) {
        if (live_words_count(w, text) >= times) {
            return 1;
        }
        (void)nanosleep(&pause, NULL);
    }
    (void)printf("was not told: '%s'; but:\n%s", text, w->text);
    return 0;
}

mhe_status live_rig_run(live_rig *r) {
    char out[512];
    const mhe_host host = {.size = sizeof host, .data = &r->words, .log = keep, .service = none};
    mhe_config *config = NULL;
    pthread_t thread;
    r->words = (live_words){.mutex = PTHREAD_MUTEX_INITIALIZER};
    (void)snprintf(out, sizeof out, "%s/%s", live_rig_folder(), r->name);
    (void)mkdir(out, 0777);
    mhe_status status = mhe_config_parse("live.yaml", r->config, strlen(r->config), "/", NULL, 0,
                                         r->trust ? MHE_CONFIG_TRUST : 0, &host, &config, &r->err);
    const mhe_live_setup setup = {
        .size = sizeof setup, .folder = out, .record = r->record, .wait = PATIENCE};
    status = status == MHE_OK ? mhe_live_open(config, &setup, &r->live, &r->err) : status;
    int directed = 0;
    if (status == MHE_OK) {
        directed = r->director != NULL && pthread_create(&thread, NULL, r->director, r->data) == 0;
        status = mhe_live_run(r->live, r->seconds, &r->err);
    }
    atomic_store(&r->over, 1);
    if (directed) {
        (void)pthread_join(thread, NULL);
    }
    if (status == MHE_OK) {
        status = mhe_live_summary(r->live, &r->summary, &r->err);
    }
    mhe_live_close(r->live);
    r->live = NULL;
    mhe_config_close(config);
    return status;
}

void live_rig_must_run(live_rig *r) {
    if (live_rig_run(r) != MHE_OK) {
        fail_msg("%s\n%s", r->err.text, r->words.text);
    }
}

int live_rig_same(const char *a, const char *b, const char *file) {
    char command[1400];
    const char *in = live_rig_folder();
    (void)snprintf(command, sizeof command, "test -s %s/%s/%s && cmp %s/%s/%s %s/%s/%s", in, a,
                   file, in, a, file, in, b, file);
    return system(command) == 0;
}

double live_rig_number(const char *json, const char *key) {
    char quoted[64];
    (void)snprintf(quoted, sizeof quoted, "\"%s\":", key);
    const char *at = strstr(json, quoted);
    assert_non_null(at);
    return strtod(at + strlen(quoted), NULL);
}

double live_rig_state(live_rig *r, const char *key) {
    char *json = NULL, quoted[64];
    (void)snprintf(quoted, sizeof quoted, "\"%s\":", key);
    const int known =
        mhe_live_state(r->live, &json, NULL) == MHE_OK && strstr(json, quoted) != NULL;
    const double value = known ? live_rig_number(json, key) : 0;
    mhe_free(json);
    return value;
}

int live_rig_wait_frames(live_rig *r, int32_t more) {
    const struct timespec pause = {0, 10000000};
    double frames = live_rig_state(r, "frames");
    const double enough = frames + more;
    for (int32_t i = 0; frames < enough && i < (int32_t)(100 * PATIENCE); i++) {
        const double now = live_rig_state(r, "frames");
        i = now > frames ? 0 : i; /* however slowly: it goes on */
        frames = now;
        (void)nanosleep(&pause, NULL);
    }
    return frames >= enough;
}

double *live_rig_table(const char *name, const char *file, int32_t *n_rows, int32_t *n_columns) {
    char path[512];
    mhe_table *table = NULL;
    mhe_table_info info = {.size = sizeof info};
    mhe_error err = {0};
    (void)snprintf(path, sizeof path, "%s/%s/%s", live_rig_folder(), name, file);
    if (mhe_table_read_signals(path, &table, &err) != MHE_OK ||
        mhe_table_describe(table, &info, &err) != MHE_OK) {
        (void)printf("%s\n", err.text);
        mhe_table_close(table);
        return NULL;
    }
    const size_t n = (size_t)info.n_rows * (size_t)info.n_columns;
    double *values = malloc(sizeof *values * (n + 1));
    if (values != NULL) {
        memcpy(values, info.values, sizeof *values * n);
    }
    *n_rows = info.n_rows;
    *n_columns = info.n_columns;
    mhe_table_close(table);
    return values;
}
