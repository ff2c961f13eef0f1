/* SPDX-License-Identifier: Apache-2.0 */
/* noise.h: what an experiment would have recorded of a motion that is known.
 *
 * In: joint angles q(t) and muscle excitations e(t) of a reference. Out: markers and EMG, each on a
 * clock of its own, with the errors below. 0 or an empty list switches an error off; with all of
 * them off the records are the truth to the bit. N(0, s) is a normal deviate of standard deviation
 * s (random.h); every error has a stream of its own, numbered by marker or muscle: switching one on
 * or changing its size leaves the deviates of all others as they were.
 *
 * [1] Bailly et al. 2021, doi:10.3389/fbioe.2021.642742.
 *
 * Both records: the clock
 *   rate (Hz), latency (s), clock_error (1)
 *     sample k is labelled t_k = t_0 + k / rate up to the reference's last time (rate 0: the
 *     reference's own times) and was taken at t_0 + (t_k - t_0)(1 + clock_error) - latency: the
 *     instrument runs late by `latency`, and its clock is slow by `clock_error`. Between the
 *     reference's rows q is a cubic Hermite polynomial of q and qdot (linear without qdot), e
 *     that of the row before. Outside its times it stands still.
 *
 * Markers, in this order
 *   sd (m)        [1] the location of each marker in its segment is moved by a constant N(0, sd)
 *                 per axis; measured are the markers of the moved model along q.
 *   white_sd (m)  N(0, white_sd) is added per sample and axis of the ground frame: the camera.
 *   drift_sd (m), drift_time (s)
 *                 a slow wander per marker and axis of the ground frame, d_0 = N(0, drift_sd),
 *                 d_k = f d_(k-1) + N(0, drift_sd sqrt(1 - f^2)), f = exp(-dt / drift_time): an
 *                 Ornstein-Uhlenbeck process of constant variance drift_sd^2 and correlation
 *                 exp(-t / drift_time), sampled exactly (Gillespie 1996,
 *                 doi:10.1103/PhysRevE.54.2084).
 *   gaps, segment_gaps
 *                 {marker or segment: spans in s, "1..1.5, 2..2.2"}: nothing is seen of the
 *                 marker, or of all markers of the segment ("ground" is one), while a label t_k
 *                 lies in a span, ends included.
 *
 * EMG, in this order
 *   crosstalk     {muscle: other muscles and fractions, "BRD 0.2, BicepsLong 0.1"}: its electrode
 *                 reads its own excitation plus these fractions of the others'.
 *   gain_sd (1)   each muscle's signal is multiplied by a constant max(0, 1 + N(0, gain_sd)): the
 *                 normalisation was wrong.
 *   level (1)     [1] noise of level L on the discrete Fourier transform X of each muscle's n
 *                 samples. For the harmonics i in {1, 4, 7, 10, 13, 16}, with c = Re X_i, draw
 *                 r = m + N(0, s), add it to X_i and X_-i, transform back, set what is negative
 *                 to 0:
 *                     i = 4:        m =   c L / i,  s = |0.2 c L|
 *                     other even i: m = 2 c L / i,  s = |0.2 c L|
 *                     odd i:        m = 2 c L / i,  s = |5 c L|
 *                 In the time domain r adds (2 r / n) cos(2 pi i k / n) to sample k, so that
 *                 nothing needs to be transformed. The paper's levels are 0, 1, 1.5 and 2.
 * Harmonics are counted over the whole trial: the paper's motion has four cycles, so that 4 is its
 * fundamental; a trial of one cycle gets far more noise. failures, failed_electrode {muscle: spans
 * in s}: in them the electrode is off: samples are missing (NaN) or zero, as failed_electrode says.
 *
 * Raw EMG, apart from that: modulated noise. Electrode j reads x_j = sum of fraction_i e_i over its
 * muscles, as `electrodes` says {electrode: "BicepsLong 0.5, BicepsShort 0.5"}; sample k is
 *     mvc_j sqrt(pi / 2) x_j(t_k) n_k + N(0, amplifier_sd)     (V)
 * with n Gaussian noise of variance 1 in the band (white noise through a Butterworth band-pass of
 * eight poles, run in), so that the rectified signal has the mean mvc_j where x_j is 1 and the
 * amplifier is silent. [2] Hogan & Mann 1980, IEEE Trans. Biomed. Eng. 27(7), 382: EMG as such
 * noise.
 *
 * Threads: nothing here has state; calls on different outputs may run at the same time. Results
 * depend on the seed, the options and the reference alone. */
