/* SPDX-License-Identifier: Apache-2.0 */
/* exchange.h: markers whose labels the whole recording has exchanged, by inverse kinematics: the
 * estimate itself may have bent to them. */
#ifndef MHI_EXCHANGE_H
#define MHI_EXCHANGE_H

#include "estimator/recording.h"
#include "model/system.h"

typedef struct mhi_exchange {
    int32_t a, b; /* markers, a < b */
    double as_is; /* m, RMS distance of all markers from the nearest posture ... */
    double fixed; /* ... and with these labels exchanged, and those of the pairs before */
} mhi_exchange;

/* Pairs of the markers that are `suspect` [n_markers] whose exchange brings all markers much nearer
 * to the model; up to `most` into `out`, their number. Takes milliseconds a suspect. [cold] */
int32_t mhi_exchange_find(const mhi_system *system, const mhi_recording *recording,
                          const uint8_t *suspect, mhi_exchange *out, int32_t most);

#endif
