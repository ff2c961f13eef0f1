/* SPDX-License-Identifier: Apache-2.0 */
/* source_lsl.h: streams of the Lab Streaming Layer as a source. */
#ifndef SOURCE_LSL_H
#define SOURCE_LSL_H

#include "../lsl_library.h"

#include <mhe/source.h>

struct lsl_config { /* filled by the core from the option table */
    const char *library;
    mhe_text_list markers, emg, angles; /* predicates */
    double buffer;                      /* s */
    int32_t connections;
};

#define LSL_ANSWER 2.0   /* s that a sender may take to describe itself, and to connect */
#define LSL_MOST_LINES 4 /* connections to a stream */
#define LSL_GIVEN 64     /* samples that one may be behind another */

/* A connection to a stream, and the stamps of samples that others gave before it: a ring. */
typedef struct lsl_line {
    lsl_inlet inlet;
    double given[LSL_GIVEN];
    int32_t first, n;
    int32_t goes_along; /* its samples are those that the others have */
} lsl_line;

/* One stream: what was asked for, and what was found. */
typedef struct lsl_stream {
    const char *predicate;
    int32_t kind;                   /* MHE_STREAM_* */
    lsl_inlet inlet;                /* NULL: not found yet, or lost */
    lsl_continuous_resolver search; /* while it is looked for */
    double found;                   /* s, when the search had something first; 0: nothing yet */
    char refused[40];               /* uid of a sender that was told to be no use */
    int32_t n_channels, format;
    double rate;
    char *name, *uid;
    char **labels, **units;
    int32_t lost;
    double looked; /* s, when a lost one was looked for last */
    double offset; /* s, lsl_time_correction of the inlet */
    double asked;  /* s, when it was asked for last */
    int32_t has_offset;
    double newest;           /* s of CLOCK_MONOTONIC, the last sample's arrival */
    double *values, *stamps; /* room for one pull */
    unsigned long room;      /* samples */
    int32_t n_lines;
    lsl_line lines[LSL_MOST_LINES]; /* the first is `inlet` */
} lsl_stream;

typedef struct lsl_source {
    const mhe_host *host;
    struct lsl_config config;
    lsl_library lsl;
    double clock; /* CLOCK_MONOTONIC - lsl_local_clock() */
    int32_t n_streams;
    lsl_stream *streams;
} lsl_source;

double lsl_now(void); /* s of CLOCK_MONOTONIC */

/* lsl_search.c: the one stream that the predicate names, looked for behind the scenes. MHE_OK:
 * *info is it, the caller's. MHE_RETRY: not there yet, or not the only one; err says which. Does
 * not wait.
 */
mhe_status lsl_look(lsl_source *source, lsl_stream *stream, lsl_streaminfo *info, mhe_error *err);
void lsl_end_search(lsl_source *source, lsl_stream *stream);

/* lsl_connect.c: opens an inlet to what was found, and reads what it says of itself; `stream` has
 * its predicate and kind and nothing else yet. `clock`: s that its clock may take to be measured;
 * it is measured behind the scenes then. MHE_RETRY: it does not answer; MHE_E_INPUT: its samples
 * are no numbers. */
mhe_status lsl_connect(lsl_source *source, lsl_stream *stream, lsl_streaminfo info, double clock,
                       mhe_error *err);
void lsl_disconnect(lsl_source *source, lsl_stream *stream);

/* lsl_lines.c: more connections to a stream of frames, which is connected. */
void lsl_open_lines(lsl_source *source, lsl_stream *stream, lsl_streaminfo info);
void lsl_close_lines(lsl_source *source, lsl_stream *stream); /* all but `inlet` */
/* Of n samples in stream->values that came by a line, those that came by no other before are moved
 * to the front; returns how many. */
int32_t lsl_take_new(lsl_stream *stream, int32_t line, int32_t n);

#endif
