/* SPDX-License-Identifier: Apache-2.0 */
/* filter.c: design, one step and delay. */
#include "emg/filter.h"

#include "base/pi.h"

#include <complex.h>
#include <math.h>

/* Pole `k` of the analogue low-pass with corner 1 rad/s: on the unit circle, left half. */
static double complex prototype_pole(int32_t order, int32_t k) {
    return cexp(I * MHI_PI * (2.0 * k + order + 1) / (2.0 * order));
}

/* A digital frequency (Hz) on the analogue axis that the bilinear transform s = 2 (z-1)/(z+1)
 * folds onto the unit circle. */
static double prewarp(double frequency, double rate) {
    return 2 * tan(MHI_PI * frequency / rate);
}

static double complex to_digital(double complex s) {
    return (2 + s) / (2 - s);
}

/* Denominator from two poles that are real or each other's conjugates. */
static void set_poles(mhi_biquad *section, double complex p, double complex q) {
    section->a1 = -creal(p + q);
    section->a2 = creal(p * q);
}

static void scale(mhi_biquad *section, double factor) {
    section->b0 *= factor;
    section->b1 *= factor;
    section->b2 *= factor;
}

static double complex response(const mhi_biquad *s, double complex z1) {
    return (s->b0 + (s->b1 + s->b2 * z1) * z1) / (1 + (s->a1 + s->a2 * z1) * z1);
}

static mhe_status check_order(int32_t order, mhe_error *err) {
    return order >= 0 && order <= MHI_FILTER_ORDER_MAX
               ? MHE_OK
               : mhe_fail(err, MHE_E_ARGUMENT, "the order of a filter must be 0 to %d, not %d",
                          MHI_FILTER_ORDER_MAX, (int)order);
}

mhe_status mhi_filter_low_pass(int32_t order, double corner, double rate, mhi_filter *filter,
                               mhe_error *err) {
    *filter = (mhi_filter){0};
    mhe_status status = check_order(order, err);
    if (status != MHE_OK || order == 0) {
        return status;
    }
    if (!(corner > 0 && corner < rate / 2)) {
        return mhe_fail(err, MHE_E_ARGUMENT,
                        "a low-pass at %g Hz needs samples at more than %g Hz, not %g Hz", corner,
                        2 * corner, rate);
    }
    const double warped = prewarp(corner, rate);
    for (int32_t k = 0; k < (order + 1) / 2; k++) {
        const double complex p = to_digital(warped * prototype_pole(order, k));
        mhi_biquad *s = &filter->sections[filter->n++];
        if (2 * k + 1 == order) { /* the real pole of an odd order, with a zero at -1 */
            *s = (mhi_biquad){.b0 = 1, .b1 = 1};
            set_poles(s, creal(p), 0);
        } else {
            *s = (mhi_biquad){.b0 = 1, .b1 = 2, .b2 = 1};
            set_poles(s, p, conj(p));
        }
        scale(s, 1 / creal(response(s, 1)));
    }
    return MHE_OK;
}

double mhi_filter_band_centre(double low, double high, double rate) {
    return rate / MHI_PI * atan(sqrt(prewarp(low, rate) * prewarp(high, rate)) / 2);
}

mhe_status mhi_filter_band_pass(int32_t order, double low, double high, double rate,
                                mhi_filter *filter, mhe_error *err) {
    *filter = (mhi_filter){0};
    mhe_status status = check_order(order, err);
    if (status != MHE_OK || order == 0) {
        return status;
    }
    if (!(low > 0 && low < high && high < rate / 2)) {
        return mhe_fail(err, MHE_E_ARGUMENT,
                        "a band-pass from %g to %g Hz needs 0 < low < high < half of the rate of "
                        "the samples, which is %g Hz",
                        low, high, rate);
    }
    const double a = prewarp(low, rate), b = prewarp(high, rate);
    const double complex z1 =
        cexp(-2 * I * MHI_PI * mhi_filter_band_centre(low, high, rate) / rate);
    for (int32_t k = 0; k < (order + 1) / 2; k++) {
        /* s -> (s^2 + a b) / ((b - a) s) makes two poles of one */
        const double complex half = (b - a) / 2 * prototype_pole(order, k);
        const double complex root = csqrt(half * half - a * b);
        const double complex p = to_digital(half + root), q = to_digital(half - root);
        const int real = 2 * k + 1 == order;
        for (int32_t i = 0; i < (real ? 1 : 2); i++) {
            mhi_biquad *s = &filter->sections[filter->n++];
            *s = (mhi_biquad){.b0 = 1, .b2 = -1}; /* zeros at 0 Hz and at half of the rate */
            if (real) {
                set_poles(s, p, q);
            } else {
                set_poles(s, i == 0 ? p : q, conj(i == 0 ? p : q));
            }
            scale(s, 1 / cabs(response(s, z1)));
        }
    }
    return MHE_OK;
}

double mhi_filter_step(const mhi_filter *filter, double *state, double x) {
    for (int32_t i = 0; i < filter->n; i++, state += 2) {
        const mhi_biquad *s = &filter->sections[i];
        const double y = s->b0 * x + state[0];
        state[0] = s->b1 * x - s->a1 * y + state[1];
        state[1] = s->b2 * x - s->a2 * y;
        x = y;
    }
    return x;
}

/* Group delay of c0 + c1/z + c2/z^2: the real part of (c1/z + 2 c2/z^2) / (c0 + c1/z + c2/z^2). */
static double polynomial_delay(double c0, double c1, double c2, double complex z1) {
    return creal((c1 + 2 * c2 * z1) * z1 / (c0 + (c1 + c2 * z1) * z1));
}

double mhi_filter_delay(const mhi_filter *filter, double frequency, double rate) {
    const double complex z1 = cexp(-2 * I * MHI_PI * frequency / rate);
    double delay = 0;
    for (int32_t i = 0; i < filter->n; i++) {
        const mhi_biquad *s = &filter->sections[i];
        delay += polynomial_delay(s->b0, s->b1, s->b2, z1) - polynomial_delay(1, s->a1, s->a2, z1);
    }
    return delay;
}