#ifndef MHI_NOISE_H
#define MHI_NOISE_H

#include "config/tree.h"
#include "estimator/recording.h"

#include <mhe/model.h>
#include <mhe/option.h>

#define MHI_FAILED_MISSING 0
#define MHI_FAILED_ZERO 1

/* The highest harmonic that the EMG's noise changes; more than twice as many samples are needed. */
#define MHI_NOISE_HARMONIC_MAX 16

/* Zeroed it is the clock of the reference. */
typedef struct mhi_clock {
    double rate, latency, clock_error;
} mhi_clock;

typedef struct mhi_marker_noise {
    mhi_clock clock;
    double sd, white_sd, drift_sd, drift_time;
    mhe_text_map gaps, segment_gaps;
    const mhi_node *node; /* of the section, for messages; NULL */
} mhi_marker_noise;

typedef struct mhi_emg_noise {
    mhi_clock clock;
    double level, gain_sd;
    mhe_text_map crosstalk, failures;
    int32_t failed_electrode; /* MHI_FAILED_* */
    const mhi_node *node;
} mhi_emg_noise;

typedef struct mhi_raw_emg {
    mhi_clock clock;
    mhe_text_map electrodes;
    mhe_real_list mvc; /* V: none: 1 mV; one of all electrodes; or one an electrode */
    double band_low, band_high, amplifier_sd;
    const mhi_node *node;
} mhi_raw_emg;

typedef struct mhi_noise {
    int32_t seed;
    mhi_marker_noise markers;
    mhi_emg_noise emg;
    mhi_raw_emg raw_emg;
    const mhi_tree *tree; /* for messages; NULL */
} mhi_noise;

/* Samples of n_channels numbers; NaN is missing. Zero it before, free it with mhi_record_free. */
typedef struct mhi_record {
    int32_t n_samples, n_channels;
    double rate;    /* Hz */
    double *time;   /* [n_samples], s: the labels t_k */
    double *values; /* [n_samples x n_channels] */
} mhi_record;

void mhi_record_free(mhi_record *record);

/* Markers (m, ground frame; 3 channels a marker) along the reference's q, seen through the model
 * plugin with its filled config. MHE_E_CONFIG: a map names what the model does not have, or is not
 * understood. MHE_E_INPUT: the reference lacks a q. [cold] */
mhe_status mhi_noise_markers(const mhi_noise *noise, const mhi_recording *reference,
                             const mhe_description *description, const mhe_plugin *model,
                             const void *model_config, const mhe_host *host, mhi_record *out,
                             mhe_error *err);

/* EMG (a channel a muscle) of the reference's excitations. As above; MHE_E_INPUT also: too few
 * samples for the harmonics. [cold] */
mhe_status mhi_noise_emg(const mhi_noise *noise, const mhi_recording *reference,
                         const mhe_description *description, mhi_record *out, mhe_error *err);

/* Both records as the estimator takes a recording: on the markers' times, with the truth there (EMG
 * and reference as mhi_recording_read takes them from files). Give it back with mhi_recording_free.
 * Statuses as above; MHE_E_CONFIG also: raw EMG is asked for. [cold] */
mhe_status mhi_noise_recording(const mhi_noise *noise, const mhi_recording *reference,
                               const mhe_description *description, const mhe_plugin *model,
                               const void *model_config, const mhe_host *host,
                               mhi_recording **recording, mhe_error *err);

/* Raw EMG (V; a channel an electrode, in the order of `electrodes`) of the reference's excitations.
 * MHE_E_CONFIG also: no electrodes, mvc of another number, a band that the rate does not hold.
 * [cold] */
mhe_status mhi_noise_raw_emg(const mhi_noise *noise, const mhi_recording *reference,
                             const mhe_description *description, mhi_record *out, mhe_error *err);
/* V: mean of the rectified signal at an excitation of 1. [any] */
double mhi_noise_mvc(const mhi_raw_emg *raw, int32_t electrode);

/* The noise of `level` on one muscle's signal [n], n > 32, `stride` apart, in place. [any] */
void mhi_noise_harmonics(double *signal, int32_t n, int32_t stride, double level, int32_t seed,
                         int32_t muscle);

#endif
