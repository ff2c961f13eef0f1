/* SPDX-License-Identifier: Apache-2.0 */
/* source_recording.c: files as if they came from devices: by the clock, faster, or as fast as they
 * are taken.
 *
 * A recording that says how its samples came (ours) is repeated packet by packet, with the stamps,
 * arrival times and clock offsets that were then, whatever the clock says now. */
#include <mhe/source.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define MOST_FILES 3
#define PACKET 64 /* samples at most */

struct recording_config { /* filled by the core from the option table */
    const char *file, *markers, *emg, *angles;
    double speed;
    int32_t loop, granted;
};

/* A stream of one of the files. */
typedef struct track {
    const mhe_recorded_stream *stream;
    int64_t next;
    int32_t slot; /* stream as the core knows it */
} track;

typedef struct recording {
    struct recording_config config;
    const mhe_recorded_service *service;
    const mhe_recorded *files[MOST_FILES];
    int32_t n_files, n_tracks, n_slots;
    track *tracks;
    int32_t
        *of_slot; /* [n_slots] track that a stream is now: one that is described again is another */
    const mhe_recorded *arrivals; /* file whose packets are repeated; NULL: none */
    int64_t next_arrival, next_grant, next_maximum;
    double offset; /* of the packet in work: stamps + offset is CLOCK_MONOTONIC; NaN: not known */
    double first;  /* s, earliest stamp */
    double length; /* s, of all tracks with the period that a last sample stands for */
    double zero;   /* s of CLOCK_MONOTONIC at which the recording began first */
    double before; /* s of the recording that were played before it began again */
    double begun;  /* s of CLOCK_MONOTONIC at which `first` is due */
    int32_t started, ended, again;
} recording;

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static const mhe_recorded_stream *stream_at(const mhe_recorded *r, int32_t i) {
    return (const mhe_recorded_stream *)(const void *)((const char *)r->streams +
                                                       (size_t)i * r->stream_size);
}

static const mhe_arrival *arrival_at(const mhe_recorded *r, int64_t i) {
    return (const mhe_arrival *)(const void *)((const char *)r->arrivals +
                                               (size_t)i * r->arrival_size);
}

static void recording_destroy(void *self) {
    recording *s = self;
    for (int32_t i = 0; i < s->n_files; i++) {
        s->service->free(s->files[i]);
    }
    free(s->tracks);
    free(s->of_slot);
    free(s);
}

static mhe_status read_file(recording *s, const char *path, int32_t kind, mhe_error *err) {
    if (path == NULL) {
        return MHE_OK;
    }
    const mhe_status status = s->service->read(path, kind, &s->files[s->n_files], err);
    s->n_files += status == MHE_OK;
    return status;
}

/* From the earliest sample to where the next would be after the last: a recording that begins again
 * goes on there. */
static double length_of(const recording *s) {
    double length = 1e-3;
    for (int32_t i = 0; i < s->n_tracks; i++) {
        const mhe_recorded_stream *r = s->tracks[i].stream;
        if (r->n > 0) {
            const double all = r->stamp[r->n - 1] - r->stamp[0];
            const double period = r->about.rate > 0 ? 1 / r->about.rate
                                  : r->n > 1        ? all / (double)(r->n - 1)
                                                    : 0;
            length = fmax(length, r->stamp[r->n - 1] + period - s->first);
        }
    }
    return length;
}

