/* SPDX-License-Identifier: Apache-2.0 */
/* corrupt_emg.c: what laboratories do to EMG. */
#include "corrupt.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void gain(recording *r, double factor, double offset) {
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->emg->n_rows * r->emg->n_columns; i++) {
        r->emg->values[i] = factor * r->emg->values[i] + offset;
    }
}
static void emg_percent(recording *r) {
    gain(r, 100, 0);
}
static void emg_hundredth(recording *r) {
    gain(r, 0.01, 0);
}
static void emg_2(recording *r) {
    gain(r, 2, 0);
}
static void emg_half(recording *r) {
    gain(r, 0.5, 0);
}
static void emg_tenth(recording *r) {
    gain(r, 0.1, 0);
}
static void emg_5(recording *r) {
    gain(r, 5, 0);
}
static void emg_thousand(recording *r) {
    gain(r, 1000, 0);
}
static void emg_negative(recording *r) {
    gain(r, -1, 0);
}
static double peak(recording *r, int32_t column) {
    double most = 0;
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        most = fmax(most, fabs(*corrupt_cell(r->emg, k, column)));
    }
    return most;
}
static int32_t strongest(recording *r, int32_t but) {
    int32_t best = but == 0 ? 1 : 0;
    for (int32_t i = 0; i < r->emg->n_columns; i++) {
        best = i != but && peak(r, i) > peak(r, best) ? i : best;
    }
    return best;
}
static double largest(recording *r) {
    return peak(r, strongest(r, -1));
}
static void emg_baseline(recording *r) {
    gain(r, 1, 0.3 * largest(r));
}
static void emg_offset(recording *r) {
    gain(r, 1, 0.1 * largest(r));
}
static void emg_hum(recording *r) { /* 50 Hz, or what is left of it in an envelope */
    const double size = 0.2 * largest(r);
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        const double hum = r->emg->rate > 200 ? sin(100 * acos(-1) * r->emg->time[k]) : 0.5;
        for (int32_t i = 0; i < r->emg->n_columns; i++) {
            *corrupt_cell(r->emg, k, i) += size * hum;
        }
    }
}
static void emg_inverted(recording *r) {
    gain(r, -1, largest(r));
}
static void emg_own_peak(recording *r) {
    for (int32_t i = 0; i < r->emg->n_columns; i++) {
        const double most = peak(r, i);
        for (int32_t k = 0; k < r->emg->n_rows && most > 0; k++) {
            *corrupt_cell(r->emg, k, i) /= most;
        }
    }
}
static void emg_zero(recording *r) {
    gain(r, 0, 0);
}
static void column_gain(recording *r, int32_t column, double factor) {
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        *corrupt_cell(r->emg, k, column) *= factor;
    }
}
static void emg_dead(recording *r) {
    column_gain(r, strongest(r, -1), 0);
}
static void emg_one_3(recording *r) {
    column_gain(r, strongest(r, -1), 3);
}
static void emg_rotate(recording *r) {
    char **l = r->emg->labels, *first = l[0];
    memmove(l, l + 1, sizeof *l * (size_t)(r->emg->n_labels - 1));
    l[r->emg->n_labels - 1] = first;
}
static void emg_swap(recording *r) {
    const int32_t a = strongest(r, -1), b = strongest(r, a);
    char *label = r->emg->labels[a];
    r->emg->labels[a] = r->emg->labels[b];
    r->emg->labels[b] = label;
}
static void emg_as_raw(recording *r) { /* an alternating signal of that size */
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->emg->n_rows * r->emg->n_columns; i++) {
        r->emg->values[i] *= 1.5 * corrupt_normal(r);
    }
}
static void emg_rectified(recording *r) {
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->emg->n_rows * r->emg->n_columns; i++) {
        r->emg->values[i] = fabs(r->emg->values[i]);
    }
}
static void emg_artefact(recording *r) { /* a cable moves: slow and large, in all channels */
    const double size = 2 * largest(r);
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        const double swing = size * sin(2 * acos(-1) * r->emg->time[k]);
        for (int32_t i = 0; i < r->emg->n_columns; i++) {
            *corrupt_cell(r->emg, k, i) += r->emg->rate > 200 ? swing : fmax(0, 0.1 * swing);
        }
    }
}
static void emg_spikes(recording *r) {
    const double size = 5 * largest(r);
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->emg->n_rows * r->emg->n_columns; i++) {
        r->emg->values[i] += corrupt_uniform(r) < 0.002 ? size : 0;
    }
}
static void emg_drift(recording *r) { /* an electrode dries: gains fall to a third */
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        for (int32_t i = 0; i < r->emg->n_columns; i++) {
            *corrupt_cell(r->emg, k, i) *= 1 - 0.67 * k / r->emg->n_rows;
        }
    }
}
static void emg_frozen(recording *r) {
    for (int32_t k = r->emg->n_rows / 4 + 1; k < r->emg->n_rows; k++) {
        memcpy(corrupt_cell(r->emg, k, 0), corrupt_cell(r->emg, r->emg->n_rows / 4, 0),
               sizeof(double) * (size_t)r->emg->n_columns);
    }
}
static void emg_part(recording *r) {
    r->emg->n_rows /= 2;
}
static void emg_late(recording *r) {
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        r->emg->time[k] += 0.3;
    }
}
static void emg_later(recording *r) {
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        r->emg->time[k] += 0.15;
    }
}
static void emg_early(recording *r) {
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        r->emg->time[k] -= 0.3;
    }
}
static void emg_clock(recording *r) {
    corrupt_stretch(r->emg, 1.25);
}
static void emg_clipped(recording *r) {
    const double most = 0.15 * largest(r);
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->emg->n_rows * r->emg->n_columns; i++) {
        r->emg->values[i] = fmax(fmin(r->emg->values[i], most), -most);
    }
}
static void emg_random(recording *r) {
    const double most = largest(r);
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->emg->n_rows * r->emg->n_columns; i++) {
        r->emg->values[i] = most * corrupt_uniform(r);
    }
}
static void emg_mixed(recording *r) { /* every channel hears all the others */
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        double mean = 0;
        for (int32_t i = 0; i < r->emg->n_columns; i++) {
            mean += *corrupt_cell(r->emg, k, i) / r->emg->n_columns;
        }
        for (int32_t i = 0; i < r->emg->n_columns; i++) {
            *corrupt_cell(r->emg, k, i) = mean;
        }
    }
}

