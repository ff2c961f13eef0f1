/* SPDX-License-Identifier: Apache-2.0 */
/* trust.h: which measurements are believed, and when a window is given up. */
#ifndef MHI_TRUST_H
#define MHI_TRUST_H

#include "estimator/channel.h"

typedef struct mhi_trust {
    double outlier;      /* m; 0: everything is believed */
    double fit;          /* m, RMS marker distance of the newest node solved */
    double *expected;    /* [3 n_k] markers of the newest node before it is measured */
    double *elsewhere;   /* [3 n_k] scratch: of another node */
    int32_t saturation;  /* frames; 0: any EMG is believed */
    int32_t railed;      /* frames in a row whose EMG is at its rails */
    int32_t implausible; /* frames in a row most of whose markers are not where expected */
    int32_t predicted;   /* failed solves in a row */
} mhi_trust;

mhe_status mhi_trust_create(mhi_trust *trust, int32_t n_k, const mhi_run *run, mhi_arena *arena,
                            mhe_error *err);
void mhi_trust_clear(mhi_trust *trust); /* as if no frame had come yet */
/* Where the markers of the window's newest node are expected. */
void mhi_trust_expect(mhe_estimator *e);
void mhi_trust_screen(mhe_estimator *e); /* the newest frame against what is expected */
/* Entries first .. first + n - 1 of node k are not believed, for that reason (MHE_TRACK_*). */
void mhi_trust_leave_out(mhi_channel *channel, int32_t k, int32_t first, int32_t n, int32_t why);
/* Counts a frame's measurement [width] of a channel, used or not. */
void mhi_trust_count(mhi_trust *trust, const mhi_channel *channel, const double *values);
/* Takes out of a channel's nodes up to k what is at the rails for long enough. */
void mhi_trust_drop(const mhi_trust *trust, mhi_channel *channel, int32_t k);
/* Node k of a channel got measurements that came on their own. */
void mhi_trust_late(void *estimator, mhi_channel *channel, int32_t k);
int32_t mhi_trust_is_lost(const mhe_estimator *e);
void mhi_trust_begun(mhe_estimator *e); /* the window begins again: believe what was measured */
void mhi_trust_solved(mhe_estimator *e, int32_t frame_status);

#endif
