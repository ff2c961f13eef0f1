/* SPDX-License-Identifier: Apache-2.0 */
/* electrodes_private.h: the stream's parts, shared with the reading of recordings. */
#ifndef MHI_EMG_ELECTRODES_PRIVATE_H
#define MHI_EMG_ELECTRODES_PRIVATE_H

#include "emg/electrodes.h"
#include "emg/envelope.h"

#define MHI_SAME_TIME 5e-7 /* s: files print times with six digits */

typedef struct wire { /* from a channel to a muscle */
    int32_t channel, muscle;
    double factor;
    double shape; /* A; 0: linear */
} wire;

struct mhi_electrodes {
    int32_t n_channels, n_muscles, n_wires, capacity;
    int32_t *column; /* [n_channels] of the raw sample */
    wire *wires;
    mhi_envelope *envelope;
    double rate, offset, max;
    double lag;                  /* s, the longest of a channel */
    double longest;              /* s, of the shifts */
    double *shift;               /* [n_channels] s */
    double *raw, *scale, *peaks; /* [n_channels]; peaks of scaled values, before the cut */
    double *times, *values;      /* rings [capacity], [capacity x n_channels] */
    int64_t n_pushed;
    mhi_arena arena;
};

/* Columns of the channels [n_channels] among labels, -1 of one that is none. MHE_E_INPUT: all are
 * none, or two are one. */
mhe_status mhi_electrodes_columns(const mhi_run *run, const char *source, const char *const *labels,
                                  int32_t n_labels, int32_t *column, mhe_error *err);

#endif
