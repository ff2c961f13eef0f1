/* SPDX-License-Identifier: Apache-2.0 */
/* kernels.c: the kernels for any processor, and the choice among the sets. */
#define KERNELS_TABLE kernels_generic
#define KERNELS_NAME "generic"
#include "kernels_body.h"

const kernels *kernels_best(void) {
#ifdef KERNELS_AVX2
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
        return &kernels_avx2;
    }
#endif
    return &kernels_generic;
}
