/* SPDX-License-Identifier: Apache-2.0 */
#include "live/outlets.h"

#include "base/arena.h"
#include "base/clock.h"
#include "base/values.h"
#include "live/figure.h"
#include "live/ring.h"

#include <math.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define RING 1024  /* estimates; a power of two: ten seconds that a file may stall */
#define HEAD 6     /* numbers of a record before the values */
#define IDLE 0.001 /* s that a sink's own poll may take that cannot be woken */
#define LOOK 0.05  /* s that others wait for an estimate at once */
#define LATENCIES 4096

enum {
    Q,
    QDOT,
    ACTIVATION,
    EXCITATION,
    FORCE,
    MOMENT,
    RESIDUAL,
    MARKERS,
    EMG,
    MEASURED,
    N_ESTIMATED, /* up to here from the estimator; the rest is drawn on the sink's thread */
    SKELETON = N_ESTIMATED,
    PATHS,
    N_SIGNALS
};

typedef struct outlet {
    const struct mhi_outlets *all;
    const mhe_sink_ops *ops;
    const char *id;
    void *self;
    int opened;
    mhi_ring *ring;
    double *record;
    const double *values[N_SIGNALS];
    mhi_figure_view view;
    double *bones, *paths;
    sem_t filled; /* posted for every estimate, to a sink without a poll */
    pthread_t thread;
    int started;
    pthread_mutex_t mutex; /* of what follows */
    int64_t taken, lost;
    double latency[LATENCIES];
} outlet;

struct mhi_outlets {
    const mhe_host *host;
    mhi_arena arena;
    mhi_figure figure;
    mhe_sink_run run;
    mhe_sink_signal signals[N_SIGNALS];
    mhe_sink_control control;
    int32_t n, n_values;
    outlet *outlets;
    double *record; /* of the estimator's thread */
    int64_t number;
    int32_t markers_channel, emg_channel;
    atomic_int stop;
};

/* ---- the signals ---- */

static const char *const *axis_labels(mhi_outlets *o, const mhe_estimator_info *info) {
    const char **labels = MHI_TAKE(&o->arena, const char *, 3 * info->n_markers + 1);
    for (int32_t i = 0; i < 3 * info->n_markers && labels != NULL; i++) {
        labels[i] = mhi_arena_format(&o->arena, "%s.%c", info->marker_names[i / 3], "xyz"[i % 3]);
        labels = labels[i] == NULL ? NULL : labels;
    }
    return labels;
}

static int32_t find_channel(const mhe_estimator_info *info, const char *name) {
    for (int32_t i = 0; i < info->n_channels; i++) {
        if (strcmp(mhe_channel_at(info, i)->name, name) == 0) {
            return i;
        }
    }
    return -1;
}

