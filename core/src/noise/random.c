/* SPDX-License-Identifier: Apache-2.0 */
#include "noise/random.h"

#include "base/pi.h"

#include <math.h>

#define ROUNDS 10

void mhi_philox(uint32_t c[4], uint64_t key) {
    uint32_t k0 = (uint32_t)key, k1 = (uint32_t)(key >> 32);
    for (int round = 0; round < ROUNDS; round++) {
        const uint64_t a = UINT64_C(0xD2511F53) * c[0], b = UINT64_C(0xCD9E8D57) * c[2];
        const uint32_t next[4] = {(uint32_t)(b >> 32) ^ c[1] ^ k0, (uint32_t)b,
                                  (uint32_t)(a >> 32) ^ c[3] ^ k1, (uint32_t)a};
        for (int i = 0; i < 4; i++) {
            c[i] = next[i];
        }
        k0 += 0x9E3779B9u;
        k1 += 0xBB67AE85u;
    }
}

/* In [0, 1), 53 bits. */
static double uniform(uint32_t high, uint32_t low) {
    return (double)(((uint64_t)high << 32 | low) >> 11) * 0x1p-53;
}

double mhi_random_normal(const mhi_stream *stream, uint64_t index) {
    uint32_t c[4] = {(uint32_t)index, (uint32_t)(index >> 32), stream->channel, stream->kind};
    mhi_philox(c, stream->seed);
    const double radius = sqrt(-2 * log(uniform(c[0], c[1]) + 0x1p-53)); /* never log(0) */
    return radius * cos(2 * MHI_PI * uniform(c[2], c[3]));
}
