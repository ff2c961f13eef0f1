/* SPDX-License-Identifier: Apache-2.0 */
#include "base/values.h"

#include <stdlib.h>

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void mhi_sort(double *values, ptrdiff_t n) {
    if (n > 1) {
        qsort(values, (size_t)n, sizeof *values, by_value);
    }
}
