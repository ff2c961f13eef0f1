/* SPDX-License-Identifier: Apache-2.0 */
/* fuzz_osim.c: any bytes are read as .osim: refused with a message, or a sound description. */
#include "fuzz.h"
#include "model_fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    model_fuzz(mhi_osim_parse, data, size);
    return 0;
}
