/* SPDX-License-Identifier: Apache-2.0 */
/* source_lsl.c: samples of the streams as they come, and their senders' clocks. */
#include "source_lsl.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define QUIET 1.0       /* s without a sample of a regular stream: told as lost */
#define CLOCK_EVERY 2.0 /* s between two looks at a sender's clock */
#define CLOCK_FIRST 2.0 /* s that the first look may take */
#define LOOK_EVERY 0.1  /* s between two looks at a search */
#define WAIT 0.0005     /* s between two looks where nothing is there */
#define CLOSE 0.00004   /* s between two while a frame is due */
#define DUE 0.0015      /* s before and after its time in which it is due */
#define MOST_PULLS 64   /* of one stream in a row */

double lsl_now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void lsl_source_destroy(void *self) {
    lsl_source *source = self;
    for (int32_t i = 0; i < source->n_streams; i++) {
        lsl_end_search(source, &source->streams[i]);
        lsl_disconnect(source, &source->streams[i]);
    }
    free(source->streams);
    free(source);
}

static mhe_status lsl_source_create(const mhe_host *host, const void *config, void **self,
                                    mhe_error *err) {
    const struct lsl_config *c = config;
    const mhe_text_list *const lists[] = {&c->markers, &c->emg, &c->angles};
    static const int32_t kinds[] = {MHE_STREAM_MARKERS, MHE_STREAM_EMG, MHE_STREAM_ANGLES};
    const int32_t n = c->markers.n + c->emg.n + c->angles.n;
    if (n == 0) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "no stream is asked for: give markers, emg or angles, as in markers: "
                        "[type='MoCap']");
    }
    lsl_source *source = calloc(1, sizeof *source);
    lsl_stream *streams = calloc((size_t)n, sizeof *streams);
    if (source == NULL || streams == NULL) {
        free(source);
        free(streams);
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    source->host = host;
    source->config = *c;
    source->streams = streams;
    for (size_t k = 0; k < 3; k++) {
        for (int32_t i = 0; i < lists[k]->n; i++) {
            streams[source->n_streams++] =
                (lsl_stream){.predicate = lists[k]->values[i], .kind = kinds[k]};
        }
    }
    const mhe_status status = lsl_load(c->library, &source->lsl, err);
    if (status != MHE_OK) {
        free(streams);
        free(source);
        return status;
    }
    source->clock = lsl_now() - source->lsl.local_clock();
    *self = source;
    return MHE_OK;
}

static void rest(double seconds) {
    const struct timespec t = {0, (long)(1e9 * seconds)};
    (void)nanosleep(&t, NULL);
}

/* Looks for all streams at once; the first that is still missing is told. */
static mhe_status open_missing(lsl_source *source, mhe_error *err) {
    mhe_status first = MHE_OK;
    for (int32_t i = 0; i < source->n_streams; i++) {
        mhe_error why = {0};
        lsl_stream *s = &source->streams[i];
        lsl_streaminfo info = NULL;
        mhe_status status = s->inlet != NULL ? MHE_OK : lsl_look(source, s, &info, &why);
        if (info != NULL) {
            status = lsl_connect(source, s, info, CLOCK_FIRST, &why);
            source->lsl.destroy_streaminfo(info);
        }
        if (status == MHE_OK) {
            lsl_end_search(source, s);
        } else if (first == MHE_OK || status < first) {
            first = mhe_fail(err, status, "%s", why.text);
        }
    }
    return first;
}

/* What came while the others were connected belongs to no run. */
static mhe_status drop_backlog(lsl_source *source) {
    for (int32_t i = 0; i < source->n_streams; i++) {
        lsl_stream *s = &source->streams[i];
        const unsigned long most = s->room * (unsigned long)s->n_channels;
        int32_t code = 0;
        for (int32_t k = 0; k < s->n_lines; k++) {
            while (source->lsl.pull_chunk_d(s->lines[k].inlet, s->values, s->stamps, most, s->room,
                                            0, &code) > 0) {
            }
        }
    }
    return MHE_OK;
}

static mhe_status lsl_source_open(void *self, double deadline, mhe_error *err) {
    mhe_status status = open_missing(self, err);
    while (status == MHE_RETRY && lsl_now() < deadline) {
        rest(LOOK_EVERY / 2);
        status = open_missing(self, err);
    }
    return status == MHE_OK ? drop_backlog(self) : status;
}

static int32_t lsl_source_count(const void *self) {
    return ((const lsl_source *)self)->n_streams;
}

static mhe_status lsl_source_stream(const void *self, int32_t i, mhe_stream_info *out,
                                    mhe_error *err) {
    const lsl_source *source = self;
    if (i < 0 || i >= source->n_streams || source->streams[i].inlet == NULL) {
        return mhe_fail(err, MHE_E_ARGUMENT, "stream %d is not there", (int)i);
    }
    const lsl_stream *s = &source->streams[i];
    *out = (mhe_stream_info){.size = out->size,
                             .kind = s->kind,
                             .name = s->name,
                             .n_channels = s->n_channels,
                             .labels = (const char *const *)s->labels,
                             .units = (const char *const *)s->units,
                             .rate = s->rate,
                             .up = -1};
    return MHE_OK;
}

