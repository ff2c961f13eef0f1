/* SPDX-License-Identifier: Apache-2.0 */
#include "measure.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

double measure_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int by_value(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void measure_sort(double *values, int32_t n) {
    if (n > 1) {
        qsort(values, (size_t)n, sizeof(double), by_value);
    }
}

double measure_percentile(const double *sorted, int32_t n, double fraction) {
    const int32_t rank = (int32_t)ceil(fraction * n);
    return n == 0 ? NAN : sorted[rank < 1 ? 0 : rank - 1];
}

double measure_median(const double *sorted, int32_t n) {
    return (sorted[(n - 1) / 2] + sorted[n / 2]) / 2;
}
