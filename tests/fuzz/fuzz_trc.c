/* SPDX-License-Identifier: Apache-2.0 */
/* fuzz_trc.c: any bytes as a .trc file. */
#include "table_fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    return table_fuzz(mhi_trc_parse, data, size);
}