static void tell(const mhe_source_taker *taker, int32_t event, int32_t i, const lsl_stream *s,
                 const char *what) {
    char text[256];
    (void)snprintf(text, sizeof text, "stream '%.120s' %s", s->name, what);
    taker->event(taker->data, event, i, text);
}

static void give(lsl_source *source, int32_t i, int32_t n, const mhe_source_taker *taker) {
    lsl_stream *s = &source->streams[i];
    if (n > 0) {
        const mhe_chunk chunk = {.size = sizeof chunk,
                                 .stream = i,
                                 .n = n,
                                 .received = lsl_now(),
                                 .stamp = s->stamps,
                                 .values = s->values};
        s->newest = chunk.received;
        if (s->lost) {
            s->lost = 0;
            lsl_end_search(source, s);
            tell(taker, MHE_SOURCE_BACK, i, s, "is back");
        }
        taker->chunk(taker->data, &chunk);
    }
}

/* Samples that are there, at most one pull of each connection; returns the most that one had. */
static int32_t pull(lsl_source *source, int32_t i, const mhe_source_taker *taker) {
    lsl_stream *s = &source->streams[i];
    const unsigned long most = s->room * (unsigned long)s->n_channels;
    int32_t longest = 0;
    for (int32_t k = 0; k < s->n_lines; k++) {
        int32_t code = 0;
        lsl_inlet inlet = s->lines[k].inlet;
        const unsigned long elements =
            inlet == NULL
                ? 0
                : source->lsl.pull_chunk_d(inlet, s->values, s->stamps, most, s->room, 0, &code);
        const int32_t n = (int32_t)(elements / (unsigned long)s->n_channels);
        give(source, i, lsl_take_new(s, k, n), taker);
        longest = n > longest ? n : longest;
        if (n == 0 && code == lsl_lost_error && k == 0) {
            lsl_close_lines(source, s); /* ends the loop */
            source->lsl.destroy_inlet(s->inlet);
            s->inlet = NULL;
        } else if (n == 0 && code == lsl_lost_error) {
            source->lsl.destroy_inlet(inlet);
            s->lines[k].inlet = NULL;
        }
    }
    return longest;
}

static int same_texts(char **a, char **b, int32_t n) {
    for (int32_t k = 0; k < n; k++) {
        if (strcmp(a[k], b[k]) != 0) {
            return 0;
        }
    }
    return 1;
}

static int is_same(const lsl_stream *a, const lsl_stream *b) {
    return a->n_channels == b->n_channels && a->rate == b->rate &&
           same_texts(a->labels, b->labels, a->n_channels) &&
           same_texts(a->units, b->units, a->n_channels);
}

/* A sender that is of no use is told once. */
static void refuse(lsl_source *source, int32_t i, lsl_streaminfo info, const char *why,
                   const mhe_source_taker *taker) {
    lsl_stream *s = &source->streams[i];
    const char *uid = source->lsl.get_uid(info);
    if (strncmp(s->refused, uid, sizeof s->refused - 1) != 0) {
        (void)snprintf(s->refused, sizeof s->refused, "%s", uid);
        taker->event(taker->data, MHE_SOURCE_WARNING, i, why);
    }
}

/* The stream is there again: as it was, or another under its name. */
static void replace(lsl_source *source, int32_t i, lsl_streaminfo info,
                    const mhe_source_taker *taker) {
    lsl_stream *s = &source->streams[i];
    lsl_stream fresh = {.predicate = s->predicate, .kind = s->kind};
    mhe_error why = {0};
    if (lsl_connect(source, &fresh, info, 0, &why) != MHE_OK) {
        refuse(source, i, info, why.text, taker);
        return;
    }
    const int same = is_same(s, &fresh);
    lsl_end_search(source, s);
    lsl_disconnect(source, s);
    *s = fresh;
    tell(taker, same ? MHE_SOURCE_BACK : MHE_SOURCE_CHANGED, i, s,
         same ? "is back" : "is back with other channels, units or another rate");
}

/* What sends nothing any more is told, and looked for. */
static void watch(lsl_source *source, int32_t i, const mhe_source_taker *taker) {
    lsl_stream *s = &source->streams[i];
    const double now = lsl_now();
    const int quiet = s->rate > 0 && now - s->newest > QUIET;
    if (!s->lost && (quiet || s->inlet == NULL)) {
        s->lost = 1;
        s->looked = 0;
        tell(taker, MHE_SOURCE_LOST, i, s, "sends nothing any more");
    }
    if (s->lost && now - s->looked > LOOK_EVERY) {
        lsl_streaminfo info = NULL;
        mhe_error why = {0};
        s->looked = now;
        (void)lsl_look(source, s, &info, &why);
        if (info != NULL && (s->inlet == NULL || strcmp(source->lsl.get_uid(info), s->uid) != 0)) {
            replace(source, i, info, taker);
        }
        if (info != NULL) {
            source->lsl.destroy_streaminfo(info);
        }
    }
}

