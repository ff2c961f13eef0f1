/* SPDX-License-Identifier: Apache-2.0 */
#include "io/motion_file.h"

#include "io/c3d.h"
#include "io/xdf.h"

#include <string.h>
#include <strings.h>

static int32_t ends_in(const char *path, const char *extension) {
    const char *dot = strrchr(path, '.');
    return dot != NULL && strcasecmp(dot, extension) == 0;
}

/* A container of both may lack the one that is wanted. */
static mhe_status there(mhe_status status, const char *path, mhi_table *const *table,
                        const char *what, mhe_error *err) {
    return status == MHE_OK && *table == NULL
               ? mhe_fail(err, MHE_E_INPUT, "%s: holds no %s", path, what)
               : status;
}

mhe_status mhi_markers_read(const char *path, mhi_table **table, mhe_error *err) {
    if (ends_in(path, ".xdf")) {
        return there(mhi_xdf_tables(path, table, NULL, err), path, table, "stream of markers", err);
    }
    if (ends_in(path, ".c3d")) {
        return there(mhi_c3d_read(path, table, NULL, err), path, table, "points", err);
    }
    return mhi_trc_read(path, table, err);
}

mhe_status mhi_signals_read(const char *path, mhi_table **table, mhe_error *err) {
    if (ends_in(path, ".xdf")) {
        return there(mhi_xdf_tables(path, NULL, table, err), path, table, "stream of EMG", err);
    }
    if (ends_in(path, ".c3d")) {
        return there(mhi_c3d_read(path, NULL, table, err), path, table, "analog channels", err);
    }
    return mhi_sto_read(path, table, err);
}
