/* SPDX-License-Identifier: Apache-2.0 */
/* exponential.h: exp and tanh without branches or calls, so that a loop over muscles takes several
 * at a time. exp is within 2 units in the last place for |x| < 708, outside it takes the value
 * there; tanh is within 3e-16 of its value. NaN gives NaN. */
#ifndef MUSCLE_HILL_EXPONENTIAL_H
#define MUSCLE_HILL_EXPONENTIAL_H

#include <stdint.h>
#include <string.h>

static inline double hill_exp(double x) {
    const double round = 0x1.8p52; /* added, it leaves an integer in the last bits */
    x = x > 708 ? 708 : x;
    x = x < -708 ? -708 : x;
    double k = x * 0x1.71547652b82fep0 + round, power;
    uint64_t bits;
    memcpy(&bits, &k, sizeof bits);
    k -= round;
    /* x = k ln 2 + r, |r| <= ln 2 / 2; Taylor's series, whose next term is below 1e-17 */
    double r = (x - k * 0x1.62e42fefa3800p-1) - k * 0x1.ef35793c76730p-45;
    double p = 1.0 / 6227020800;
    p = p * r + 1.0 / 479001600;
    p = p * r + 1.0 / 39916800;
    p = p * r + 1.0 / 3628800;
    p = p * r + 1.0 / 362880;
    p = p * r + 1.0 / 40320;
    p = p * r + 1.0 / 5040;
    p = p * r + 1.0 / 720;
    p = p * r + 1.0 / 120;
    p = p * r + 1.0 / 24;
    p = p * r + 1.0 / 6;
    p = p * r + 1.0 / 2;
    p = p * r + 1.0;
    p = p * r + 1.0;
    bits = (bits << 52) + 0x3ff0000000000000u; /* 2^k */
    memcpy(&power, &bits, sizeof power);
    return p * power;
}

static inline double hill_tanh(double x) {
    return 1 - 2 / (hill_exp(2 * x) + 1);
}

#endif
