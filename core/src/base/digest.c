/* SPDX-License-Identifier: Apache-2.0 */
#include "base/digest.h"

/* http://www.isthe.com/chongo/tech/comp/fnv/ */
uint64_t mhi_digest(const void *bytes, size_t length) {
    const unsigned char *byte = bytes;
    uint64_t hash = UINT64_C(0xcbf29ce484222325);
    for (size_t i = 0; i < length; i++) {
        hash = (hash ^ byte[i]) * UINT64_C(0x100000001b3);
    }
    return hash;
}
