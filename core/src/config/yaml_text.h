/* SPDX-License-Identifier: Apache-2.0 */
/* yaml_text.h: a text as one YAML scalar on one line. */
#ifndef MHI_YAML_TEXT_H
#define MHI_YAML_TEXT_H

#include "base/text.h"

/* Appends `text` (UTF-8; its first `length` bytes), in quotes and with escapes where it needs them,
 * so that it reads back the same as a text. NULL is written as null. */
void mhi_yaml_text(const char *text, mhi_text *out);
void mhi_yaml_text_n(const char *text, size_t length, mhi_text *out);

#endif
