/* SPDX-License-Identifier: Apache-2.0 */
/* lsl_pace.h: a sender in a process of its own that waits for the run. It sends by the clock, but
 * no frame before the run has taken all that left before the LSL_PACE_AHEAD frames ahead of it. So
 * the pace is what the run keeps up with, whatever the machine, the build and the load, and no
 * sample is late by more than the sender means and these few frames: what is looked for is strict.
 */
#ifndef TEST_LSL_PACE_H
#define TEST_LSL_PACE_H

#include <mhe/live.h>
#include <pthread.h>
#include <stdatomic.h>

#define LSL_PACE_AHEAD 3

enum { LSL_PACE_MARKERS, LSL_PACE_EMG, LSL_PACE_STREAMS };

/* FOLDER/NAME.pace, a page that both processes see. */
typedef struct lsl_pace {
    atomic_int go;                       /* the sender may begin */
    atomic_llong sent[LSL_PACE_STREAMS]; /* samples since then */
    atomic_llong taken[LSL_PACE_STREAMS];
    long long before[LSL_PACE_AHEAD][LSL_PACE_STREAMS]; /* sent before the last frames */
} lsl_pace;

/* NULL: there is none, and with `create` none can be made. */
lsl_pace *lsl_pace_map(const char *folder, const char *name, int create);
void lsl_pace_unmap(lsl_pace *pace);

/* ---- the sender's side; a pace of NULL waits for nothing ---- */

void lsl_pace_wait(lsl_pace *pace);                          /* until it may begin */
void lsl_pace_sent(lsl_pace *pace, int stream, int n);       /* n samples of a stream have left */
void lsl_pace_before_frame(lsl_pace *pace, long long frame); /* until that frame may leave */

/* ---- the run's side: a thread that asks the run what it has taken ---- */

typedef struct lsl_pacer {
    lsl_pace *pace;
    const char *name; /* of the streams: NAME-markers, NAME-emg */
    mhe_live *live;
    long long before[LSL_PACE_STREAMS]; /* samples taken before the sender began */
    pthread_mutex_t mutex;
    pthread_t thread;
    atomic_int stop;
} lsl_pacer;

int lsl_pacer_start(lsl_pacer *pacer, const char *folder, const char *name, mhe_live *live);
void lsl_pacer_stop(lsl_pacer *pacer);
/* The sender may begin: the run reads both of its streams. */
void lsl_pacer_go(lsl_pacer *pacer);
/* Before another sender is started. */
void lsl_pacer_hold(lsl_pacer *pacer);
/* Whether the run calls both streams lost. */
int lsl_pacer_lost(lsl_pacer *pacer);

#endif
