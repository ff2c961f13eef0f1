/* SPDX-License-Identifier: Apache-2.0 */
/* matlab.h: tables in a MATLAB file. */
#ifndef MATLAB_H
#define MATLAB_H

#include <mhe/outbox.h>

typedef struct matlab matlab; /* freed by its outbox */
typedef struct matlab_table matlab_table;

/* A .mat of version 5 in the outbox; its tables are kept in memory and written at the commit, each
 * as a structure of time [n x 1], data [n x n_columns] and labels {1 x n_columns}. MHE_E_IO,
 * MHE_E_MEMORY. */
mhe_status matlab_open(mhe_outbox *outbox, const char *name, matlab **file, mhe_error *err);
/* `name` is a MATLAB word; it and the labels are copied. */
mhe_status matlab_add(matlab *file, const char *name, const char *const *labels, int32_t n_columns,
                      matlab_table **table, mhe_error *err);
mhe_status matlab_row(matlab_table *table, double time, const double *values, mhe_error *err);

#endif
