/* SPDX-License-Identifier: Apache-2.0 */
/* allocations.h: counts what is allocated, plugins included. */
#ifndef MHI_ALLOCATIONS_H
#define MHI_ALLOCATIONS_H

#include <stdint.h>

uint64_t mhi_allocations(void);        /* by the calling thread */
uint64_t mhi_allocations_of_all(void); /* by all threads */

#endif
