/* SPDX-License-Identifier: Apache-2.0 */
/* bands.h: standard deviations of the estimates (output.uncertainty).
 *
 * The estimator is a recursion: a window starts from the second state of the one before. To first
 * order its error is one too, driven by what estimates rest on (gain.h): its columns, each by one
 * standard deviation of its cause, are carried from window to window. Causes are independent of
 * each other; the errors of EMG, muscles and marker offsets are the same at all nodes of a window
 * and follow the motion, a marker's noise is fresh at every node. A control that is at a bound
 * for a part of the time answers less, so that postures have to give way, and what bounds and EMG
 * leave no room for is not in a band (bands_private.h). */
#ifndef MHI_BANDS_H
#define MHI_BANDS_H

#include "base/arena.h"

#include <mhe/estimator.h>

typedef struct mhi_bands mhi_bands;

/* MHE_E_CONFIG: elastic tendons; a long window with estimates of another than the first node.
 * [cold]
 */
mhe_status mhi_bands_create(mhe_estimator *e, mhi_bands **bands, mhe_error *err);
void mhi_bands_free(mhi_bands *bands);
/* Other estimates are given: before the first. NULL is fine. Without room for them (a long window)
 * none has bands. */
void mhi_bands_set_node(mhi_bands *bands, int32_t node);
/* The window begins anew: nothing is known of earlier ones. NULL is fine. */
void mhi_bands_forget(mhi_bands *bands);
/* Of the window just solved, whose node k is given out; goes on to the next. NULL is fine. [hot] */
void mhi_bands_give(mhe_estimator *e, int32_t k, mhe_estimate *out);

#endif