static mhe_status name_signals(mhi_outlets *o, const mhi_outlets_setup *setup, mhe_error *err) {
    const mhe_estimator_info *info = setup->info;
    const char *const *axes = axis_labels(o, info);
    const char *const *q = info->coordinate_names, *const *m = info->muscle_names;
    if (axes == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const int driven = info->formulation == 0;
    const mhe_sink_signal signals[N_SIGNALS] = {
        [Q] = {"q", "rad (m)", info->n_q, q},
        [QDOT] = {"qdot", "rad/s (m/s)", info->n_q, q},
        [ACTIVATION] = {"activation", "1", info->n_muscles, m},
        [EXCITATION] = {"excitation", "1", driven ? info->n_muscles : 0, m},
        [FORCE] = {"force", "N", info->n_muscles, m},
        [MOMENT] = {"moment", "N m (N)", info->n_q, q},
        [RESIDUAL] = {"residual_torque", "N m (N)", info->n_residual_torques, q},
        [MARKERS] = {"markers", "m", 3 * info->n_markers, axes},
        [EMG] = {"emg", "1", info->n_muscles, m},
        [MEASURED] = {"markers_measured", "m", 3 * info->n_markers, axes},
        [SKELETON] = {"skeleton", "m", 6 * o->figure.n_bones, o->figure.bone_labels},
        [PATHS] = {"paths", "m", 3 * MHI_FIGURE_POINTS * o->figure.n_paths, o->figure.path_labels}};
    memcpy(o->signals, signals, sizeof signals);
    for (int32_t i = 0; i < N_ESTIMATED; i++) {
        o->n_values += signals[i].n;
    }
    o->markers_channel = find_channel(info, "markers");
    o->emg_channel = find_channel(info, "emg");
    o->run = (mhe_sink_run){.size = sizeof o->run,
                            .info = info,
                            .title = setup->run->name,
                            .folder = setup->folder,
                            .n_signals = N_SIGNALS,
                            .signal_size = sizeof *o->signals,
                            .signals = o->signals};
    return MHE_OK;
}

static double *put(double *at, const double *values, int32_t n) {
    for (int32_t i = 0; i < n; i++) {
        at[i] = values == NULL ? NAN : values[i];
    }
    return at + n;
}

static const double *measured(const mhe_estimate *e, int32_t channel) {
    for (int32_t i = 0; i < e->n_tracked; i++) {
        const mhe_tracked *t = mhe_tracked_at(e, i);
        if (t->channel == channel) {
            return t->measured;
        }
    }
    return NULL;
}

/* There is something in its ring, or it shall stop. Waits for nobody. */
static void wake(outlet *s) {
    if (s->ops->poll == NULL) {
        (void)sem_post(&s->filled);
    } else if (s->ops->wake != NULL) {
        s->ops->wake(s->self);
    }
}

void mhi_outlets_give(mhi_outlets *o, const mhe_estimate *e, double host_time) {
    if (o->n == 0) {
        return;
    }
    const double *const values[N_ESTIMATED] = {[Q] = e->q,
                                               [QDOT] = e->qdot,
                                               [ACTIVATION] = e->activation,
                                               [EXCITATION] = e->excitation,
                                               [FORCE] = e->force,
                                               [MOMENT] = e->moment,
                                               [RESIDUAL] = e->residual,
                                               [MARKERS] = e->markers,
                                               [EMG] = measured(e, o->emg_channel),
                                               [MEASURED] = measured(e, o->markers_channel)};
    const double head[HEAD] = {(double)o->number++, e->time,       host_time,
                               e->status,           e->iterations, e->solve_time};
    double *at = put(o->record, head, HEAD);
    for (int32_t i = 0; i < N_ESTIMATED; i++) {
        at = put(at, values[i], o->signals[i].n);
    }
    for (int32_t i = 0; i < o->n; i++) {
        mhi_ring_put(o->outlets[i].ring, o->record);
        wake(&o->outlets[i]);
    }
}

/* ---- a sink's thread ---- */

static void count(outlet *s, double stamp, int64_t lost) {
    (void)pthread_mutex_lock(&s->mutex);
    s->latency[s->taken % LATENCIES] = mhi_seconds() - stamp;
    s->taken++;
    s->lost = lost;
    (void)pthread_mutex_unlock(&s->mutex);
}

static void tell(const outlet *s, const char *text) {
    char line[MHE_ERROR_TEXT + 64];
    (void)snprintf(line, sizeof line, "%s: %s", s->id, text);
    s->all->host->log(s->all->host, MHE_LOG_WARNING, line);
}

static mhe_status take(outlet *s, int64_t lost, mhe_error *err) {
    const double *r = s->record;
    const mhe_sink_sample sample = {.size = sizeof sample,
                                    .number = (int64_t)r[0],
                                    .lost = lost,
                                    .time = r[1],
                                    .stamp = r[2],
                                    .status = (int32_t)r[3],
                                    .iterations = (int32_t)r[4],
                                    .solve_time = r[5],
                                    .values = s->values};
    mhi_figure_draw(&s->view, s->values[Q], s->bones, s->paths);
    count(s, r[2], lost);
    return s->ops->take(s->self, &sample, err);
}

/* Until there is something in the ring, or LOOK is over. */
static void wait_filled(outlet *s) {
    struct timespec until;
    (void)clock_gettime(CLOCK_REALTIME, &until); /* sem_timedwait knows no other */
    until.tv_nsec += (long)(1e9 * LOOK);
    until.tv_sec += until.tv_nsec / 1000000000;
    until.tv_nsec %= 1000000000;
    (void)sem_timedwait(&s->filled, &until);
}

static void *work(void *data) {
    outlet *s = data;
    int64_t lost = 0;
    int told = 0;
    mhe_status status = MHE_OK;
    for (;;) {
        mhe_error err = {0};
        const int stop = atomic_load(&s->all->stop); /* read before the ring: nothing comes after */
        if (mhi_ring_take(s->ring, s->record, &lost)) {
            status = status < 0 ? status : take(s, lost, &err);
        } else if (stop) {
            break;
        } else if (s->ops->poll != NULL && status >= 0) {
            status = s->ops->poll(s->self, s->ops->wake == NULL ? IDLE : LOOK, &err);
        } else {
            wait_filled(s);
        }
        if (status != MHE_OK && !told) { /* one that fails for good gets nothing any more */
            told = 1;
            tell(s, err.text);
        }
    }
    return NULL;
}

/* Not by its own thread: until that has ended, others may wake the sink. */
static void close_one(outlet *s) {
    mhe_error err = {0};
    if (s->ops->close(s->self, &err) != MHE_OK) {
        tell(s, err.text);
    }
}

/* ---- start and stop ---- */

static mhe_status start_one(mhi_outlets *o, outlet *s, const mhi_outlets_setup *setup,
                            const mhi_use *use, mhe_error *err) {
    mhe_error why = {0};
    s->all = o;
    s->ops = use->plugin->ops;
    s->id = use->plugin->id;
    (void)pthread_mutex_init(&s->mutex, NULL);
    (void)sem_init(&s->filled, 0, 0);
    s->ring = mhi_ring_create(RING, HEAD + o->n_values);
    s->record = MHI_TAKE(&o->arena, double, HEAD + o->n_values);
    if (s->ring == NULL || s->record == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const double *at = s->record + HEAD;
    for (int32_t i = 0; i < N_ESTIMATED; i++) {
        s->values[i] = at;
        at += o->signals[i].n;
    }
    s->bones = MHI_TAKE(&o->arena, double, o->signals[SKELETON].n + 1);
    s->paths = MHI_TAKE(&o->arena, double, o->signals[PATHS].n + 1);
    s->values[SKELETON] = s->bones;
    s->values[PATHS] = s->paths;
    if (s->bones == NULL || s->paths == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = mhi_figure_view_open(&o->figure, &o->arena, &s->view, &why);
    if (status == MHE_OK) {
        status = s->ops->create(setup->host, use->config, &s->self, &why);
    }
    if (status == MHE_OK) {
        status = s->ops->open(s->self, &o->run, &o->control, &why);
    }
    if (status != MHE_OK) {
        char text[MHE_ERROR_TEXT];
        (void)snprintf(text, sizeof text, "%s: %.600s", s->id, why.text);
        return mhi_fail_at(err, status, setup->run->tree, use->node, "%s", text);
    }
    s->opened = 1;
    s->started = pthread_create(&s->thread, NULL, work, s) == 0;
    return s->started ? MHE_OK : mhe_fail(err, MHE_E_MEMORY, "a thread cannot be started");
}

mhe_status mhi_outlets_start(const mhi_outlets_setup *setup, mhi_outlets **outlets,
                             mhe_error *err) {
    *outlets = NULL;
    mhi_outlets *o = calloc(1, sizeof *o);
    if (o == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    o->host = setup->host;
    o->control = *setup->control;
    mhe_status status =
        setup->run->sinks.n == 0
            ? MHE_OK
            : mhi_figure_open(setup->host, setup->run, setup->model, &o->arena, &o->figure, err);
    if (status == MHE_OK) {
        status = name_signals(o, setup, err);
    }
    o->outlets = calloc((size_t)setup->run->sinks.n + 1, sizeof *o->outlets);
    o->record = MHI_TAKE(&o->arena, double, HEAD + o->n_values);
    if (status == MHE_OK && (o->outlets == NULL || o->record == NULL)) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < setup->run->sinks.n && status == MHE_OK; i++) {
        o->n = i + 1;
        status = start_one(o, &o->outlets[i], setup, &setup->run->sinks.uses[i], err);
    }
    if (status != MHE_OK) {
        mhi_outlets_stop(o);
        return status;
    }
    *outlets = o;
    return MHE_OK;
}

void mhi_outlets_stop(mhi_outlets *o) {
    if (o == NULL) {
        return;
    }
    atomic_store(&o->stop, 1);
    for (int32_t i = 0; i < o->n; i++) {
        outlet *s = &o->outlets[i];
        if (s->started) {
            wake(s);
            (void)pthread_join(s->thread, NULL);
        }
        if (s->opened) {
            close_one(s);
        }
        if (s->self != NULL) {
            s->ops->destroy(s->self);
        }
        mhi_figure_view_close(&s->view);
        mhi_ring_free(s->ring);
        (void)pthread_mutex_destroy(&s->mutex);
        (void)sem_destroy(&s->filled);
    }
    free(o->outlets);
    mhi_figure_close(&o->figure);
    mhi_arena_free(&o->arena);
    free(o);
}

int32_t mhi_outlets_report(mhi_outlets *o, int32_t i, const char **id, int64_t *taken,
                           int64_t *lost, double latency[4]) {
    static const double fractions[4] = {0.5, 0.95, 0.99, 1};
    if (o == NULL || i < 0 || i >= o->n) {
        return 0;
    }
    outlet *s = &o->outlets[i];
    double *sorted = malloc(sizeof s->latency);
    (void)pthread_mutex_lock(&s->mutex);
    *id = s->id;
    *taken = s->taken;
    *lost = s->lost;
    const size_t n = (size_t)(s->taken < LATENCIES ? s->taken : LATENCIES);
    if (sorted != NULL) {
        memcpy(sorted, s->latency, sizeof *sorted * n);
    }
    (void)pthread_mutex_unlock(&s->mutex);
    if (sorted != NULL) {
        mhi_sort(sorted, (ptrdiff_t)n);
    }
    for (int32_t k = 0; k < 4; k++) {
        const size_t at = (size_t)(fractions[k] * (double)(n > 0 ? n - 1 : 0) + 0.5);
        latency[k] = sorted == NULL || n == 0 ? NAN : sorted[at];
    }
    free(sorted);
    return 1;
}
