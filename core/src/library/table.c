/* SPDX-License-Identifier: Apache-2.0 */
#include "base/need.h"
#include "io/motion_file.h"

#include <mhe/table.h>
#include <stdlib.h>

struct mhe_table {
    mhi_table *data;
};

static mhe_status read_table(mhe_status (*reader)(const char *, mhi_table **, mhe_error *),
                             const char *path, mhe_table **table, mhe_error *err) {
    mhe_table *t = calloc(1, sizeof *t);
    *table = NULL;
    if (t == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhe_status status = reader(path, &t->data, err);
    if (status != MHE_OK) {
        mhe_table_close(t);
        return status;
    }
    *table = t;
    return MHE_OK;
}

mhe_status mhe_table_read_signals(const char *path, mhe_table **table, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"path", path}, {"table", table});
    return status == MHE_OK ? read_table(mhi_signals_read, path, table, err) : status;
}

mhe_status mhe_table_read_markers(const char *path, mhe_table **table, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"path", path}, {"table", table});
    return status == MHE_OK ? read_table(mhi_markers_read, path, table, err) : status;
}

void mhe_table_close(mhe_table *t) {
    if (t != NULL) {
        mhi_table_free(t->data);
        free(t);
    }
}

mhe_status mhe_table_describe(const mhe_table *table, mhe_table_info *info, mhe_error *err) {
    mhe_status status = MHI_NEED(err, {"table", table}, {"info", info});
    if (status != MHE_OK) {
        return status;
    }
    const mhi_table *t = table->data;
    const mhe_table_info own = {.size = sizeof own,
                                .n_rows = t->n_rows,
                                .n_columns = t->n_columns,
                                .n_labels = t->n_labels,
                                .labels = (const char *const *)t->labels,
                                .time = t->time,
                                .values = t->values,
                                .rate = t->rate,
                                .in_degrees = t->in_degrees,
                                .n_warnings = t->n_warnings,
                                .warnings = (const char *const *)t->warnings,
                                .unit = t->unit,
                                .unit_name = t->unit_name};
    return mhi_give(__func__, info, &own, err);
}

int32_t mhe_table_find(const mhe_table *table, const char *name) {
    return table == NULL || name == NULL ? -1 : mhi_table_find(table->data, name);
}
