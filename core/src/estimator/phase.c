/* SPDX-License-Identifier: Apache-2.0 */
/* phase.c: how far the window is, the only place that changes it.
 *
 *     empty -> filling -> beginning -> settling -> running
 *                 ^           |           ^           |
 *                 +-- gap ----+           +-- lost ---+      (emptied: from anywhere to empty) */
#include "estimator/estimator_private.h"

/* Of a window that has no start yet: by its nodes. One that waits for a posture drops its oldest at
 * each frame and is full again at the next. */
static int32_t by_nodes(const mhe_estimator *e) {
    const int32_t filled = e->window.filled, full = e->window.n + 1;
    if (e->phase == MHE_PHASE_BEGINNING && filled >= full - 1) {
        return MHE_PHASE_BEGINNING;
    }
    return filled == 0 ? MHE_PHASE_EMPTY : filled < full ? MHE_PHASE_FILLING : MHE_PHASE_BEGINNING;
}

void mhi_phase_on(mhe_estimator *e, int32_t event) {
    switch (event) {
    case MHI_EVENT_EMPTIED:
        e->phase = MHE_PHASE_EMPTY;
        break;
    case MHI_EVENT_NODES:
        e->phase = mhi_phase_begun(e) ? e->phase : by_nodes(e);
        break;
    case MHI_EVENT_BEGUN:
        e->phase = MHE_PHASE_SETTLING;
        break;
    default:
        e->phase = MHE_PHASE_RUNNING;
        break;
    }
}

int32_t mhi_phase_begun(const mhe_estimator *e) {
    return e->phase >= MHE_PHASE_SETTLING;
}

int32_t mhi_phase_settled(const mhe_estimator *e) {
    return e->phase == MHE_PHASE_RUNNING;
}
