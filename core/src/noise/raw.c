/* SPDX-License-Identifier: Apache-2.0 */
/* raw.c: from excitations to raw EMG of electrodes. */
#include "base/pi.h"
#include "emg/filter.h"
#include "noise/parts.h"

#include <math.h>

#define BAND_ORDER 4
#define DEFAULT_MVC 1e-3 /* V */

/* What all electrodes share. */
typedef struct colour {
    mhi_filter filter;
    double gain;    /* gives white noise of variance 1 that variance again */
    int32_t run_in; /* samples until the filter has forgotten its start */
} colour;

static mhe_status make_colour(const mhi_raw_emg *raw, double rate, colour *out, mhe_error *err) {
    mhe_error why = {0};
    mhe_status status =
        mhi_filter_band_pass(BAND_ORDER, raw->band_low, raw->band_high, rate, &out->filter, &why);
    if (status != MHE_OK) {
        return mhe_fail(err, MHE_E_CONFIG, "noise.raw_emg: %s", why.text);
    }
    /* The slowest part fades within some turns of the lower corner, or of the band's width. */
    const double width = fmin(raw->band_low, raw->band_high - raw->band_low);
    double state[2 * MHI_FILTER_SECTIONS_MAX] = {0}, power = 0;
    out->run_in = (int32_t)fmin(20 * rate / width, 1e7);
    for (int32_t k = 0; k < out->run_in; k++) {
        const double h = mhi_filter_step(&out->filter, state, k == 0);
        power += h * h;
    }
    out->gain = 1 / sqrt(power);
    return MHE_OK;
}

/* The signal of one electrode whose muscles have the weights `fraction` [n_m]. */
static void record_electrode(const mhi_noise *noise, const mhi_recording *r, int32_t n_m,
                             const double *fraction, const colour *c, int32_t channel,
                             mhi_record *out) {
    const mhi_raw_emg *raw = &noise->raw_emg;
    const mhi_stream white = {(uint64_t)noise->seed, MHI_STREAM_RAW, (uint32_t)channel};
    const mhi_stream rest = {(uint64_t)noise->seed, MHI_STREAM_AMPLIFIER, (uint32_t)channel};
    const double mvc = mhi_noise_mvc(raw, channel);
    double state[2 * MHI_FILTER_SECTIONS_MAX] = {0};
    for (int32_t k = -c->run_in; k < out->n_samples; k++) {
        const double n = mhi_filter_step(
            &c->filter, state, mhi_random_normal(&white, (uint64_t)(k + (int64_t)c->run_in)));
        if (k < 0) {
            continue;
        }
        const mhi_moment at = mhi_clock_moment(&raw->clock, r, out->time[k]);
        const double *e = r->reference.excitation + (ptrdiff_t)at.row * n_m;
        double sum = 0;
        for (int32_t i = 0; i < n_m; i++) {
            sum += fraction[i] * e[i];
        }
        out->values[(ptrdiff_t)k * out->n_channels + channel] =
            mvc * sqrt(MHI_PI / 2) * sum * c->gain * n +
            raw->amplifier_sd * mhi_random_normal(&rest, (uint64_t)k);
    }
}

double mhi_noise_mvc(const mhi_raw_emg *raw, int32_t electrode) {
    const mhe_real_list *given = &raw->mvc;
    return given->n == 0 ? DEFAULT_MVC : given->values[given->n == 1 ? 0 : electrode];
}

static mhe_status check_options(const mhi_raw_emg *raw, mhe_error *err) {
    if (raw->electrodes.n == 0) {
        return mhe_fail(err, MHE_E_CONFIG, "noise.raw_emg: there are no 'electrodes'");
    }
    if (raw->mvc.n > 1 && raw->mvc.n != raw->electrodes.n) {
        return mhe_fail(err, MHE_E_CONFIG,
                        "noise.raw_emg: 'mvc' has %d values; 1 or one for each of the %d "
                        "electrodes are needed",
                        raw->mvc.n, raw->electrodes.n);
    }
    return MHE_OK;
}

static mhe_status read_fractions(const mhi_noise *noise, const mhe_description *d, mhi_arena *arena,
                                 double **fractions, mhe_error *err) {
    const mhe_text_map *map = &noise->raw_emg.electrodes;
    const char **names = mhi_muscle_names(d, arena);
    *fractions = MHI_TAKE(arena, double, (ptrdiff_t)map->n * d->n_muscles);
    if (names == NULL || *fractions == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    const mhi_subjects muscles = {"muscle", names, d->n_muscles};
    const mhi_subjects electrodes = {"electrode", map->keys, map->n};
    const mhi_map_place place = {noise->tree, noise->raw_emg.node, "electrodes"};
    return mhi_fractions_read(map, &place, &electrodes, &muscles, *fractions, err);
}

mhe_status mhi_noise_raw_emg(const mhi_noise *noise, const mhi_recording *reference,
                             const mhe_description *d, mhi_record *out, mhe_error *err) {
    const mhi_raw_emg *raw = &noise->raw_emg;
    mhi_arena arena = {0};
    double *fractions = NULL;
    colour c = {0};
    *out = (mhi_record){0};
    mhe_status status = check_options(raw, err);
    if (status == MHE_OK) {
        status = mhi_noise_check_excitations(reference, d, err);
    }
    if (status == MHE_OK) {
        status = read_fractions(noise, d, &arena, &fractions, err);
    }
    if (status == MHE_OK) {
        status =
            mhi_record_open(out, &raw->clock, reference, raw->electrodes.n, "noise.raw_emg", err);
    }
    if (status == MHE_OK) {
        status = make_colour(raw, out->rate, &c, err);
    }
    for (int32_t i = 0; i < raw->electrodes.n && status == MHE_OK; i++) {
        record_electrode(noise, reference, d->n_muscles, fractions + (ptrdiff_t)i * d->n_muscles,
                         &c, i, out);
    }
    if (status != MHE_OK) {
        mhi_record_free(out);
    }
    mhi_arena_free(&arena);
    return status;
}
