/* SPDX-License-Identifier: Apache-2.0 */
/* live_rig.h: live runs in tests: a config in memory, lines that are told, a thread that directs.
 */
#ifndef TEST_LIVE_RIG_H
#define TEST_LIVE_RIG_H

#include "support.h"

#include <mhe/library.h>
#include <mhe/live.h>
#include <pthread.h>
#include <stdatomic.h>

/* Sections of their configs: the arm by two-stage collocation, each frame estimated. */
#define LIVE_RIG_ARM                                                                     \
    "model: {file: " MHE_TEST_SOURCE_DIR "/models/arm19/arm19.osim}\n"                   \
    "muscle: {curves: paper2021}\n"                                                      \
    "integrator: {plugin: mhe.integrator.rk, tolerance: 0, stages: 2, max_step: 0.03}\n" \
    "solver: {plugin: mhe.solver.rti, preset: speed}\n"                                  \
    "realtime: {most_behind: 0}\n"
/* The filters of raw EMG at 2000 Hz; its channels follow, a line each. */
#define LIVE_RIG_EMG "emg:\n  band_low: 20\n  band_high: 450\n  low_pass: 6\n  channels:\n"

/* A folder of the test's own; "" where none can be made. */
const char *live_rig_folder(void);

/* What a run tells, readable while it runs. */
typedef struct live_words {
    pthread_mutex_t mutex;
    char text[65536];
    size_t n;
} live_words;

/* How often a text was told so far. */
int32_t live_words_count(live_words *words, const char *text);
/* Waits until it was told `times` times; 0: it never was. */
int live_words_wait(live_words *words, const char *text, int32_t times);

typedef struct live_rig {
    const char *name;   /* of its folder of results */
    const char *config; /* YAML */
    const char *record; /* NULL: none */
    double seconds;     /* of estimates; 0: no end */
    int32_t trust;      /* the config may load plugins of its own */
    /* Runs beside it on a thread of its own, with `data`; NULL: nothing does. */
    void *(*director)(void *data);
    void *data;
    live_words words;
    mhe_live *live;  /* while it runs, and until the director has returned */
    atomic_int over; /* the run has ended; its sinks are still there */
    char *summary;   /* JSON; free by mhe_free */
    mhe_error err;
} live_rig;

mhe_status live_rig_run(live_rig *rig);

double live_rig_number(const char *json, const char *key); /* the first of that name */

/* For directors: the same of the run's state; 0 where nothing is known yet. */
double live_rig_state(live_rig *rig, const char *key);
/* Waits until the run has taken `more` frames from now on; 0: it never did. */
int live_rig_wait_frames(live_rig *rig, int32_t more);

/* Runs, and fails the test where the run does. */
void live_rig_must_run(live_rig *rig);

/* Whether two runs wrote the same bytes into a file that both have. */
int live_rig_same(const char *a, const char *b, const char *file);

/* The numbers of a table that was written; the rows without time. NULL: no such file. */
double *live_rig_table(const char *name, const char *file, int32_t *n_rows, int32_t *n_columns);

#endif
