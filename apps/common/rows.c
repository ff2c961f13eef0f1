/* SPDX-License-Identifier: Apache-2.0 */
#include "rows.h"

mhe_status rows_read(const char *path, rows *r, mhe_error *err) {
    *r = (rows){.is = {.size = sizeof r->is}};
    mhe_status status = mhe_table_read_signals(path, &r->table, err);
    return status == MHE_OK ? mhe_table_describe(r->table, &r->is, err) : status;
}

mhe_status rows_read_in(const char *dir, const char *name, rows *r, mhe_error *err) {
    char path[4096];
    const int n = snprintf(path, sizeof path, "%s/%s", dir, name);
    *r = (rows){0};
    return n < 0 || (size_t)n >= sizeof path
               ? mhe_fail(err, MHE_E_ARGUMENT, "%s: the path is too long", dir)
               : rows_read(path, r, err);
}

void rows_close(rows *r) {
    mhe_table_close(r->table);
    *r = (rows){0};
}
