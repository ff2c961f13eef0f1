/* SPDX-License-Identifier: Apache-2.0 */
/* fuzz_sto.c: any bytes as a .sto file. */
#include "table_fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    return table_fuzz(mhi_sto_parse, data, size);
}
