/* SPDX-License-Identifier: Apache-2.0 */
/* decode.h: text files as editors and programs of several decades write them, as UTF-8. */
#ifndef MHI_DECODE_H
#define MHI_DECODE_H

#include <mhe/abi.h>

/* What a text file turned out to be. */
typedef struct mhi_decoded {
    const char *text; /* within the text given, or `owned` */
    size_t length;
    char *owned;          /* to be freed; NULL: the text was UTF-8 already */
    int32_t foreign_line; /* first line that was taken as Windows-1252; 0: none */
    int32_t foreign_n;    /* bytes taken so */
} mhi_decoded;

/* Passes over a byte-order mark; UTF-16 that has one becomes UTF-8; and bytes that are no UTF-8 are
 * read as Windows-1252, of which Latin-1 is a part. `text` [length] is lent and must outlive
 * *decoded where `owned` is NULL. MHE_E_MEMORY. [cold] */
mhe_status mhi_decode(const char *name, const char *text, size_t length, mhi_decoded *decoded,
                      mhe_error *err);

#endif
