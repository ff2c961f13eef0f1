/* SPDX-License-Identifier: Apache-2.0 */
/* allocations.h: counts what the calling thread allocates, plugins included. */
#ifndef MHI_ALLOCATIONS_H
#define MHI_ALLOCATIONS_H

#include <stdint.h>

uint64_t mhi_allocations(void);

#endif
