/* SPDX-License-Identifier: Apache-2.0 */
/* bench.h: all that is measured, and in which order. */
#ifndef BENCH_H
#define BENCH_H

#include "layers.h"

typedef struct bench_setup {
    const variants *variants;
    const mhe_host *host;
    int32_t repeats;   /* runs of each variant, in alternation */
    int32_t estimates; /* of a run at most; 0: all */
    int32_t no_layers; /* whole runs alone */
} bench_setup;

/* Percentiles of the times of one call, s. */
typedef struct bench_spread {
    double p50, p95, p99, p999, most;
} bench_spread;

/* One part of the frames' times. A frame does the same work in every run, so its median over the
 * runs is what the program takes: what the machine adds, it adds to other frames each time. */
typedef struct bench_part {
    double *all;           /* [repeats x n_frames] s, run by run */
    bench_spread spread;   /* of all */
    bench_spread by_frame; /* of each frame's median over the runs */
    double tail;           /* p99.9 over p50 of a run, median of the runs */
} bench_part;

/* Of the times that were taken side by side with those of the first variant. */
typedef struct bench_ratio {
    double least, median, most;
} bench_ratio;

/* One layer of one group of variants. */
typedef struct bench_layer {
    int32_t layer;
    const rig *rig;  /* the first of its group */
    int32_t calls;   /* a sample is the mean of so many: short calls are timed together */
    int32_t n;       /* samples */
    double *samples; /* [n] s; sorted when summed up */
    bench_spread spread;
    bench_ratio ratio;
} bench_layer;

/* Whole runs of one variant. */
typedef struct bench_run {
    rig rig;
    bench_part parts[N_PARTS];
    int32_t n;        /* estimates of all runs but their first */
    int32_t n_frames; /* ... of one run */
    double *firsts;   /* [repeats] s: first estimate of each run, from a cold start */
    double *means;    /* [repeats] s: mean time of an estimate but the first in each run */
    double first;     /* s, median */
    double rate;      /* estimates per second, of the median run */
    bench_ratio ratio;
} bench_run;

typedef struct bench {
    const bench_setup *setup;
    mhe_host silent; /* says nothing: what is created again has been told of before */
    bench_run runs[VARIANTS_MAX];
    bench_layer layers[VARIANTS_MAX * N_LAYERS]; /* layer by layer */
    int32_t n_layers;
    double elapsed; /* s */
    mhi_arena arena;
} bench;

/* Messages of a failure name the variant. Give back with bench_free in any case. */
mhe_status bench_measure(const bench_setup *setup, bench *b, mhe_error *err);
void bench_free(bench *b);

#endif
