/* SPDX-License-Identifier: Apache-2.0 */
/* number.h: numbers as configuration files write them, in any locale of the application. */
#ifndef MHI_NUMBER_H
#define MHI_NUMBER_H

#include <mhe/abi.h>

/* The whole of `text` as a number: 1, -0.5, .5, 1e-4, +.inf. Returns 0 where it is none (NaN, 0x10,
 * 1_000, too large for a double). [any] */
int32_t mhi_number_read(const char *text, double *value);

#define MHI_NUMBER_SIZE 32
/* The shortest decimal form that reads back as the same bits; .inf and -.inf. `value` is not NaN.
 * [any] */
const char *mhi_number_write(double value, char out[MHI_NUMBER_SIZE]);

#endif
