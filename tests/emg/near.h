/* SPDX-License-Identifier: Apache-2.0 */
/* near.h: comparison of real numbers. */
#ifndef TEST_EMG_NEAR_H
#define TEST_EMG_NEAR_H

#include "support.h"

#include <math.h>

/* |value - expected| <= tolerance; NaN is near nothing. */
#define assert_near(value, expected, tolerance)                                          \
    do {                                                                                 \
        const double near_is = (value), near_should = (expected);                        \
        if (!(fabs(near_is - near_should) <= (tolerance))) {                             \
            fail_msg("%.17g is not %.17g within %g", near_is, near_should, (tolerance)); \
        }                                                                                \
    } while (0)

#endif
