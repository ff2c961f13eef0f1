/* SPDX-License-Identifier: Apache-2.0 */
/* source_rough.c: recorded markers and EMG as a bad network brings them: late by chance, in another
 * order, not at all, with stamps that shake; in the middle the EMG is described anew, its channels
 * in another order. With a `fault` the network is a good one, and that happens in the middle. The
 * same seed gives the same packets; when they come is the clock's. */
#include <math.h>
#include <mhe/source.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define PACKET 5    /* samples of EMG */
#define LATE 0.04   /* s at most */
#define LOST 0.05   /* of all packets */
#define SHAKE 0.002 /* s, of stamps */

struct rough_config {
    const char *markers, *emg, *fault;
    int32_t seed;
    double speed;
};

typedef struct packet {
    double due; /* s of the recording */
    int32_t stream, n;
    int64_t first;
} packet;

#define EXTRA 200 /* channels of "more" */

typedef struct rough {
    struct rough_config config;
    int32_t is_over;     /* the middle */
    const char **labels; /* "more": those of the markers and EXTRA others */
    const mhe_recorded_service *service;
    const mhe_recorded *files[2];
    const char **turned; /* labels of the EMG from the middle on */
    int32_t is_turned;
    double begun;
    int64_t n, next;
    packet *packets;
    uint64_t random;
} rough;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* 0 .. 1: Steele, Lea, Flood 2014, doi:10.1145/2714064.2660195 (splitmix64). */
static double chance(rough *s) {
    uint64_t z = s->random += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (double)((z ^ z >> 31) >> 11) / 9007199254740992.0;
}

static int by_due(const void *a, const void *b) {
    const double x = ((const packet *)a)->due, y = ((const packet *)b)->due;
    return (x > y) - (x < y);
}

static void rough_destroy(void *self) {
    rough *s = self;
    s->service->free(s->files[0]);
    s->service->free(s->files[1]);
    free(s->turned);
    free(s->labels);
    free(s->packets);
    free(s);
}

static int has_fault(const rough *s, const char *fault) {
    return strcmp(s->config.fault, fault) == 0;
}

static int is_rough(const rough *s) {
    return has_fault(s, "");
}

static void lay(rough *s, int32_t stream, int32_t size) {
    const mhe_recorded_stream *of = s->files[stream]->streams;
    for (int64_t k = 0; k < of->n; k += size) {
        const int32_t n = k + size <= of->n ? size : (int32_t)(of->n - k);
        const double late = LATE * chance(s) * chance(s), lost = chance(s);
        if (lost >= LOST || !is_rough(s)) {
            s->packets[s->n++] =
                (packet){of->stamp[k + n - 1] + (is_rough(s) ? late : 0), stream, n, k};
        }
    }
}

static mhe_status rough_create(const mhe_host *host, const void *config, void **self,
                               mhe_error *err) {
    rough *s = calloc(1, sizeof *s);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->config = *(const struct rough_config *)config;
    s->random = (uint64_t)s->config.seed;
    s->service = host->service(host, MHE_RECORDED_SERVICE);
    mhe_status status = s->service->read(s->config.markers, MHE_STREAM_MARKERS, &s->files[0], err);
    if (status == MHE_OK) {
        status = s->service->read(s->config.emg, MHE_STREAM_EMG, &s->files[1], err);
    }
    if (status == MHE_OK) {
        const mhe_stream_info *emg = &s->files[1]->streams->about;
        s->turned = calloc((size_t)emg->n_channels, sizeof *s->turned);
        s->packets =
            calloc((size_t)(s->files[0]->streams->n + s->files[1]->streams->n), sizeof *s->packets);
        for (int32_t i = 0; i < emg->n_channels; i++) {
            s->turned[i] = emg->labels[(i + 1) % emg->n_channels];
        }
        const mhe_stream_info *markers = &s->files[0]->streams->about;
        s->labels = calloc((size_t)markers->n_channels + EXTRA, sizeof *s->labels);
        for (int32_t i = 0; i < markers->n_channels + EXTRA; i++) {
            s->labels[i] = i < markers->n_channels
                               ? markers->labels[i]
                               : (const char *const[]){"Tool.x", "Tool.y", "Tool.z"}[i % 3];
        }
        lay(s, 0, 1);
        lay(s, 1, PACKET);
        qsort(s->packets, (size_t)s->n, sizeof *s->packets, by_due);
        *self = s;
    } else {
        rough_destroy(s);
    }
    return status;
}

static mhe_status rough_open(void *self, double deadline, mhe_error *err) {
    (void)deadline, (void)err;
    ((rough *)self)->begun = now();
    return MHE_OK;
}

static int32_t rough_count(const void *self) {
    return has_fault(self, "twice") ? 4 : 2;
}

static mhe_status rough_stream(const void *self, int32_t i, mhe_stream_info *out, mhe_error *err) {
    const rough *s = self;
    (void)err;
    *out = s->files[i % 2]->streams->about;
    if (i == 1 && s->is_turned) {
        out->labels = s->turned;
    }
    if (i == 0 && s->is_over && has_fault(s, "more")) {
        out->n_channels += EXTRA - EXTRA % 3;
        out->labels = s->labels;
        out->units = NULL;
    }
    if (i == 0 && s->is_over && has_fault(s, "fewer")) {
        out->n_channels = 9;
    }
    if (i == 1 && s->is_over && has_fault(s, "fewer")) {
        out->n_channels = 2;
    }
    if (i == 1 && s->is_over && has_fault(s, "rate")) {
        out->rate /= PACKET;
    }
    return MHE_OK;
}

