/* SPDX-License-Identifier: Apache-2.0 */
/* filter.h: Butterworth filters as second-order sections, by the bilinear transform with prewarped
 * corners (Oppenheim & Schafer, Discrete-Time Signal Processing, 3rd ed., 7.2). The same filters as
 * scipy.signal.butter(order, corner, fs=rate, output='sos') and MATLAB's butter: a band-pass of
 * order n has 2 n poles. */
#ifndef MHI_EMG_FILTER_H
#define MHI_EMG_FILTER_H

#include <mhe/abi.h>

#define MHI_FILTER_ORDER_MAX 8
#define MHI_FILTER_SECTIONS_MAX MHI_FILTER_ORDER_MAX

/* (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2) */
typedef struct mhi_biquad {
    double b0, b1, b2, a1, a2;
} mhi_biquad;

/* Sections in series; none: the signal passes as it is. */
typedef struct mhi_filter {
    int32_t n;
    mhi_biquad sections[MHI_FILTER_SECTIONS_MAX];
} mhi_filter;

/* Order 0 .. MHI_FILTER_ORDER_MAX (0: no section), 0 < corner < rate / 2 (Hz); the corner is where
 * the gain is 1/sqrt(2), the gain at 0 is 1. MHE_E_ARGUMENT. [any] */
mhe_status mhi_filter_low_pass(int32_t order, double corner, double rate, mhi_filter *filter,
                               mhe_error *err);
/* 0 < low < high < rate / 2 (Hz); the gain in the middle (mhi_filter_band_centre) is 1. [any] */
mhe_status mhi_filter_band_pass(int32_t order, double low, double high, double rate,
                                mhi_filter *filter, mhe_error *err);
/* Hz: where a band-pass has the gain 1 (the geometric mean of the prewarped corners). [any] */
double mhi_filter_band_centre(double low, double high, double rate);

/* One sample through all sections; state [2 filter->n], zero at first (transposed form II). [any]
 */
double mhi_filter_step(const mhi_filter *filter, double *state, double x);

/* Group delay in samples at a frequency (Hz): minus the slope of the phase. [any] */
double mhi_filter_delay(const mhi_filter *filter, double frequency, double rate);

/* Forwards and backwards over a whole signal [n], in place: no delay, twice the order, gain 1/2 at
 * the corners. The ends are continued by their odd reflection, and the filter starts in its steady
 * state there (Gustafsson 1996 names the alternatives, doi:10.1109/78.492552), as
 * scipy.signal.sosfiltfilt does. MHE_E_MEMORY; MHE_E_INPUT: n is not above
 * mhi_filter_both_ways_least. [cold] */
mhe_status mhi_filter_both_ways(const mhi_filter *filter, double *signal, int32_t n,
                                mhe_error *err);
/* Samples by which each end is continued. */
int32_t mhi_filter_both_ways_least(const mhi_filter *filter);

#endif
