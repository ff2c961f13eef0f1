/* SPDX-License-Identifier: Apache-2.0 */
/* kernels_avx2.c: the kernels for x86-64 with AVX2 and FMA; the only file compiled for them. */
#define KERNELS_TABLE kernels_avx2
#define KERNELS_NAME "avx2"
#include "kernels_body.h"
