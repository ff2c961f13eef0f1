/* SPDX-License-Identifier: Apache-2.0 */
/* looks.h: "is the time over?", asked of the clock, and the answers of a frame, which a replay
 * gives again.
 *
 * Everything else that is computed depends on numbers alone, so the answers decide the bits. They
 * are asked for on the estimator's thread, between evaluations; where an evaluation itself was
 * broken off by the clock (model/work.h), that holds for all that follow, and the number of answers
 * before it is kept. */
#ifndef MHI_LOOKS_H
#define MHI_LOOKS_H

#include "model/work.h"

#include <mhe/source.h>

typedef struct mhi_looks {
    mhe_grant grant; /* of the frame in work: being written, or obeyed */
    int32_t obeys;   /* 1: a replay's */
    int32_t n;       /* looks so far */
    int32_t run;     /* even: time was left, odd: it was over */
    int32_t in_run;  /* looks of the run, of a replay */
} mhi_looks;

/* A frame begins. `grant`: to be obeyed; NULL: the clock decides, where by_clock. */
void mhi_looks_begin(mhi_looks *looks, const mhe_grant *grant, int32_t by_clock, mhi_work *work);
/* The time is over at `deadline` (s of CLOCK_MONOTONIC), or would be `seconds` from now. */
int32_t mhi_looks_late(mhi_looks *looks, double deadline, double seconds, mhi_work *work);

#endif
