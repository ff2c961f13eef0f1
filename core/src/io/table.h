/* SPDX-License-Identifier: Apache-2.0 */
/* table.h: time series: .sto/.mot tables and .trc marker trajectories. */
#ifndef MHI_TABLE_H
#define MHI_TABLE_H

#include <mhe/abi.h>

/* Rows of numbers under labels, time first. Missing values are NaN. Owned by whoever read it. */
typedef struct mhi_table {
    char *path;                /* for messages */
    int32_t line;              /* of the file, where the first row stands; 0: it has no lines */
    int32_t n_rows, n_columns; /* columns without time */
    int32_t n_labels;          /* n_columns; in a .trc n_columns / 3 */
    char **labels;             /* [n_labels], no two the same */
    double *time;              /* [n_rows], s, strictly increasing, finite */
    double *values;     /* [n_rows x n_columns], row-major; as in the file, angles and lengths not
                           converted ... */
    int32_t in_degrees; /* ... the .sto header says inDegrees=yes */
    double rate;        /* Hz: from the header or the median step; 0 for one row without either */
    double unit;        /* .trc: metres per unit of the file (already applied to values); else 1 */
    char unit_name[8];  /* .trc: "mm", "cm", "m" */
    char **warnings;    /* what was repaired or skipped: one line each with file:line */
    int32_t n_warnings;
} mhi_table;

/* Reads .sto or .mot (any header the OpenSim or SIMM readers take; tabs, or blanks or commas where
 * the row is made of them). MHE_E_INPUT: "file:line: what": unreadable, no data, a cell that is no
 * number, a wrong number of columns, time not a number or not increasing, a label twice. [cold] */
mhe_status mhi_sto_read(const char *path, mhi_table **table, mhe_error *err);
/* Reads .trc. Values become metres, 3 columns per marker; labels [n_columns / 3] are marker names
 * (n_columns counts coordinates). Empty cells and NaN in any spelling are missing. [cold] */
mhe_status mhi_trc_read(const char *path, mhi_table **table, mhe_error *err);
/* The same from memory. */
mhe_status mhi_sto_parse(const char *name, const char *text, size_t length, mhi_table **table,
                         mhe_error *err);
mhe_status mhi_trc_parse(const char *name, const char *text, size_t length, mhi_table **table,
                         mhe_error *err);
void mhi_table_free(mhi_table *table);

/* Position in `labels` of what a model calls `name`, or -1. In this order:
 *   the same text;
 *   the same behind a subject ("Anna:STER" for "STER") or a component path ("/forceset/BRA");
 *   of the same quantity written in another way. A label may state one: q, qdot, a, e or F before
 *     '.' or '_' ("a.BRA", "F_BRA"), or OpenSim's value, speed, activation, excitation or
 *     tendon_force behind the path ("/jointset/elbow/elbow_flexion/value");
 *   where `name` states no quantity: its q.
 * Two columns that fit equally well are none. [any] */
int32_t mhi_table_find(const mhi_table *table, const char *name);
/* Where that finds none: the one label that is `name` but for letter case, dots, dashes, blanks and
 * underscores (as exports change them); -1 where there is none or several. Labels that are `used`
 * [n_labels] (NULL: none) do not count. [any] */
int32_t mhi_table_find_alike(const mhi_table *table, const char *name, const uint8_t *used);
/* 1 where two names are alike in that sense. [any] */
int32_t mhi_names_alike(const char *a, const char *b);
/* Length of the subject before a label ("Anna" of "Anna:STER"); 0: it names none. [any] */
size_t mhi_label_subject(const char *label);

#endif
