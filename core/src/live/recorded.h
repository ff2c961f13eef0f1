/* SPDX-License-Identifier: Apache-2.0 */
/* recorded.h: the service MHE_RECORDED_SERVICE, and what our own recordings hold beside streams. */
#ifndef MHI_RECORDED_H
#define MHI_RECORDED_H

#include <mhe/source.h>

/* Stream of a recording that says how its samples came: a row a packet, in the order in which the
 * estimator took them: number of the .xdf stream, samples, received (s), offset (s, NaN), stamped.
 */
#define MHI_ARRIVALS "mhe-arrivals"
#define MHI_ARRIVAL_COLUMNS 5
/* A row a frame: time (s), status, iterations. */
#define MHI_FRAMES "mhe-frames"
#define MHI_FRAME_COLUMNS 3
/* A row a frame that was pushed, estimated or not: mhe_grant. */
#define MHI_GRANTS "mhe-grants"
#define MHI_GRANT_COLUMNS (4 + MHE_GRANT_LOOKS)
/* A row a description of a stream: number of the .xdf stream, source, stream of the source,
 * arrivals before it, delay (s). The same stream once more: it is another from then on. */
#define MHI_DESCRIPTIONS "mhe-descriptions"
#define MHI_DESCRIPTION_COLUMNS 5

/* A row a maximum of an electrode that the run took: arrivals before it, number in emg.channels,
 * the maximum. */
#define MHI_MAXIMA "mhe-maxima"
#define MHI_MAXIMUM_COLUMNS 3

extern const mhe_recorded_service mhi_recorded_service;

#endif
