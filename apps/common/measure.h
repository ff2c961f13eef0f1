/* SPDX-License-Identifier: Apache-2.0 */
/* measure.h: the clock, and what many times come to. */
#ifndef MEASURE_H
#define MEASURE_H

#include <stdint.h>

double measure_seconds(void); /* of a clock that only goes forward */

void measure_sort(double *values, int32_t n);
/* Nearest-rank percentile of sorted values; fraction 0 is the least, 1 the largest. NaN of none. */
double measure_percentile(const double *sorted, int32_t n, double fraction);
/* The middle value, or half way between the middle two; sorted, n >= 1. */
double measure_median(const double *sorted, int32_t n);

#endif
