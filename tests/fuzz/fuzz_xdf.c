/* SPDX-License-Identifier: Apache-2.0 */
/* fuzz_xdf.c: any bytes as an .xdf file. */
#include "io/xdf.h"
#include "table_fuzz.h"

static mhe_status parse_markers(const char *name, const char *data, size_t length,
                                mhi_table **table, mhe_error *err) {
    const mhe_status status = mhi_xdf_tables_parse(name, data, length, table, NULL, err);
    return status == MHE_OK && *table == NULL ? mhe_fail(err, MHE_E_INPUT, "%s: no markers", name)
                                              : status;
}

static mhe_status parse_analog(const char *name, const char *data, size_t length, mhi_table **table,
                               mhe_error *err) {
    const mhe_status status = mhi_xdf_tables_parse(name, data, length, NULL, table, err);
    return status == MHE_OK && *table == NULL ? mhe_fail(err, MHE_E_INPUT, "%s: no EMG", name)
                                              : status;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    return table_fuzz(parse_markers, data, size) + table_fuzz(parse_analog, data, size);
}
