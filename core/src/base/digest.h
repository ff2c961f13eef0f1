/* SPDX-License-Identifier: Apache-2.0 */
/* digest.h: a number that tells contents apart that differ by accident, not by intent (FNV-1a). */
#ifndef MHI_DIGEST_H
#define MHI_DIGEST_H

#include <stddef.h>
#include <stdint.h>

uint64_t mhi_digest(const void *bytes, size_t length);

#endif
