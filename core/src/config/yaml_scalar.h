/* SPDX-License-Identifier: Apache-2.0 */
/* yaml_scalar.h: numbers and texts as YAML writes them, in any locale of the application. */
#ifndef MHI_YAML_SCALAR_H
#define MHI_YAML_SCALAR_H

#include "base/text.h"

/* The whole of `text` as a number: 1, -0.5, .5, 1e-4, +.inf. Returns 0 where it is none (NaN, 0x10,
 * 1_000, too large for a double). [any] */
int32_t mhi_yaml_number(const char *text, double *value);

#define MHI_YAML_REAL_SIZE 32
/* The shortest decimal form that reads back as the same bits; .inf and -.inf. `value` is not NaN.
 * [any] */
const char *mhi_yaml_real(double value, char out[MHI_YAML_REAL_SIZE]);

int32_t mhi_yaml_is_utf8(const char *text); /* [any] */

/* Appends `text` (its first `length` bytes) on one line, in quotes and with escapes where it needs
 * them, so that it reads back the same as a text. NULL is written as null; what is not UTF-8, as
 * the replacement character. */
void mhi_yaml_text(const char *text, mhi_text *out);
void mhi_yaml_text_n(const char *text, size_t length, mhi_text *out);

#endif
