/* SPDX-License-Identifier: Apache-2.0 */
/* diagnosis_private.h: what diagnosis.c gathers and judge.c judges. */
#ifndef MHI_DIAGNOSIS_PRIVATE_H
#define MHI_DIAGNOSIS_PRIVATE_H

#include "base/arena.h"
#include "believe/diagnosis.h"

#include <math.h>

/* Sums over the estimates. */
typedef struct mhi_tally {
    double squares, most;
    int32_t n, missing;
    int32_t left_out; /* measured, and not believed */
} mhi_tally;

/* Markers and estimate over some time: what moved in the middle of a recording stands out of one
 * part only. */
typedef struct mhi_stretch {
    double from, to; /* s */
    double squares;
    int32_t n;
} mhi_stretch;

/* The estimate against its EMG and the EMG's slope: what is late differs as the slope does. */
typedef struct mhi_lag {
    double *emg, *residual; /* [n_muscles] of the estimate before; NaN: none */
    double time, residuals, slopes, products;
    int32_t n;
} mhi_lag;

/* lag.c. emg [n_muscles]: what the controls were to follow; NaN: none. */
void mhi_lag_begin(mhi_lag *lag, int32_t n_muscles);
void mhi_lag_add(mhi_lag *lag, int32_t n_muscles, double time, const double *emg,
                 const double *control);
/* s that the EMG seems late, which is less than it is, since the estimate follows it; *share: of
 * the squared difference that this explains. */
double mhi_lag_seconds(const mhi_lag *lag, double *share);

struct mhi_diagnosis {
    const mhe_estimator_info *info;
    const mhi_run *run;
    const mhi_recording *recording;
    const mhi_system *system;
    int32_t n, n_seen, n_wanted;
    double *distance, *emg;
    mhi_tally *markers, *muscles, *torques, *moments;
    int32_t *at_bound; /* [n_muscles] */
    int32_t *at_end;   /* [n_q] of its range */
    int32_t n_converged, n_predicted, n_limit;
    mhi_stretch stretch, worst; /* the one in work, the worst that ended */
    mhi_lag lag;
    int32_t *exchanged, *compared; /* [n_markers x n_markers], of pairs i < j */
    mhi_arena arena;
};

static inline double mhi_tally_rms(const mhi_tally *t) {
    return t->n == 0 ? 0 : sqrt(t->squares / t->n);
}

#endif
