/* SPDX-License-Identifier: Apache-2.0 */
/* envelope.h: from raw EMG to its envelope, sample by sample: band-pass, rectify, smooth.
 *
 * Missing samples (NaN): up to 10 ms the last value holds and the filters wait. After more, and
 * where a channel has shown one and the same number for half a second (electrode off, amplifier at
 * its rail), the result is missing; then, as at the start, the filters begin anew and the result is
 * missing until they have filled (`settling`).
 *
 * Threads: an envelope belongs to one thread at a time. */
#ifndef MHI_EMG_ENVELOPE_H
#define MHI_EMG_ENVELOPE_H

#include "config/run.h"

typedef struct mhi_envelope mhi_envelope;

/* For n_channels signals sampled at `rate` (Hz). Of the options what concerns normalisation is not
 * looked at, and zero_phase neither. MHE_E_INPUT: a corner is not below half of the rate. [cold] */
mhe_status mhi_envelope_create(const mhi_emg_section *options, int32_t n_channels, double rate,
                               mhi_envelope **envelope, mhe_error *err);
void mhi_envelope_free(mhi_envelope *envelope);

/* The next sample of all channels, raw [n_channels] to out [n_channels]; may be the same array.
 * [hot] */
void mhi_envelope_step(mhi_envelope *envelope, const double *raw, double *out);
/* `n` samples are missing of all channels. [hot] */
void mhi_envelope_skip(mhi_envelope *envelope, int32_t n);

/* Group delay in s: of the band-pass in the middle of its band, where the signal is, and of the
 * smoothing at 0 Hz. [any] */
double mhi_envelope_delay(const mhi_envelope *envelope);
/* s until the result is there. [any] */
double mhi_envelope_settling(const mhi_envelope *envelope);

/* A whole signal [n] at once, in place, without delay: the filters go forwards and backwards, a
 * moving window is centred. Each stretch without gaps above 10 ms stands alone; shorter ones than
 * the filters need become missing. MHE_E_INPUT as for create, MHE_E_MEMORY. [cold] */
mhe_status mhi_envelope_zero_phase(const mhi_emg_section *options, double rate, double *signal,
                                   int32_t n, mhe_error *err);

#endif