/* What the channel i of n_channels of the sample k says. */
static double value_of(const rough *s, const packet *p, int32_t k, int32_t i) {
    const mhe_recorded_stream *of = s->files[p->stream]->streams;
    const int32_t n = of->about.n_channels, shift = p->stream == 1 && s->is_turned;
    const double *from = of->values + (p->first + k) * n;
    if (s->is_over && has_fault(s, "nan") && p->first + k < 2 * of->n / 3) {
        return NAN;
    }
    return i < n ? from[(i + shift) % n] : 0.1;
}

static void send_packet(rough *s, const packet *p, int32_t stream, const mhe_source_taker *taker) {
    const mhe_recorded_stream *of = s->files[p->stream]->streams;
    mhe_stream_info about;
    (void)rough_stream(s, p->stream, &about, NULL);
    const int32_t n_channels = about.n_channels;
    const int32_t n = s->is_over && has_fault(s, "rate") && p->stream == 1 ? 1 : p->n;
    const double jump = !s->is_over                  ? 0
                        : has_fault(s, "jump-ahead") ? 100
                        : has_fault(s, "jump-back")  ? -3
                                                     : 0;
    double *values = malloc(sizeof *values * (size_t)n * (size_t)n_channels), stamp[PACKET];
    for (int32_t k = 0; k < n && values != NULL; k++) {
        stamp[k] = of->stamp[p->first + k] + jump;
        stamp[k] += is_rough(s) ? SHAKE * (chance(s) - 0.5) : 0;
        for (int32_t i = 0; i < n_channels; i++) {
            values[k * n_channels + i] = value_of(s, p, k, i);
        }
    }
    const mhe_chunk chunk = {.size = sizeof chunk,
                             .stream = stream,
                             .n = n,
                             .received = s->begun + p->due, /* on the recording's time */
                             .stamp = stamp,
                             .values = values};
    if (values != NULL) {
        taker->chunk(taker->data, &chunk);
    }
    free(values);
}

/* What happens in the middle; streams that are others from there on are described anew. */
static void turn_over(rough *s, const mhe_source_taker *taker) {
    s->is_over = 1;
    if (is_rough(s)) {
        s->is_turned = 1;
        taker->event(taker->data, MHE_SOURCE_CHANGED, 1, "the EMG has its channels turned");
    }
    if (has_fault(s, "more") || has_fault(s, "fewer")) {
        taker->event(taker->data, MHE_SOURCE_CHANGED, 0, "the markers are others");
    }
    if (has_fault(s, "rate") || has_fault(s, "fewer")) {
        taker->event(taker->data, MHE_SOURCE_CHANGED, 1, "the EMG is another");
    }
}

static mhe_status rough_read(void *self, double deadline, const mhe_source_taker *taker,
                             mhe_error *err) {
    rough *s = self;
    (void)err;
    while (now() < deadline) {
        if (s->next == s->n) {
            taker->event(taker->data, MHE_SOURCE_ENDED, -1, "that was all");
            return MHE_OK;
        }
        const packet *p = &s->packets[s->next];
        const double due = s->begun + p->due / s->config.speed;
        if (now() < due) {
            const struct timespec pause = {0, 200000};
            (void)nanosleep(&pause, NULL);
            continue;
        }
        if (!s->is_over && s->next >= s->n / 2) {
            turn_over(s, taker);
        }
        s->next++;
        send_packet(s, p, p->stream, taker);
        if (has_fault(s, "twice")) {
            send_packet(s, p, p->stream + 2, taker);
        }
    }
    return MHE_OK;
}

static mhe_status rough_offset(void *self, int32_t i, double *offset, mhe_error *err) {
    const rough *s = self;
    (void)i, (void)err;
    *offset = s->begun;
    return MHE_OK;
}

static const mhe_source_ops rough_ops = {.size = sizeof rough_ops,
                                         .create = rough_create,
                                         .destroy = rough_destroy,
                                         .open = rough_open,
                                         .count = rough_count,
                                         .stream = rough_stream,
                                         .read = rough_read,
                                         .clock_offset = rough_offset};

static const mhe_option rough_options[] = {
    MHE_OPT_PATH(struct rough_config, markers, 0, "Markers."),
    MHE_OPT_PATH(struct rough_config, emg, 0, "EMG."),
    MHE_OPT_TEXT(struct rough_config, fault, 0, "", "What happens in the middle."),
    MHE_OPT_INT(struct rough_config, seed, 1, 0, 1000000, "1", "Of what goes wrong."),
    MHE_OPT_REAL(struct rough_config, speed, 1, 0.01, 1000, "1", "Times as fast."),
};

static const mhe_plugin rough_plugin = {.size = sizeof rough_plugin,
                                        .id = "test.source.rough",
                                        .version = "1",
                                        .summary = "A bad network.",
                                        .iface = MHE_SOURCE_IFACE,
                                        .ops = &rough_ops,
                                        MHE_PLUGIN_OPTIONS(struct rough_config, rough_options)};

MHE_PLUGIN_LIBRARY(&rough_plugin)
