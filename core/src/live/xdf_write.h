/* SPDX-License-Identifier: Apache-2.0 */
/* xdf_write.h: a recording as it comes, in .xdf (see io/xdf.h). What was written is a whole file at
 * any moment: a program that is killed leaves what came before. */
#ifndef MHI_XDF_WRITE_H
#define MHI_XDF_WRITE_H

#include <mhe/abi.h>

typedef struct mhi_xdf_writer mhi_xdf_writer;

typedef struct mhi_xdf_column {
    const char *label, *unit, *type, *marker; /* NULL: not said */
    const char *named;                        /* "1": the label is of the model; NULL */
} mhi_xdf_column;

/* Begins a file that must not exist yet. MHE_E_IO. [cold] */
mhe_status mhi_xdf_create(const char *path, mhi_xdf_writer **writer, mhe_error *err);

/* A stream of numbers (double64) at `rate` Hz (0: irregular); *id is its number from now on.
 * `note`: text kept in its description; NULL: none. [cold] */
mhe_status mhi_xdf_add_stream(mhi_xdf_writer *writer, const char *name, const char *type,
                              double rate, const mhi_xdf_column *columns, int32_t n_columns,
                              const char *note, uint32_t *id, mhe_error *err);

/* n samples of stream `id`: stamps [n] and values [n x columns]. [cold] */
mhe_status mhi_xdf_put(mhi_xdf_writer *writer, uint32_t id, int32_t n_columns, int32_t n,
                       const double *stamps, const double *values, mhe_error *err);

/* The sender's clock was `offset` s behind this machine's at `time` (s, the sender's). [cold] */
mhe_status mhi_xdf_put_offset(mhi_xdf_writer *writer, uint32_t id, double time, double offset,
                              mhe_error *err);

/* Hands everything to the system. [cold] */
mhe_status mhi_xdf_flush(mhi_xdf_writer *writer, mhe_error *err);
/* Flushes and closes; NULL is fine. [cold] */
mhe_status mhi_xdf_close(mhi_xdf_writer *writer, mhe_error *err);

#endif
