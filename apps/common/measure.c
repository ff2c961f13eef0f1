/* SPDX-License-Identifier: Apache-2.0 */
#include "measure.h"

#include "base/clock.h"
#include "base/values.h"

#include <math.h>
#include <stdlib.h>
#include <time.h>

double measure_seconds(void) {
    return mhi_seconds();
}

void measure_sort(double *values, int32_t n) {
    mhi_sort(values, n);
}

double measure_percentile(const double *sorted, int32_t n, double fraction) {
    const int32_t rank = (int32_t)ceil(fraction * n);
    return n == 0 ? NAN : sorted[rank < 1 ? 0 : rank - 1];
}

double measure_median(const double *sorted, int32_t n) {
    return (sorted[(n - 1) / 2] + sorted[n / 2]) / 2;
}
