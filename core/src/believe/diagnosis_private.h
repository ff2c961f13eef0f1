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
    int32_t *exchanged, *compared; /* [n_markers x n_markers], of pairs i < j */
    mhi_arena arena;
};

static inline double mhi_tally_rms(const mhi_tally *t) {
    return t->n == 0 ? 0 : sqrt(t->squares / t->n);
}

#endif
