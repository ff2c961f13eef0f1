/* SPDX-License-Identifier: Apache-2.0 */
/* emg.c: from excitations to recorded EMG. */
#include "noise/parts.h"

#include "base/pi.h"

#include <math.h>
#include <string.h>

static const int32_t harmonics[] = {1, 4, 7, 10, 13, MHI_NOISE_HARMONIC_MAX};
#define N_HARMONICS ((int32_t)(sizeof harmonics / sizeof harmonics[0]))

/* Mean and spread of what is added to X_i, for Re X_i = c. */
static void harmonic_moments(int32_t i, double c, double level, double *mean, double *sd) {
    *mean = (i == 4 ? 1 : 2) * c * level / i;
    *sd = fabs((i % 2 == 0 ? 0.2 : 5) * c * level);
}

/* cos(2 pi i k / n), the angle reduced exactly before it is rounded. */
static double wave(int32_t i, int32_t k, int32_t n) {
    return cos(2 * MHI_PI * (double)((int64_t)i * k % n) / n);
}

void mhi_noise_harmonics(double *signal, int32_t n, int32_t stride, double level, int32_t seed,
                         int32_t muscle) {
    const mhi_stream stream = {(uint64_t)seed, MHI_STREAM_HARMONIC, (uint32_t)muscle};
    double r[N_HARMONICS];
    for (int32_t h = 0; h < N_HARMONICS; h++) { /* all read before any is changed */
        double c = 0, mean = 0, sd = 0;
        for (int32_t k = 0; k < n; k++) {
            c += signal[(ptrdiff_t)k * stride] * wave(harmonics[h], k, n);
        }
        harmonic_moments(harmonics[h], c, level, &mean, &sd);
        r[h] = mean + sd * mhi_random_normal(&stream, (uint64_t)harmonics[h]);
    }
    for (int32_t k = 0; k < n; k++) {
        double *x = signal + (ptrdiff_t)k * stride;
        for (int32_t h = 0; h < N_HARMONICS; h++) {
            *x += 2 * r[h] / n * wave(harmonics[h], k, n);
        }
        *x = *x > 0 ? *x : 0;
    }
}

mhe_status mhi_noise_check_excitations(const mhi_recording *r, const mhe_description *d,
                                       mhe_error *err) {
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->n_frames * d->n_muscles; i++) {
        if (!isfinite(r->reference.excitation[i])) {
            return mhe_fail(err, MHE_E_INPUT, "the reference has no excitation of '%s' at %g s",
                            d->muscles[i % d->n_muscles].name, r->time[i / d->n_muscles]);
        }
    }
    return MHE_OK;
}

/* What the electrodes read: rows of `matrix` [n_m x n_m] times the excitations of the row. */
static void read_electrodes(const mhi_noise *noise, const mhi_recording *r, const double *matrix,
                            mhi_record *out) {
    const int32_t n_m = out->n_channels;
    for (int32_t k = 0; k < out->n_samples; k++) {
        const mhi_moment at = mhi_clock_moment(&noise->emg.clock, r, out->time[k]);
        const double *e = r->reference.excitation + (ptrdiff_t)at.row * n_m;
        for (int32_t i = 0; i < n_m; i++) {
            double sum = e[i];
            for (int32_t j = 0; j < n_m; j++) {
                sum += matrix[i * n_m + j] * e[j];
            }
            out->values[(ptrdiff_t)k * n_m + i] = sum;
        }
    }
}

static void scale(const mhi_noise *noise, mhi_record *out) {
    for (int32_t i = 0; i < out->n_channels; i++) {
        const mhi_stream stream = {(uint64_t)noise->seed, MHI_STREAM_GAIN, (uint32_t)i};
        const double gain = fmax(0, 1 + noise->emg.gain_sd * mhi_random_normal(&stream, 0));
        for (int32_t k = 0; k < out->n_samples; k++) {
            out->values[(ptrdiff_t)k * out->n_channels + i] *= gain;
        }
    }
}

static mhe_status add_level(const mhi_noise *noise, mhi_record *out, mhe_error *err) {
    if (out->n_samples <= 2 * MHI_NOISE_HARMONIC_MAX) {
        return mhe_fail(err, MHE_E_INPUT,
                        "noise.emg.level needs more than %d samples of EMG; there are %d",
                        2 * MHI_NOISE_HARMONIC_MAX, out->n_samples);
    }
    for (int32_t i = 0; i < out->n_channels; i++) {
        mhi_noise_harmonics(out->values + i, out->n_samples, out->n_channels, noise->emg.level,
                            noise->seed, i);
    }
    return MHE_OK;
}

const char **mhi_muscle_names(const mhe_description *d, mhi_arena *arena) {
    const char **names = MHI_TAKE(arena, const char *, d->n_muscles);
    for (int32_t i = 0; names != NULL && i < d->n_muscles; i++) {
        names[i] = d->muscles[i].name;
    }
    return names;
}

/* The parts of the options that name muscles. */
typedef struct electrodes {
    double *crosstalk; /* [n_m x n_m] */
    mhi_span *failures;
    int32_t n_failures;
} electrodes;

static mhe_status read_names(const mhi_noise *noise, const mhe_description *d, mhi_arena *arena,
                             electrodes *out, mhe_error *err) {
    const int32_t n_m = d->n_muscles, n_pairs = n_m * n_m;
    const char **names = mhi_muscle_names(d, arena);
    out->crosstalk = MHI_TAKE(arena, double, n_pairs);
    if (names == NULL || out->crosstalk == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const mhi_subjects subjects = {"muscle", names, n_m};
    const mhi_map_place crosstalk = {noise->tree, noise->emg.node, "crosstalk"};
    const mhi_map_place failures = {noise->tree, noise->emg.node, "failures"};
    mhe_status status = mhi_fractions_read(&noise->emg.crosstalk, &crosstalk, &subjects, &subjects,
                                           out->crosstalk, err);
    return status == MHE_OK ? mhi_spans_read(&noise->emg.failures, &failures, &subjects, arena,
                                             &out->failures, &out->n_failures, err)
                            : status;
}

mhe_status mhi_noise_emg(const mhi_noise *noise, const mhi_recording *reference,
                         const mhe_description *d, mhi_record *out, mhe_error *err) {
    mhi_arena arena = {0};
    electrodes parts = {0};
    *out = (mhi_record){0};
    mhe_status status = mhi_noise_check_excitations(reference, d, err);
    if (status == MHE_OK) {
        status = read_names(noise, d, &arena, &parts, err);
    }
    if (status == MHE_OK) {
        status = mhi_record_open(out, &noise->emg.clock, reference, d->n_muscles, "noise.emg", err);
    }
    if (status == MHE_OK) {
        read_electrodes(noise, reference, parts.crosstalk, out);
        if (noise->emg.gain_sd > 0) {
            scale(noise, out);
        }
    }
    if (status == MHE_OK && noise->emg.level > 0) {
        status = add_level(noise, out, err);
    }
    if (status == MHE_OK) {
        mhi_spans_apply(parts.failures, parts.n_failures, 1,
                        noise->emg.failed_electrode == MHI_FAILED_ZERO ? 0 : NAN, out);
    } else {
        mhi_record_free(out);
    }
    mhi_arena_free(&arena);
    return status;
}
