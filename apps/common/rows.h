/* SPDX-License-Identifier: Apache-2.0 */
/* rows.h: a table that was read, with what it holds. */
#ifndef ROWS_H
#define ROWS_H

#include <mhe/table.h>

typedef struct rows {
    mhe_table *table; /* NULL: none was read */
    mhe_table_info is;
} rows;

mhe_status rows_read(const char *path, rows *result, mhe_error *err);
mhe_status rows_read_in(const char *dir, const char *name, rows *result, mhe_error *err);
void rows_close(rows *r);

#endif
