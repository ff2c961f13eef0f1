/* SPDX-License-Identifier: Apache-2.0 */
/* values.h: what is done to many numbers. */
#ifndef MHI_VALUES_H
#define MHI_VALUES_H

#include <stddef.h>
#include <stdint.h>

/* Ascending; none of them is NaN. [cold]; up to 100 [hot]: nothing is allocated for these. */
void mhi_sort(double *values, ptrdiff_t n);

/* 1 where none of values [n] is NaN or infinite. [hot] */
static inline int32_t mhi_all_finite(const double *values, ptrdiff_t n) {
    double sum = 0;
    for (ptrdiff_t i = 0; i < n; i++) {
        sum += values[i] - values[i]; /* NaN for NaN and infinities */
    }
    return sum == 0;
}

#endif
