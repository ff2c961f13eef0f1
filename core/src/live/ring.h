/* SPDX-License-Identifier: Apache-2.0 */
/* ring.h: records of one size from one thread to one other, without locks and without waiting.
 *
 * The writer never waits: where the reader is slow the oldest records are written over, and the
 * reader is told how many it has lost. */
#ifndef MHI_RING_H
#define MHI_RING_H

#include <mhe/abi.h>

typedef struct mhi_ring mhi_ring;

/* Room for `capacity` records (a power of two) of n doubles each. NULL: no memory. [cold] */
mhi_ring *mhi_ring_create(int32_t capacity, int32_t n);
void mhi_ring_free(mhi_ring *ring);

/* Adds a record [n]. By the writing thread; allocates nothing, does not wait. [hot] */
void mhi_ring_put(mhi_ring *ring, const double *record);

/* Takes the oldest record that is still there into `record` [n]; 0: none. *lost grows by those that
 * were written over. By the reading thread. [hot] */
int32_t mhi_ring_take(mhi_ring *ring, double *record, int64_t *lost);

#endif
