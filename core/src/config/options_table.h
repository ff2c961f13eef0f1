/* SPDX-License-Identifier: Apache-2.0 */
/* options_table.h: looking things up in an option table; shared by checking, filling and writing.
 */
#ifndef MHI_OPTIONS_TABLE_H
#define MHI_OPTIONS_TABLE_H

#include <mhe/option.h>

/* The option with this key; NULL if there is none. */
const mhe_option *mhi_option_find(const mhe_option *options, int32_t n_options, const char *key);

/* Choice number i of "gauss|rk4" and its length in bytes; NULL behind the last one. */
const char *mhi_choice_at(const char *choices, int32_t i, size_t *length);
/* Position of `text` among the choices; -1 if it is none of them. */
int32_t mhi_choice_find(const char *choices, const char *text);

/* Bytes of the field that an option of this type fills; 0 for an unknown type. */
size_t mhi_option_field_size(uint32_t type);

#endif
