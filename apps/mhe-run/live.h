/* SPDX-License-Identifier: Apache-2.0 */
/* live.h: the recording fed by the clock, as if it were measured now. */
#ifndef LIVE_H
#define LIVE_H

#include "base/text.h"

#include <mhe/estimator.h>
#include <stdint.h>

/* What came of it; times in s. Zeroed before. */
typedef struct live {
    double begin;    /* of the clock, when the first frame came */
    double deadline; /* from a frame to its estimate */
    double least;    /* of it, for a frame that has waited: what lets it catch up */
    int32_t next;    /* frame to wait for */
    int32_t kept;    /* frames that wait while an estimate is made, as in a device's buffer: those
                      * from one estimate to the next, and those of the time to a deadline that is
                      * longer; 0 is taken as 1 */
    int32_t n_missed;
    int32_t has_priority; /* real-time priority, its own or given: other programs do not delay it */
    int32_t raised;       /* its own */
    double arrived;       /* when the frame in work came */
    double *latency;      /* [n_latency] from a frame's coming to its estimate; of `memory` */
    double *jitter;       /* [n_jitter] from a frame's coming to when it was taken up */
    int32_t n_latency, n_jitter;
    double *memory;
} live;

/* Takes real-time priority where the system lets it and none is given; threads made afterwards have
 * it too. Until live_end. */
void live_raise(live *l);
/* For at most n_frames. */
mhe_status live_open(live *l, int32_t n_frames, mhe_error *err);
void live_close(live *l);

/* Prepares the estimator, waits for the next frame at time[k] [n], -1 at the end. Where more than
 * `kept` came since, the oldest are missed. */
int32_t live_wait(live *l, mhe_estimator *estimator, const double *time, int32_t n);
/* The frame's estimate is there. */
void live_estimated(live *l);
/* Sorts the times, gives the priority back. */
void live_end(live *l);
void live_lines(const live *l, double rate, mhi_text *out); /* after live_end */

#endif
