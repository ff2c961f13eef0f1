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

extern const mhe_recorded_service mhi_recorded_service;

#endif
