/* SPDX-License-Identifier: Apache-2.0 */
/* source.h: interface of source plugins (kind "source"): where live data come from.
 *
 * A source parses what a device or a program sends and nothing more. It hands out streams of
 * samples with the stamps that came with them, as they came: jitter, gaps, late packets and clocks
 * of their own are the core's to deal with, so that all sources behave alike and a recording
 * repeats a run. Life of an instance:
 *
 *     create -> open (again and again, until all streams are there) -> read ... read -> destroy
 *
 * Threads: one thread calls all functions of an instance. */
#ifndef MHE_SOURCE_H
#define MHE_SOURCE_H

#include <mhe/plugin.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_SOURCE_IFACE "mhe.source/1"

/* What a stream holds. */
#define MHE_STREAM_OTHER 0
#define MHE_STREAM_MARKERS 1 /* three channels a marker: "STER.x", "STER.y", "STER.z" */
#define MHE_STREAM_EMG 2     /* a channel an electrode, or a muscle */
#define MHE_STREAM_ANGLES 3  /* a channel a coordinate */

/* Strings and arrays live until the source's next event of the stream, or destroy(). */
typedef struct mhe_stream_info {
    uint32_t size;
    int32_t kind;     /* MHE_STREAM_* */
    const char *name; /* as the sender calls it */
    int32_t n_channels;
    const char *const *labels; /* [n_channels] */
    const char *const
        *units;   /* [n_channels], as the sender writes them; "" where it says nothing */
    double rate;  /* nominal, Hz; 0: irregular */
    int32_t up;   /* markers: the vertical axis, 0..2; -1: the sender does not say */
    double delay; /* s that its stamps are known to be late by, beside the config's `delay` */
    const uint8_t *named; /* [n_channels] 1: the label is what the model calls it, whatever
                           * data.labels and data.subject say; NULL: none is */
} mhe_stream_info;

/* The work that a frame was granted, in a recording of ours: what a replay obeys, so that it looks
 * at no clock. */
#define MHE_GRANT_LOOKS 8
#define MHE_GRANT_PASSED_OVER 2
#define MHE_GRANT_STOPPED 3
typedef struct mhe_grant {
    int64_t arrival;  /* number of the packet that the frame's sample came in */
    int32_t prepared; /* 1: its window was prepared ahead of it; MHE_GRANT_PASSED_OVER: it was not
                       * taken at all, since the run was behind; MHE_GRANT_STOPPED: the run was
                       * stopped while it was estimated, nothing came of it */
    int32_t by_clock; /* 1: it had a deadline */
    int32_t
        refused; /* looks at the clock before an evaluation was broken off by it; -1: none was */
    int32_t looks[MHE_GRANT_LOOKS]; /* looks at the clock that found time left, then such that found
                                     * none, then time again, ... */
} mhe_grant;

/* An electrode's largest envelope that was found while a recording of ours was made: its EMG is
 * relative to it from then on. */
typedef struct mhe_maximum {
    int64_t arrival; /* number of the packet that was taken next */
    double value;    /* in the channel's unit */
    int32_t channel; /* of the config's emg.channels */
} mhe_maximum;

/* Samples of one stream; lent for the call. */
typedef struct mhe_chunk {
    uint32_t size;
    int32_t stream;  /* 0 .. count - 1 */
    int32_t n;       /* samples */
    double received; /* s of CLOCK_MONOTONIC at which they were there: their times are none later;
                      * of a recording that does not go by the clock the time of its last sample:
                      * frames of it wait as long as they must */
    const double *stamp;  /* [n], s of the sender's clock; NULL: it has none */
    const double *values; /* [n x n_channels], NaN: missing */
    int32_t n_grants;     /* frames that were estimated of these samples when they were recorded */
    uint32_t grant_size;  /* stride of `grants` */
    const mhe_grant *grants;   /* [n_grants]; NULL: these are no repetition */
    int32_t n_maxima;          /* that were found before these samples when they were recorded */
    uint32_t maximum_size;     /* stride of `maxima` */
    const mhe_maximum *maxima; /* [n_maxima]; NULL: there are none */
} mhe_chunk;

