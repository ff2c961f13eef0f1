/* SPDX-License-Identifier: Apache-2.0 */
/* number.h: numbers in text with '.' as decimal point, whatever locale the application has set. */
#ifndef MHI_NUMBER_H
#define MHI_NUMBER_H

#include <mhe/abi.h>

#include <locale.h>

/* Between begin and end this thread's strtod and printf use the C locale; other threads are not
 * touched. [any] */
typedef struct mhi_c_locale {
    locale_t plain, before;
} mhi_c_locale;

mhi_c_locale mhi_c_locale_begin(void);
void mhi_c_locale_end(mhi_c_locale saved);

/* A piece of a text: not NUL-terminated. */
typedef struct mhi_cell {
    const char *text;
    size_t length;
} mhi_cell;

/* 1 and *value where the whole cell is one finite decimal number, else 0. Hexadecimal, "inf" and
 * numbers beyond double are refused. Call it between mhi_c_locale_begin and _end. */
int32_t mhi_number(mhi_cell cell, double *value);
/* 1 where the cell stands for a missing value: empty, or not-a-number in any common spelling. */
int32_t mhi_number_missing(mhi_cell cell);

#endif
