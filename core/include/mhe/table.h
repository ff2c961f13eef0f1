/* SPDX-License-Identifier: Apache-2.0 */
/* table.h: time series in files: signals (.sto, .mot, the analog channels of a .c3d, the EMG of an
 * .xdf) and marker trajectories (.trc, the points of a .c3d, the markers of an .xdf).
 *
 * Threads: reading from one table is free; it does not change. */
#ifndef MHE_TABLE_H
#define MHE_TABLE_H

#include <mhe/abi.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mhe_table mhe_table;

/* What a table holds. Pointers live as long as it. */
typedef struct mhe_table_info {
    uint32_t size;
    int32_t n_rows, n_columns; /* columns without time */
    int32_t n_labels;          /* n_columns; of markers n_columns / 3 */
    const char *const *labels; /* [n_labels], no two the same */
    const double *time;        /* [n_rows], s, strictly increasing, finite */
    const double *values;      /* [n_rows x n_columns], row-major, NaN: missing. Signals as in the
                                * file, markers in m */
    double rate;               /* Hz: from the header or the median step; 0: not known */
    int32_t in_degrees;        /* the header of a .sto or .mot says inDegrees=yes */
    int32_t n_warnings;
    const char *const *warnings; /* [n_warnings] what was repaired or skipped, with file:line */
    double unit;                 /* of markers: m per unit of the file, already applied; else 1 */
    const char *unit_name;       /* of markers: "mm", "cm", "m"; else "" */
} mhe_table_info;

/* Reads a file of signals, of markers. MHE_E_INPUT: err->text is "file:line: what". [cold] */
MHE_API mhe_status mhe_table_read_signals(const char *path, mhe_table **table, mhe_error *err);
MHE_API mhe_status mhe_table_read_markers(const char *path, mhe_table **table, mhe_error *err);
MHE_API void mhe_table_close(mhe_table *table); /* NULL is fine. [cold] */

/* Fills `info` up to its size. [any] */
MHE_API mhe_status mhe_table_describe(const mhe_table *table, mhe_table_info *info, mhe_error *err);

/* Place in `labels` of what a model calls `name`, or -1: the same text, or the same behind a
 * subject
 * ("Anna:STER") or a component path ("/forceset/BRA"), or the same quantity written in another way
 * ("F_BRA", "/jointset/elbow/elbow_flexion/value"). Two that fit equally well are none. [any] */
MHE_API int32_t mhe_table_find(const mhe_table *table, const char *name);

#ifdef __cplusplus
}
#endif
#endif
