/* SPDX-License-Identifier: Apache-2.0 */
/* stamp.h: times of the samples of a stream on this machine's clock, without the jitter of their
 * way.
 *
 * A regular stream's times lie on a line against the sample number. A sample can come late and
 * never early, so the line is the lower envelope of the stamps: of the edges of their lower convex
 * hull the one over the middle of the last half minute (Moon, Skelly, Towsley 1999, Estimation and
 * removal of clock skew from network delay measurements, INFOCOM, doi:10.1109/INFCOM.1999.749287).
 * What comes late, however late and however often, does not move it; a clock that drifts does.
 * Samples that are missing move the line's number on by as many periods; a clock that is set
 * begins a new line. */
#ifndef MHI_STAMP_H
#define MHI_STAMP_H

#include <mhe/abi.h>

#define MHI_STAMP_BLOCKS 128

typedef struct mhi_stamp_point {
    double number, stamp;
} mhi_stamp_point;

typedef struct mhi_stamp {
    double rate;                             /* Hz; 0: irregular, nothing is smoothed */
    int64_t n;                               /* samples of this line */
    double number;                           /* of the last sample, in periods */
    double at, start, period;                /* the line: start + period * (number - at) */
    int32_t n_blocks, newest;                /* ring of blocks, a quarter of a second each */
    double block;                            /* number at which the newest of them began */
    mhi_stamp_point least[MHI_STAMP_BLOCKS]; /* of each, its earliest sample */
    int32_t learned;                         /* the line's period is that of the samples */
    int64_t n_late;                          /* samples in a row that come later than jitter */
    double last;                             /* s, the last time handed out */
    int64_t n_gaps, n_jumps;                 /* so far: samples missing; clock set */
} mhi_stamp;

void mhi_stamp_start(mhi_stamp *s, double rate);

/* Time of the next sample, whose stamp on this machine's clock is `stamp` (s) and which was there
 * at `received`. Never later than that, by more than a thousandth of a period that keeps times
 * apart; increases strictly within a line, and from line to line unless the clock was set back. A
 * stamp that is not finite follows the last one. `is_receipt`: the sender has no clock, `stamp` is
 * when the sample came; one that comes too late for jitter is late then, not after a gap, until
 * those after it do not catch up. [any] */
double mhi_stamp_next(mhi_stamp *s, double stamp, double received, int32_t is_receipt);

#endif