static mhe_status lay_tracks(recording *s, mhe_error *err) {
    int32_t n = 0;
    for (int32_t i = 0; i < s->n_files; i++) {
        n += s->files[i]->n_streams;
    }
    s->tracks = calloc((size_t)n + 1, sizeof *s->tracks);
    s->of_slot = calloc((size_t)n + 1, sizeof *s->of_slot);
    if (s->tracks == NULL || s->of_slot == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->first = INFINITY;
    for (int32_t i = 0; i < s->n_files; i++) {
        for (int32_t k = 0; k < s->files[i]->n_streams; k++) {
            const mhe_recorded_stream *stream = stream_at(s->files[i], k);
            track *t = &s->tracks[s->n_tracks];
            t->stream = stream;
            if (s->n_files == 1 && stream->replaces >= 0 && stream->replaces < k) {
                t->slot = s->tracks[stream->replaces].slot;
            } else {
                t->slot = s->n_slots;
                s->of_slot[s->n_slots++] = s->n_tracks;
            }
            s->n_tracks++;
            s->first = stream->n > 0 ? fmin(s->first, stream->stamp[0]) : s->first;
        }
        if (s->n_files == 1 && s->files[i]->n_arrivals > 0) {
            s->arrivals = s->files[i];
        }
    }
    s->length = length_of(s);
    return MHE_OK;
}

static mhe_status recording_create(const mhe_host *host, const void *config, void **self,
                                   mhe_error *err) {
    const struct recording_config *c = config;
    recording *s = calloc(1, sizeof *s);
    if (s == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    s->config = *c;
    s->service = host->service(host, MHE_RECORDED_SERVICE);
    if (s->service == NULL) {
        free(s);
        return mhe_fail(err, MHE_E_UNSUPPORTED, "this program reads no recordings for sources");
    }
    mhe_status status = MHE_OK;
    if (c->file == NULL && c->markers == NULL && c->emg == NULL && c->angles == NULL) {
        status =
            mhe_fail(err, MHE_E_CONFIG, "no file: give `file` (.xdf), or markers, emg, angles");
    } else if (c->file != NULL && (c->markers != NULL || c->emg != NULL || c->angles != NULL)) {
        status = mhe_fail(err, MHE_E_CONFIG, "`file` holds all streams; take out the others");
    }
    status = status == MHE_OK ? read_file(s, c->file, MHE_STREAM_OTHER, err) : status;
    status = status == MHE_OK ? read_file(s, c->markers, MHE_STREAM_MARKERS, err) : status;
    status = status == MHE_OK ? read_file(s, c->emg, MHE_STREAM_EMG, err) : status;
    status = status == MHE_OK ? read_file(s, c->angles, MHE_STREAM_ANGLES, err) : status;
    status = status == MHE_OK ? lay_tracks(s, err) : status;
    if (status != MHE_OK) {
        recording_destroy(s);
        return status;
    }
    *self = s;
    return MHE_OK;
}

static mhe_status recording_open(void *self, double deadline, mhe_error *err) {
    (void)self, (void)deadline, (void)err;
    return MHE_OK;
}

static int32_t recording_count(const void *self) {
    return ((const recording *)self)->n_slots;
}

static mhe_status recording_stream(const void *self, int32_t i, mhe_stream_info *out,
                                   mhe_error *err) {
    const recording *s = self;
    if (i < 0 || i >= s->n_slots) {
        return mhe_fail(err, MHE_E_ARGUMENT, "stream %d is not there", (int)i);
    }
    const uint32_t size = out->size;
    *out = s->tracks[s->of_slot[i]].stream->about;
    out->size = size;
    return MHE_OK;
}

static void sleep_until(double seconds, double deadline) {
    const double until = fmin(seconds, deadline);
    const struct timespec t = {(time_t)until, (long)(1e9 * (until - floor(until)))};
    (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
}

static void end(recording *s, const mhe_source_taker *taker) {
    s->ended = 1;
    taker->event(taker->data, MHE_SOURCE_ENDED, -1, "the recording has ended");
}

/* ---- packets as they came ---- */

static const mhe_grant *grant_at(const mhe_recorded *r, int64_t i) {
    return (const mhe_grant *)(const void *)((const char *)r->grants + (size_t)i * r->grant_size);
}

/* Streams that were described again before this packet. */
static void describe_again(recording *s, const mhe_source_taker *taker) {
    for (int32_t i = 0; i < s->n_tracks; i++) {
        const track *t = &s->tracks[i];
        if (t->stream->replaces >= 0 && t->stream->from == s->next_arrival &&
            s->of_slot[t->slot] < i) {
            s->of_slot[t->slot] = i;
            taker->event(taker->data, MHE_SOURCE_CHANGED, t->slot,
                         "a stream is another from here on, as when it was recorded");
        }
    }
}

/* The grants of this packet's frames. */
static void add_grants(recording *s, mhe_chunk *chunk) {
    const mhe_recorded *r = s->arrivals;
    const int64_t first = s->next_grant;
    while (s->next_grant < r->n_grants && grant_at(r, s->next_grant)->arrival == s->next_arrival) {
        s->next_grant++;
    }
    if (s->config.granted && s->next_grant > first) {
        chunk->n_grants = (int32_t)(s->next_grant - first);
        chunk->grant_size = r->grant_size;
        chunk->grants = grant_at(r, first);
    }
}

/* Maxima that were found before this packet. */
static void add_maxima(recording *s, mhe_chunk *chunk) {
    const mhe_recorded *r = s->arrivals;
    if (r->size < sizeof *r || r->maxima == NULL) {
        return;
    }
    chunk->maxima = (const mhe_maximum *)(const void *)((const char *)r->maxima +
                                                        (size_t)s->next_maximum * r->maximum_size);
    chunk->maximum_size = r->maximum_size;
    const mhe_maximum *next = chunk->maxima;
    while (s->next_maximum < r->n_maxima && next->arrival <= s->next_arrival) {
        s->next_maximum++;
        chunk->n_maxima++;
        next = (const mhe_maximum *)(const void *)((const char *)next + r->maximum_size);
    }
}

static void repeat(recording *s, double deadline, const mhe_source_taker *taker) {
    while (!s->ended && (s->config.speed == 0 || now() < deadline)) {
        if (s->next_arrival == s->arrivals->n_arrivals) {
            end(s, taker);
            return;
        }
        const mhe_arrival *a = arrival_at(s->arrivals, s->next_arrival);
        track *t = &s->tracks[a->stream];
        if (t->next + a->n > t->stream->n) {
            end(s, taker); /* the recorder was killed within a packet */
            return;
        }
        if (!s->started) {
            s->started = 1;
            s->begun = now();
            s->first = a->received;
        }
        if (s->config.speed > 0) {
            const double due = s->begun + (a->received - s->first) / s->config.speed;
            if (now() < due) {
                sleep_until(due, deadline);
                if (now() < due) {
                    return;
                }
            }
        }
        describe_again(s, taker);
        mhe_chunk chunk = {.size = sizeof chunk,
                           .stream = t->slot,
                           .n = a->n,
                           .received = a->received,
                           .stamp = a->has_stamp ? t->stream->stamp + t->next : NULL,
                           .values = t->stream->values + t->next * t->stream->about.n_channels};
        s->offset = a->offset;
        add_grants(s, &chunk);
        add_maxima(s, &chunk);
        t->next += a->n;
        s->next_arrival++;
        taker->chunk(taker->data, &chunk);
    }
}

/* ---- samples by their times ---- */

/* Track whose next sample is the earliest; -1: none is left. */
static int32_t earliest(const recording *s, double *stamp) {
    int32_t best = -1;
    *stamp = INFINITY;
    for (int32_t i = 0; i < s->n_tracks; i++) {
        const track *t = &s->tracks[i];
        if (t->next < t->stream->n && t->stream->stamp[t->next] < *stamp) {
            *stamp = t->stream->stamp[t->next];
            best = i;
        }
    }
    return best;
}

/* Samples of a track that are due by `until` (stamps), before any other track's next one. */
static int32_t count_due(const recording *s, int32_t i, double until) {
    const track *t = &s->tracks[i];
    double others = INFINITY;
    for (int32_t k = 0; k < s->n_tracks; k++) {
        const track *o = &s->tracks[k];
        if (k != i && o->next < o->stream->n) {
            others = fmin(others, o->stream->stamp[o->next]);
        }
    }
    int32_t n = 1;
    while (n < PACKET && t->next + n < t->stream->n &&
           t->stream->stamp[t->next + n] <= fmin(until, others)) {
        n++;
    }
    return n;
}

static void play(recording *s, double deadline, const mhe_source_taker *taker) {
    const double speed = s->config.speed;
    if (!s->started) {
        s->started = 1;
        s->begun = s->zero = now();
    }
    while (!s->ended && (speed == 0 || now() < deadline)) {
        double stamp;
        const int32_t i = earliest(s, &stamp);
        if (i < 0 && s->config.loop && speed > 0) {
            for (int32_t k = 0; k < s->n_tracks; k++) {
                s->tracks[k].next = 0;
            }
            if (!s->again) { /* told once */
                taker->event(taker->data, MHE_SOURCE_WARNING, -1,
                             "the recording begins again, as often as it ends (loop)");
            }
            s->again = 1;
            s->begun += s->length / speed;
            s->before += s->length;
            continue;
        }
        if (i < 0) {
            end(s, taker);
            return;
        }
        const double due = speed > 0 ? s->begun + (stamp - s->first) / speed : 0;
        if (now() < due) {
            sleep_until(due, deadline);
            if (now() < due) {
                return;
            }
        }
        track *t = &s->tracks[i];
        const double until = speed > 0 ? s->first + (now() - s->begun) * speed : INFINITY;
        const int32_t n = count_due(s, i, until);
        /* at another speed the stamps are those of the recording, and run with it; so does what
         * is said of when they came */
        s->offset = speed > 0 ? s->zero + s->before - s->first : 0;
        const double last = t->stream->stamp[t->next + n - 1] + s->offset;
        const mhe_chunk chunk = {.size = sizeof chunk,
                                 .stream = t->slot,
                                 .n = n,
                                 .received = speed == 1 ? now() : last,
                                 .stamp = t->stream->stamp + t->next,
                                 .values =
                                     t->stream->values + t->next * t->stream->about.n_channels};
        t->next += n;
        taker->chunk(taker->data, &chunk);
    }
}

static mhe_status recording_read(void *self, double deadline, const mhe_source_taker *taker,
                                 mhe_error *err) {
    (void)err;
    recording *s = self;
    if (s->ended) {
        sleep_until(deadline, deadline);
    } else {
        (s->arrivals != NULL ? repeat : play)(s, deadline, taker);
    }
    return MHE_OK;
}

static mhe_status recording_clock_offset(void *self, int32_t i, double *offset, mhe_error *err) {
    (void)i;
    const recording *s = self;
    *offset = s->offset;
    return isfinite(s->offset) ? MHE_OK : mhe_fail(err, MHE_RETRY, "it was not known");
}

static const mhe_source_ops recording_ops = {.size = sizeof recording_ops,
                                             .create = recording_create,
                                             .destroy = recording_destroy,
                                             .open = recording_open,
                                             .count = recording_count,
                                             .stream = recording_stream,
                                             .read = recording_read,
                                             .clock_offset = recording_clock_offset};

static const mhe_option recording_options[] = {
    MHE_OPT_PATH(struct recording_config, file, 0,
                 "A recording with all streams (.xdf): of mhe-live, repeated as it came, or of "
                 "LabRecorder."),
    MHE_OPT_PATH(struct recording_config, markers, 0, "Markers, .trc or .c3d."),
    MHE_OPT_PATH(struct recording_config, emg, 0, "EMG, .sto, .mot or .c3d (analog)."),
    MHE_OPT_PATH(struct recording_config, angles, 0, "Joint angles, .sto or .mot."),
    MHE_OPT_REAL(struct recording_config, speed, 1, 0, 1000, "1",
                 "1: by the clock; 2: twice as fast; 0: as fast as it is taken."),
    MHE_OPT_BOOL(struct recording_config, loop, 0, "Begin again at the end."),
    MHE_OPT_BOOL(struct recording_config, granted, 1,
                 "A recording of mhe-live: each frame may do the work that it could do then, "
                 "whatever the clock says now, so that the same config gives the same bits."),
};

static const mhe_plugin recording_plugin = {
    .size = sizeof recording_plugin,
    .id = "mhe.source.recording",
    .version = "0.2.0",
    .summary = "Recorded files as if they came from devices.",
    .iface = MHE_SOURCE_IFACE,
    .ops = &recording_ops,
    MHE_PLUGIN_OPTIONS(struct recording_config, recording_options)};

MHE_PLUGIN_LIBRARY(&recording_plugin)
