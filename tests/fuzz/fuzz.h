/* SPDX-License-Identifier: Apache-2.0 */
/* fuzz.h: what a fuzz target defines. */
#ifndef TEST_FUZZ_H
#define TEST_FUZZ_H

#include <stddef.h>
#include <stdint.h>

/* Feeds one input to the code under test. Returns 0; a finding aborts the program. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
