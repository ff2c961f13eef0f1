/* SPDX-License-Identifier: Apache-2.0 */
/* fuzz_biomod.c: any bytes are read as .bioMod: refused with a message, or a sound description. */
#include "fuzz.h"
#include "model_fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    model_fuzz(mhi_biomod_parse, data, size);
    return 0;
}
