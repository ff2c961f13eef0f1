/* SPDX-License-Identifier: Apache-2.0 */
#include "io/motion_file.h"

#include "io/c3d.h"

#include <string.h>
#include <strings.h>

static int32_t is_c3d(const char *path) {
    const char *dot = strrchr(path, '.');
    return dot != NULL && strcasecmp(dot, ".c3d") == 0;
}

mhe_status mhi_markers_read(const char *path, mhi_table **table, mhe_error *err) {
    if (!is_c3d(path)) {
        return mhi_trc_read(path, table, err);
    }
    mhe_status status = mhi_c3d_read(path, table, NULL, err);
    return status == MHE_OK && *table == NULL
               ? mhe_fail(err, MHE_E_INPUT, "%s: holds no points", path)
               : status;
}

mhe_status mhi_signals_read(const char *path, mhi_table **table, mhe_error *err) {
    if (!is_c3d(path)) {
        return mhi_sto_read(path, table, err);
    }
    mhe_status status = mhi_c3d_read(path, NULL, table, err);
    return status == MHE_OK && *table == NULL
               ? mhe_fail(err, MHE_E_INPUT, "%s: holds no analog channels", path)
               : status;
}
