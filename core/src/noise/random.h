/* SPDX-License-Identifier: Apache-2.0 */
/* random.h: random numbers by their place, not by the order of the calls.
 *
 * Number `index` of a stream is Philox4x32-10 (Salmon et al. 2011, doi:10.1145/2063384.2063405) of
 * the key `seed` and the counter (index, channel, kind): no state, so that neither threads nor the
 * use of other streams change it. */
#ifndef MHI_RANDOM_H
#define MHI_RANDOM_H

#include <mhe/abi.h>

typedef struct mhi_stream {
    uint64_t seed;
    uint32_t kind, channel;
} mhi_stream;

/* The cipher itself: ten rounds on `counter`, in place. [any] */
void mhi_philox(uint32_t counter[4], uint64_t key);

/* Standard normal deviate, by Box & Muller (1958, doi:10.1214/aoms/1177706645): the cosine one of
 * the pair that two 53-bit uniforms give. At most 8.6 in magnitude. [any] */
double mhi_random_normal(const mhi_stream *stream, uint64_t index);

#endif
