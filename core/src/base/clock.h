/* SPDX-License-Identifier: Apache-2.0 */
/* clock.h: the clock that only goes forward. */
#ifndef MHI_BASE_CLOCK_H
#define MHI_BASE_CLOCK_H

double mhi_seconds(void); /* s of CLOCK_MONOTONIC. [any] */

#endif