const corruption corrupt_emg[] = {
    {"emg_percent", "EMG in percent", emg_percent},
    {"emg_thousand", "EMG: mV called V", emg_thousand},
    {"emg_hundredth", "EMG: a hundredth", emg_hundredth},
    {"emg_tenth", "EMG: a tenth", emg_tenth},
    {"emg_half", "EMG: MVC twice too large", emg_half},
    {"emg_2", "EMG: MVC half of what it is", emg_2},
    {"emg_5", "EMG: MVC a fifth of what it is", emg_5},
    {"emg_one_3", "EMG: the strongest channel times 3", emg_one_3},
    {"emg_negative", "EMG: wrong sign", emg_negative},
    {"emg_inverted", "EMG: upside down", emg_inverted},
    {"emg_baseline", "EMG: an offset of 30 % of its peak", emg_baseline},
    {"emg_offset", "EMG: an offset of 10 % of its peak", emg_offset},
    {"emg_hum", "EMG: mains hum in all channels", emg_hum},
    {"emg_own_peak", "EMG: scaled to each channel's peak", emg_own_peak},
    {"emg_zero", "EMG: all zeros", emg_zero},
    {"emg_dead", "EMG: the strongest channel zero", emg_dead},
    {"emg_rotate", "EMG: every label on the next channel", emg_rotate},
    {"emg_swap", "EMG: the two strongest exchanged", emg_swap},
    {"emg_as_raw", "EMG: alternating (raw as normalised)", emg_as_raw},
    {"emg_rectified", "EMG: rectified before", emg_rectified},
    {"emg_artefact", "EMG: a slow swing in all channels", emg_artefact},
    {"emg_spikes", "EMG: spikes of five times its peak", emg_spikes},
    {"emg_drift", "EMG: gains fall to a third", emg_drift},
    {"emg_frozen", "EMG: repeats one sample for 75 %", emg_frozen},
    {"emg_part", "EMG: half of the trial", emg_part},
    {"emg_late", "EMG: 0.3 s late", emg_late},
    {"emg_later", "EMG: 0.15 s late", emg_later},
    {"emg_early", "EMG: 0.3 s early", emg_early},
    {"emg_clock", "EMG: clock 25 % slow", emg_clock},
    {"emg_clipped", "EMG: cut off at 15 % of its peak", emg_clipped},
    {"emg_random", "EMG: noise alone", emg_random},
    {"emg_mixed", "EMG: every channel the mean of all", emg_mixed},
};
const size_t corrupt_n_emg = sizeof corrupt_emg / sizeof corrupt_emg[0];
