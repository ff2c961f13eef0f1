/* SPDX-License-Identifier: Apache-2.0 */
/* xdf.h: .xdf, the container of the Lab Streaming Layer community (specification 1.0,
 * github.com/sccn/xdf/wiki/Specifications): streams of samples with stamps of their senders' clocks
 * and, now and then, the measured offset of each clock from the recorder's. */
#ifndef MHI_XDF_H
#define MHI_XDF_H

#include "io/table.h"

#define MHI_XDF_FLOAT32 0
#define MHI_XDF_DOUBLE64 1
#define MHI_XDF_INT8 2
#define MHI_XDF_INT16 3
#define MHI_XDF_INT32 4
#define MHI_XDF_INT64 5
#define MHI_XDF_STRING 6

typedef struct mhi_xdf_channel {
    char *label, *unit, *type, *marker; /* "" where the file says nothing */
    int32_t named; /* a recording of ours: the label was given to it, and has the last word */
} mhi_xdf_channel;

typedef struct mhi_xdf_stream {
    uint32_t id;
    char *name, *type, *source_id; /* "" where the file says nothing */
    int32_t format;                /* MHI_XDF_* */
    int32_t n_channels;
    double rate; /* nominal, Hz; 0: irregular */
    mhi_xdf_channel *channels;
    int64_t n_samples;
    double *time;   /* [n_samples], s: on the recorder's clock, jitter smoothed where rate > 0 */
    double *stamp;  /* [n_samples] as in the file, 0 filled in from the rate */
    double *values; /* [n_samples x n_channels]; NULL for strings */
    char **texts;   /* [n_samples x n_channels]; NULL for numbers */
    int64_t n_offsets;
    double *offset_time, *offset; /* [n_offsets] measured clock offsets */
    int64_t samples_capacity, offsets_capacity;
} mhi_xdf_stream;

typedef struct mhi_xdf {
    char *path;
    int32_t n_streams;
    mhi_xdf_stream *streams;
    int32_t n_warnings;
    char **warnings;
} mhi_xdf;

/* All streams of a file. A file that ends within a chunk (a recorder that was killed) gives what
 * stands before, with a warning. MHE_E_INPUT: "file: what". [cold] */
mhe_status mhi_xdf_read(const char *path, mhi_xdf **xdf, mhe_error *err);
mhe_status mhi_xdf_parse(const char *name, const char *data, size_t length, mhi_xdf **xdf,
                         mhe_error *err);
void mhi_xdf_free(mhi_xdf *xdf);

/* The same file as the tables that .trc and .sto give, on one time that begins with the earliest
 * sample of all streams.
 *   markers: the stream of type MoCap (else the one with channels of type PositionX, PositionY,
 *     PositionZ, or labels that end so): metres by its unit (m where it says nothing); 0 0 0 is a
 *     gap.
 *   analog: the stream of type EMG (else the only numeric one that has no positions), a column a
 *     channel, in the file's unit.
 * Either pointer may be NULL; a table is NULL where the file has none. Of several streams that fit,
 * the one with most samples is taken and the others are named in a warning. [cold] */
mhe_status mhi_xdf_tables(const char *path, mhi_table **markers, mhi_table **analog,
                          mhe_error *err);
mhe_status mhi_xdf_tables_parse(const char *name, const char *data, size_t length,
                                mhi_table **markers, mhi_table **analog, mhe_error *err);

/* xdf_clock.c: fills `time` of a stream from stamps and offsets. */
mhe_status mhi_xdf_synchronise(mhi_xdf_stream *stream, mhe_error *err);

/* Adds "path: text" to a list of warnings; without memory it is dropped. */
void mhi_xdf_warn(mhi_xdf *xdf, const char *text);

#endif
