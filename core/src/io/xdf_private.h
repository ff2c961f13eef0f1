/* SPDX-License-Identifier: Apache-2.0 */
/* xdf_private.h: reading .xdf, shared by its files. */
#ifndef MHI_XDF_PRIVATE_H
#define MHI_XDF_PRIVATE_H

#include "io/xdf.h"

/* Bytes that are still to be read. */
typedef struct mhi_xdf_cursor {
    const uint8_t *at, *end;
} mhi_xdf_cursor;

typedef struct mhi_xdf_reader {
    mhi_xdf *xdf;
    mhe_error *err;
} mhi_xdf_reader;

size_t mhi_xdf_left(const mhi_xdf_cursor *c);
/* Little-endian, whatever the machine; 0: too few bytes are left. */
int mhi_xdf_integer(mhi_xdf_cursor *c, size_t bytes, uint64_t *value);
mhi_xdf_stream *mhi_xdf_find(const mhi_xdf *xdf, uint64_t id); /* NULL: there is none */

mhe_status mhi_xdf_no_memory(mhe_error *err);
mhe_status mhi_xdf_wrong(const mhi_xdf_reader *r, const char *what); /* "file: what" */

/* xdf_header.c: a stream's header becomes a stream of the file. */
mhe_status mhi_xdf_header(const mhi_xdf_reader *r, mhi_xdf_cursor c);

#endif