#define MHE_SOURCE_LOST 0    /* the stream broke off; the source goes on trying */
#define MHE_SOURCE_BACK 1    /* it is there again, as before */
#define MHE_SOURCE_CHANGED 2 /* its labels, channels or rate are others now: ask stream() anew */
#define MHE_SOURCE_ENDED 3   /* nothing more will come (a recording) */
#define MHE_SOURCE_WARNING 4 /* something odd was passed over: `text` */

/* Where read() puts what it finds; called from within read(). */
typedef struct mhe_source_taker {
    uint32_t size;
    void *data;
    void (*chunk)(void *data, const mhe_chunk *chunk);
    /* `stream` -1: of the source as a whole. `text`: one line for the user, never NULL. */
    void (*event)(void *data, int32_t event, int32_t stream, const char *text);
} mhe_source_taker;

typedef struct mhe_source_ops {
    uint32_t size;
    /* Connects to nothing yet. [cold] */
    mhe_status (*create)(const mhe_host *host, const void *config, void **self, mhe_error *err);
    void (*destroy)(void *self); /* [cold] */
    /* Tries to connect until `deadline` (s of CLOCK_MONOTONIC). MHE_RETRY: not yet; err->text says
     * what is missing ("no stream of type EMG"); call again. MHE_E_IO, MHE_E_INPUT: it never will.
     * [cold] */
    mhe_status (*open)(void *self, double deadline, mhe_error *err);
    int32_t (*count)(const void *self); /* streams, after open(). [cold] */
    mhe_status (*stream)(const void *self, int32_t i, mhe_stream_info *out, mhe_error *err);
    /* Hands out what has come; waits for it until `deadline`. Nothing in that time is no error. A
     * connection that breaks is an event, and read() goes on trying to mend it. MHE_E_*: it cannot
     * go on. [cold] */
    mhe_status (*read)(void *self, double deadline, const mhe_source_taker *taker, mhe_error *err);
    /* Seconds to add to a stamp of stream i to have CLOCK_MONOTONIC, as newly measured as it can
     * without waiting; MHE_RETRY: not known (the core then estimates it from when samples come).
     * NULL: never known. [cold] */
    mhe_status (*clock_offset)(void *self, int32_t i, double *offset, mhe_error *err);
} mhe_source_ops;

/* ---- a service of the core's host: recordings as streams ---- */

#define MHE_RECORDED_SERVICE "mhe.recorded/1"

typedef struct mhe_recorded_stream {
    mhe_stream_info about;
    int64_t n;            /* samples */
    const double *stamp;  /* [n], s, increasing unless `arrivals` say how they came */
    const double *values; /* [n x about.n_channels] */
    int32_t replaces;     /* stream that this is the new description of; -1: none */
    int64_t from;         /* arrival from which on it is so */
} mhe_recorded_stream;

/* n samples of a stream, taken together. */
typedef struct mhe_arrival {
    int32_t stream, n;
    double received;   /* s */
    double offset;     /* s to add to stamps; NaN: not known */
    int32_t has_stamp; /* 0: the sender had no clock */
} mhe_arrival;

typedef struct mhe_recorded {
    uint32_t size;
    int32_t n_streams;
    uint32_t stream_size; /* stride of `streams` */
    const mhe_recorded_stream *streams;
    int64_t n_arrivals; /* 0: the file does not say how its samples came */
    uint32_t arrival_size;
    const mhe_arrival *arrivals;
    int64_t n_grants; /* in the order of their arrivals */
    uint32_t grant_size;
    const mhe_grant *grants;
    int64_t n_maxima; /* in the order of their arrivals */
    uint32_t maximum_size;
    const mhe_maximum *maxima;
} mhe_recorded;

typedef struct mhe_recorded_service {
    uint32_t size;
    /* Reads markers (.trc, .c3d), signals (.sto, .mot, .c3d) or both (.xdf); `kind` MHE_STREAM_*
     * says what a file of signals holds. MHE_E_INPUT: "file:line: what". [cold] */
    mhe_status (*read)(const char *path, int32_t kind, const mhe_recorded **out, mhe_error *err);
    void (*free)(const mhe_recorded *recorded); /* NULL is fine. [cold] */
} mhe_recorded_service;

#ifdef __cplusplus
}
#endif
#endif
