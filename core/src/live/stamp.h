/* SPDX-License-Identifier: Apache-2.0 */
/* stamp.h: times of the samples of a stream on this machine's clock, without the jitter of their
 * way.
 *
 * A regular stream's times lie on a line against the sample number, which is followed by recursive
 * least squares with forgetting (Ljung 1999, System Identification, section 11.2): what a packet
 * comes late does not show, what a clock drifts does. Samples that are missing move the line's
 * number on by as many periods; a clock that is set begins a new line. */
#ifndef MHI_STAMP_H
#define MHI_STAMP_H

#include <mhe/abi.h>

typedef struct mhi_stamp {
    double rate;             /* Hz; 0: irregular, nothing is smoothed */
    int64_t n;               /* samples of this line */
    double number;           /* of the last sample, in periods */
    double start;            /* s, first stamp of the line */
    double offset, period;   /* the line: start + offset + period * number */
    double p00, p01, p11;    /* covariance of offset and period, in their scale */
    double last;             /* s, the last time handed out */
    int64_t n_gaps, n_jumps; /* so far: samples missing; clock set */
} mhi_stamp;

void mhi_stamp_start(mhi_stamp *s, double rate);

/* Time of the next sample whose stamp on this machine's clock is `stamp` (s). Increases strictly
 * within a line, and from line to line unless the clock was set back. A stamp that is not finite
 * follows the last one. [any] */
double mhi_stamp_next(mhi_stamp *s, double stamp);

#endif