/* All that is there of the streams that make frames, or of all others. */
static int32_t drain(lsl_source *source, int markers, const mhe_source_taker *taker) {
    int32_t total = 0;
    for (int32_t i = 0; i < source->n_streams; i++) {
        int32_t n = 0;
        for (int k = 0;
             k < MOST_PULLS && markers == (source->streams[i].kind == MHE_STREAM_MARKERS); k++) {
            n = pull(source, i, taker);
            total += n;
            if ((unsigned long)n < source->streams[i].room) {
                break;
            }
        }
    }
    return total;
}

/* How long to rest where nothing is there: liblsl tells nobody that something has come, and its own
 * waiting is a look each millisecond. Frames come by their rate, so the next one is looked for
 * closely when it is due, and a sleep before that ends in time. */
static double pause_of(const lsl_source *source) {
    const double now = lsl_now();
    double pause = WAIT;
    for (int32_t i = 0; i < source->n_streams; i++) {
        const lsl_stream *s = &source->streams[i];
        if (s->kind == MHE_STREAM_EMG || s->rate <= 0 || s->rate > 0.25 / DUE) {
            continue; /* waits for frames, or is never far from its next sample */
        }
        const double left = s->newest + 1 / s->rate - now;
        pause = fmin(pause, left > DUE ? fmax(left - DUE, CLOSE) : left > -DUE ? CLOSE : WAIT);
    }
    return pause;
}

/* Frames come last: what was measured by then is there already. */
static mhe_status lsl_source_read(void *self, double deadline, const mhe_source_taker *taker,
                                  mhe_error *err) {
    (void)err;
    lsl_source *source = self;
    int32_t n = 0;
    do {
        n = drain(source, 0, taker);
        n += drain(source, 1, taker);
        for (int32_t i = 0; i < source->n_streams; i++) {
            watch(source, i, taker);
        }
        if (n == 0) {
            rest(pause_of(source));
        }
    } while (n == 0 && lsl_now() < deadline);
    return MHE_OK;
}

static mhe_status lsl_source_clock_offset(void *self, int32_t i, double *offset, mhe_error *err) {
    lsl_source *source = self;
    lsl_stream *s = &source->streams[i];
    const double now = lsl_now();
    int32_t code = 0;
    if (s->inlet != NULL && now - s->asked > (s->has_offset ? CLOCK_EVERY : LOOK_EVERY)) {
        const double measured = source->lsl.time_correction(s->inlet, 0.0, &code);
        s->asked = now;
        if (code == lsl_no_error && isfinite(measured)) {
            s->offset = measured;
            s->has_offset = 1;
        }
    }
    *offset = s->offset + source->clock;
    return s->has_offset ? MHE_OK : mhe_fail(err, MHE_RETRY, "the sender's clock is not known yet");
}

static const mhe_source_ops lsl_ops = {.size = sizeof lsl_ops,
                                       .create = lsl_source_create,
                                       .destroy = lsl_source_destroy,
                                       .open = lsl_source_open,
                                       .count = lsl_source_count,
                                       .stream = lsl_source_stream,
                                       .read = lsl_source_read,
                                       .clock_offset = lsl_source_clock_offset};

static const mhe_option lsl_options[] = {
    MHE_OPT_TEXTS(struct lsl_config, markers, 0,
                  "Streams of markers, each by what its description must fulfil (XPath), as "
                  "type='MoCap' or name='QTM'."),
    MHE_OPT_TEXTS(struct lsl_config, emg, 0, "Streams of EMG, as type='EMG'."),
    MHE_OPT_TEXTS(struct lsl_config, angles, 0, "Streams of joint angles, rad."),
    MHE_OPT_PATH(struct lsl_config, library, MHE_OPT_ADVANCED,
                 "The library's file; without: the system's, else the one beside the plugin."),
    MHE_OPT_REAL(struct lsl_config, buffer, 10, 1, 3600, "s",
                 "What the library keeps while nobody reads."),
    MHE_OPT_INT(struct lsl_config, connections, 4, 1, LSL_MOST_LINES, "1",
                "Connections to each stream of frames; the first that has a sample gives it, since "
                "senders with liblsl before 1.14 look once a millisecond for each of them."),
};

static const mhe_plugin lsl_plugin = {.size = sizeof lsl_plugin,
                                      .id = "mhe.source.lsl",
                                      .version = "0.2.0",
                                      .summary = "Streams of the Lab Streaming Layer.",
                                      .reference =
                                          "Kothe et al. 2024, doi:10.1101/2024.02.13.580071",
                                      .iface = MHE_SOURCE_IFACE,
                                      .ops = &lsl_ops,
                                      MHE_PLUGIN_OPTIONS(struct lsl_config, lsl_options)};

MHE_PLUGIN_LIBRARY(&lsl_plugin)
