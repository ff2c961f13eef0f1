/* SPDX-License-Identifier: Apache-2.0 */
/* escape.h: text as it may stand in a page. */
#ifndef ESCAPE_H
#define ESCAPE_H

#include "base/text.h"

/* Between tags and in attributes. */
void add_escaped(mhi_text *out, const char *text);
/* The first n characters of it at most. */
void add_escaped_part(mhi_text *out, const char *text, size_t n);
/* As a quoted string of JSON that may stand in a script of a page. */
void add_escaped_json(mhi_text *out, const char *text);
/* As a part of an address. */
void add_escaped_path(mhi_text *out, const char *text);

#endif
