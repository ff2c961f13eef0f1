/* SPDX-License-Identifier: Apache-2.0 */
#include "lsl_pace.h"

#include "lsl_rig.h"

#include <fcntl.h>
#include <mhe/library.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#define LOOK 0.0005 /* s between two looks */

lsl_pace *lsl_pace_map(const char *folder, const char *name, int create) {
    char path[512];
    (void)snprintf(path, sizeof path, "%s/%s.pace", folder, name);
    const int file = open(path, O_RDWR | O_CLOEXEC | (create ? O_CREAT : 0), 0600);
    if (file < 0) {
        return NULL;
    }
    void *page = ftruncate(file, sizeof(lsl_pace)) != 0
                     ? MAP_FAILED
                     : mmap(NULL, sizeof(lsl_pace), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    (void)close(file);
    return page == MAP_FAILED ? NULL : page;
}

void lsl_pace_unmap(lsl_pace *pace) {
    if (pace != NULL) {
        (void)munmap(pace, sizeof *pace);
    }
}

void lsl_pace_wait(lsl_pace *pace) {
    while (pace != NULL && !atomic_load(&pace->go)) {
        lsl_rig_rest(LOOK);
    }
}

void lsl_pace_sent(lsl_pace *pace, int stream, int n) {
    if (pace != NULL) {
        atomic_fetch_add(&pace->sent[stream], n);
    }
}

void lsl_pace_before_frame(lsl_pace *pace, long long frame) {
    for (int i = 0; pace != NULL && i < LSL_PACE_STREAMS; i++) {
        long long *before = &pace->before[frame % LSL_PACE_AHEAD][i];
        while (frame >= LSL_PACE_AHEAD && atomic_load(&pace->taken[i]) < *before) {
            lsl_rig_rest(LOOK);
        }
        *before = atomic_load(&pace->sent[i]);
    }
}

/* What the run says of a stream, from its name on. NULL: nothing. */
static const char *find_stream(const lsl_pacer *p, const char *json, int stream) {
    char name[128];
    (void)snprintf(name, sizeof name, "\"name\":\"%s-%s\"", p->name,
                   stream == LSL_PACE_EMG ? "emg" : "markers");
    return strstr(json, name);
}

/* The newest state. Any request makes the run tell it anew; this one changes nothing. */
static void ask(lsl_pacer *p, char **json) {
    *json = NULL;
    (void)mhe_live_command(p->live, "mvc-stop", NULL);
    (void)mhe_live_state(p->live, json, NULL);
}

static void read_counts(lsl_pacer *p, long long counts[LSL_PACE_STREAMS]) {
    static const char key[] = "\"samples\":";
    char *json;
    ask(p, &json);
    for (int i = 0; i < LSL_PACE_STREAMS; i++) {
        const char *at = json == NULL ? NULL : find_stream(p, json, i);
        at = at == NULL ? NULL : strstr(at, key);
        counts[i] = at == NULL ? 0 : atoll(at + strlen(key));
    }
    mhe_free(json);
}

static void look(lsl_pacer *p) {
    long long counts[LSL_PACE_STREAMS];
    (void)pthread_mutex_lock(&p->mutex);
    read_counts(p, counts);
    for (int i = 0; i < LSL_PACE_STREAMS; i++) {
        /* a stream that is described anew is counted from nothing */
        p->before[i] = counts[i] < p->before[i] ? 0 : p->before[i];
        atomic_store(&p->pace->taken[i], counts[i] - p->before[i]);
    }
    (void)pthread_mutex_unlock(&p->mutex);
}

static void *work(void *data) {
    lsl_pacer *p = data;
    while (!atomic_load(&p->stop)) {
        int32_t waits = 0;
        for (int i = 0; i < LSL_PACE_STREAMS; i++) {
            waits |= atomic_load(&p->pace->taken[i]) < atomic_load(&p->pace->sent[i]);
        }
        if (waits) {
            look(p);
        }
        lsl_rig_rest(LOOK);
    }
    return NULL;
}

int lsl_pacer_start(lsl_pacer *p, const char *folder, const char *name, mhe_live *live) {
    *p = (lsl_pacer){.name = name, .live = live, .mutex = PTHREAD_MUTEX_INITIALIZER};
    p->pace = lsl_pace_map(folder, name, 0);
    return p->pace != NULL && pthread_create(&p->thread, NULL, work, p) == 0;
}

void lsl_pacer_stop(lsl_pacer *p) {
    atomic_store(&p->stop, 1);
    (void)pthread_join(p->thread, NULL);
    lsl_pace_unmap(p->pace);
}

void lsl_pacer_go(lsl_pacer *p) {
    (void)pthread_mutex_lock(&p->mutex);
    read_counts(p, p->before);
    for (int i = 0; i < LSL_PACE_STREAMS; i++) {
        atomic_store(&p->pace->taken[i], 0);
        atomic_store(&p->pace->sent[i], 0);
    }
    atomic_store(&p->pace->go, 1);
    (void)pthread_mutex_unlock(&p->mutex);
}

void lsl_pacer_hold(lsl_pacer *p) {
    atomic_store(&p->pace->go, 0);
    for (int i = 0; i < LSL_PACE_STREAMS; i++) {
        atomic_store(&p->pace->sent[i], 0);
    }
}

int lsl_pacer_lost(lsl_pacer *p) {
    int lost = 0;
    (void)pthread_mutex_lock(&p->mutex);
    char *json;
    ask(p, &json);
    for (int i = 0; i < LSL_PACE_STREAMS; i++) {
        const char *at = json == NULL ? NULL : find_stream(p, json, i);
        at = at == NULL ? NULL : strstr(at, "\"state\":");
        lost += at != NULL && strncmp(at, "\"state\":\"lost\"", 14) == 0;
    }
    (void)pthread_mutex_unlock(&p->mutex);
    mhe_free(json);
    return lost == LSL_PACE_STREAMS;
}
