/* SPDX-License-Identifier: Apache-2.0 */
/* corrupt: a clean recording with one systematic error, as laboratories make them.
 *   corrupt --list
 *   corrupt KIND MARKERS EMG OUT_DIR      writes OUT_DIR/markers.trc and OUT_DIR/emg.sto */
#include "io/motion_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct recording {
    mhi_table *markers, *emg;
    const char *unit; /* what the header of the markers says */
    uint64_t seed;
} recording;

static double uniform(recording *r) { /* splitmix64 */
    r->seed += 0x9e3779b97f4a7c15U;
    uint64_t z = r->seed;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static double normal(recording *r) {
    return sqrt(-2 * log(uniform(r) + 1e-300)) * cos(2 * acos(-1) * uniform(r));
}

static double *cell(mhi_table *t, int32_t row, int32_t column) {
    return t->values + (ptrdiff_t)row * t->n_columns + column;
}

/* ---- markers ---- */

/* p := m p + shift for all markers */
static void move(recording *r, const double m[9], double x, double y, double z) {
    mhi_table *t = r->markers;
    for (ptrdiff_t i = 0; i < (ptrdiff_t)t->n_rows * t->n_columns; i += 3) {
        const double p[3] = {t->values[i], t->values[i + 1], t->values[i + 2]};
        for (int k = 0; k < 3; k++) {
            t->values[i + k] = m[3 * k] * p[0] + m[3 * k + 1] * p[1] + m[3 * k + 2] * p[2] +
                               (k == 0   ? x
                                : k == 1 ? y
                                         : z);
        }
    }
}

static const double one[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

static void turn(recording *r, int axis, double degrees) {
    const double a = degrees * acos(-1) / 180;
    double m[9] = {0};
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    m[4 * axis] = 1;
    m[4 * j] = m[4 * k] = cos(a);
    m[3 * j + k] = -sin(a);
    m[3 * k + j] = sin(a);
    move(r, m, 0, 0, 0);
}

static void axes_x90(recording *r) {
    turn(r, 0, 90);
}
static void axes_xm90(recording *r) {
    turn(r, 0, -90);
}
static void axes_y180(recording *r) {
    turn(r, 1, 180);
}
static void axes_z90(recording *r) {
    turn(r, 2, 90);
}
static void turn_10(recording *r) {
    turn(r, 2, 10);
}
static void turn_5(recording *r) {
    turn(r, 1, 5);
}
static void axes_cyclic(recording *r) {
    const double m[9] = {0, 1, 0, 0, 0, 1, 1, 0, 0};
    move(r, m, 0, 0, 0);
}
static void mirror_x(recording *r) {
    const double m[9] = {-1, 0, 0, 0, 1, 0, 0, 0, 1};
    move(r, m, 0, 0, 0);
}
static void mirror_z(recording *r) {
    const double m[9] = {1, 0, 0, 0, 1, 0, 0, 0, -1};
    move(r, m, 0, 0, 0);
}
static void mirror_xy(recording *r) { /* x and y exchanged */
    const double m[9] = {0, 1, 0, 1, 0, 0, 0, 0, 1};
    move(r, m, 0, 0, 0);
}
static void shift_1000(recording *r) {
    move(r, one, 1, 0.4, -0.6);
}
static void shift_300(recording *r) {
    move(r, one, 0.3, 0.15, -0.2);
}
static void shift_50(recording *r) {
    move(r, one, 0.03, -0.04, 0);
}
static void shift_20(recording *r) {
    move(r, one, 0, 0.012, 0.016);
}
static void scale(recording *r, double s) {
    const double m[9] = {s, 0, 0, 0, s, 0, 0, 0, s};
    move(r, m, 0, 0, 0);
}
static void scale_110(recording *r) {
    scale(r, 1.1);
}
static void scale_90(recording *r) {
    scale(r, 0.9);
}
static void scale_inch(recording *r) {
    scale(r, 1 / 25.4);
}
static void unit_m(recording *r) {
    r->unit = "m";
}
static void unit_cm(recording *r) {
    r->unit = "cm";
}

static void swap_labels(recording *r, int32_t a, int32_t b) {
    char *label = r->markers->labels[a];
    r->markers->labels[a] = r->markers->labels[b];
    r->markers->labels[b] = label;
}
static void labels_two(recording *r) {
    swap_labels(r, 1, r->markers->n_labels - 1);
}
static void labels_near(recording *r) {
    swap_labels(r, r->markers->n_labels - 2, r->markers->n_labels - 1);
}
static void labels_all(recording *r) {
    for (int32_t i = 0; i + 1 < r->markers->n_labels; i++) {
        swap_labels(r, i, i + 1);
    }
}

static void displace(recording *r, int32_t marker, double x, double y, double z) {
    for (int32_t k = 0; k < r->markers->n_rows; k++) {
        double *p = cell(r->markers, k, 3 * marker);
        p[0] += x;
        p[1] += y;
        p[2] += z;
    }
}
static void one_off_60(recording *r) {
    displace(r, 2, 0.036, 0, 0.048);
}
static void two_off_40(recording *r) {
    displace(r, r->markers->n_labels - 1, 0.024, 0.032, 0);
    displace(r, r->markers->n_labels - 2, 0.024, 0.032, 0);
}

/* Markers from..to hold their place from a share of the rows on to another. */
static void freeze(recording *r, int32_t from, int32_t to, double begin, double end) {
    mhi_table *t = r->markers;
    const int32_t first = (int32_t)(begin * t->n_rows), last = (int32_t)(end * t->n_rows);
    for (int32_t k = first + 1; k < last; k++) {
        memcpy(cell(t, k, 3 * from), cell(t, first, 3 * from),
               sizeof(double) * 3 * (size_t)(to - from));
    }
}
static void frozen_all(recording *r) {
    freeze(r, 0, r->markers->n_labels, 0.4, 0.6);
}
static void frozen_hand(recording *r) {
    freeze(r, r->markers->n_labels - 2, r->markers->n_labels, 0.3, 0.7);
}

static void fill(recording *r, int32_t from, int32_t to, double begin, double end, double value) {
    mhi_table *t = r->markers;
    for (int32_t k = (int32_t)(begin * t->n_rows); k < (int32_t)(end * t->n_rows); k++) {
        for (int32_t i = 3 * from; i < 3 * to; i++) {
            *cell(t, k, i) = value;
        }
    }
}
static void zeros_half(recording *r) {
    fill(r, 0, r->markers->n_labels / 2, 0.2, 0.8, 0);
}
static void missing_all(recording *r) {
    fill(r, 0, r->markers->n_labels, 0.3, 0.7, NAN);
}
static void missing_hand(recording *r) {
    fill(r, 4, r->markers->n_labels, 0, 1, NAN);
}
static void never_seen(recording *r) {
    fill(r, 0, r->markers->n_labels, 0, 1, 0);
}

static void noise_15(recording *r) {
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->markers->n_rows * r->markers->n_columns; i++) {
        r->markers->values[i] += 0.015 * normal(r);
    }
}
static void spikes(recording *r) {
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->markers->n_rows * r->markers->n_columns; i++) {
        r->markers->values[i] += uniform(r) < 0.03 ? 0.3 : 0;
    }
}
static void stretch(mhi_table *t, double factor) {
    for (int32_t k = 0; k < t->n_rows; k++) {
        t->time[k] *= factor;
    }
    t->rate /= factor;
}
static void time_markers(recording *r) {
    stretch(r->markers, 1.2);
}
static void late_hand(recording *r) { /* two markers 0.1 s late */
    mhi_table *t = r->markers;
    const int32_t late = (int32_t)(0.1 * t->rate);
    for (int32_t k = t->n_rows - 1; k >= late; k--) {
        memcpy(cell(t, k, t->n_columns - 6), cell(t, k - late, t->n_columns - 6),
               6 * sizeof(double));
    }
}
static void backwards(recording *r) {
    mhi_table *t = r->markers;
    for (int32_t k = 0; k < t->n_rows / 2; k++) {
        for (int32_t i = 0; i < t->n_columns; i++) {
            const double value = *cell(t, k, i);
            *cell(t, k, i) = *cell(t, t->n_rows - 1 - k, i);
            *cell(t, t->n_rows - 1 - k, i) = value;
        }
    }
}

/* ---- EMG ---- */

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
        most = fmax(most, fabs(*cell(r->emg, k, column)));
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
static void emg_inverted(recording *r) {
    gain(r, -1, largest(r));
}
static void emg_own_peak(recording *r) {
    for (int32_t i = 0; i < r->emg->n_columns; i++) {
        const double most = peak(r, i);
        for (int32_t k = 0; k < r->emg->n_rows && most > 0; k++) {
            *cell(r->emg, k, i) /= most;
        }
    }
}
static void emg_zero(recording *r) {
    gain(r, 0, 0);
}
static void column_gain(recording *r, int32_t column, double factor) {
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        *cell(r->emg, k, column) *= factor;
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
        r->emg->values[i] *= 1.5 * normal(r);
    }
}
static void emg_frozen(recording *r) {
    for (int32_t k = r->emg->n_rows / 4 + 1; k < r->emg->n_rows; k++) {
        memcpy(cell(r->emg, k, 0), cell(r->emg, r->emg->n_rows / 4, 0),
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
static void emg_early(recording *r) {
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        r->emg->time[k] -= 0.3;
    }
}
static void emg_clock(recording *r) {
    stretch(r->emg, 1.25);
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
        r->emg->values[i] = most * uniform(r);
    }
}
static void emg_mixed(recording *r) { /* every channel hears all the others */
    for (int32_t k = 0; k < r->emg->n_rows; k++) {
        double mean = 0;
        for (int32_t i = 0; i < r->emg->n_columns; i++) {
            mean += *cell(r->emg, k, i) / r->emg->n_columns;
        }
        for (int32_t i = 0; i < r->emg->n_columns; i++) {
            *cell(r->emg, k, i) = mean;
        }
    }
}
static void clean(recording *r) {
    (void)r;
}

static const struct {
    const char *name, *what;
    void (*apply)(recording *r);
} kinds[] = {
    {"clean", "as it is", clean},
    {"axes_x90", "markers: z up for y up", axes_x90},
    {"axes_x-90", "markers: y up for z up", axes_xm90},
    {"axes_y180", "markers: walked the other way", axes_y180},
    {"axes_z90", "markers: turned by 90 degrees about z", axes_z90},
    {"axes_cyclic", "markers: x, y, z read as y, z, x", axes_cyclic},
    {"turn_10", "markers: turned by 10 degrees", turn_10},
    {"turn_5", "markers: turned by 5 degrees", turn_5},
    {"mirror_x", "markers: x with the wrong sign", mirror_x},
    {"mirror_z", "markers: z with the wrong sign", mirror_z},
    {"mirror_xy", "markers: x and y exchanged", mirror_xy},
    {"shift_1000", "markers: origin 1.2 m beside", shift_1000},
    {"shift_300", "markers: origin 0.39 m beside", shift_300},
    {"shift_50", "markers: origin 50 mm beside", shift_50},
    {"shift_20", "markers: origin 20 mm beside", shift_20},
    {"scale_110", "markers: 10 % too large", scale_110},
    {"scale_90", "markers: 10 % too small", scale_90},
    {"scale_inch", "markers: inches called mm", scale_inch},
    {"unit_m", "markers: mm called m", unit_m},
    {"unit_cm", "markers: mm called cm", unit_cm},
    {"labels_two", "two labels exchanged", labels_two},
    {"labels_near", "two neighbouring labels exchanged", labels_near},
    {"labels_all", "every label on the next marker", labels_all},
    {"one_off_60", "one marker 60 mm off its place", one_off_60},
    {"two_off_40", "two markers 40 mm off their place", two_off_40},
    {"frozen_all", "markers: 20 % of the frames repeat one", frozen_all},
    {"frozen_hand", "two markers hold for 40 % of the frames", frozen_hand},
    {"zeros_half", "half of the markers 0 0 0 for 60 %", zeros_half},
    {"missing_all", "no marker for 40 % of the frames", missing_all},
    {"missing_hand", "half of the markers never there", missing_hand},
    {"never_seen", "all markers 0 0 0 throughout", never_seen},
    {"noise_15", "markers: 15 mm of noise", noise_15},
    {"spikes", "markers: 3 % of the numbers 0.3 m off", spikes},
    {"late_hand", "two markers 0.1 s late", late_hand},
    {"backwards", "markers backwards in time", backwards},
    {"time_markers", "markers' clock 20 % slow", time_markers},
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
    {"emg_own_peak", "EMG: scaled to each channel's peak", emg_own_peak},
    {"emg_zero", "EMG: all zeros", emg_zero},
    {"emg_dead", "EMG: the strongest channel zero", emg_dead},
    {"emg_rotate", "EMG: every label on the next channel", emg_rotate},
    {"emg_swap", "EMG: the two strongest exchanged", emg_swap},
    {"emg_as_raw", "EMG: alternating (raw as normalised)", emg_as_raw},
    {"emg_frozen", "EMG: repeats one sample for 75 %", emg_frozen},
    {"emg_part", "EMG: half of the trial", emg_part},
    {"emg_late", "EMG: 0.3 s late", emg_late},
    {"emg_early", "EMG: 0.3 s early", emg_early},
    {"emg_clock", "EMG: clock 25 % slow", emg_clock},
    {"emg_clipped", "EMG: cut off at 15 % of its peak", emg_clipped},
    {"emg_random", "EMG: noise alone", emg_random},
    {"emg_mixed", "EMG: every channel the mean of all", emg_mixed},
};
#define N_KINDS (sizeof kinds / sizeof kinds[0])

/* ---- files ---- */

static FILE *open_in(const char *folder, const char *name) {
    char path[4096];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        (void)fprintf(stderr, "%s: cannot be written\n", path);
        exit(1);
    }
    return file;
}

static void put(FILE *file, double value, double factor) {
    if (isnan(value)) {
        (void)fputc('\t', file);
    } else {
        (void)fprintf(file, "\t%.9g", factor * value);
    }
}

static void write_markers(const recording *r, const char *folder) {
    const mhi_table *t = r->markers;
    FILE *file = open_in(folder, "markers.trc");
    (void)fprintf(file,
                  "PathFileType\t4\t(X/Y/Z)\tmarkers.trc\nDataRate\tNumFrames\tNumMarkers\tUnits\n"
                  "%.9g\t%d\t%d\t%s\nFrame#\tTime",
                  t->rate, (int)t->n_rows, (int)t->n_labels, r->unit);
    for (int32_t i = 0; i < t->n_labels; i++) {
        (void)fprintf(file, "\t%s\t\t", t->labels[i]);
    }
    (void)fprintf(file, "\n\t\tX1\tY1\tZ1\n\n");
    for (int32_t k = 0; k < t->n_rows; k++) {
        (void)fprintf(file, "%d\t%.9g", (int)k + 1, t->time[k]);
        for (int32_t i = 0; i < t->n_columns; i++) {
            put(file, t->values[(ptrdiff_t)k * t->n_columns + i], 1000);
        }
        (void)fputc('\n', file);
    }
    (void)fclose(file);
}

static void write_emg(const recording *r, const char *folder) {
    const mhi_table *t = r->emg;
    FILE *file = open_in(folder, "emg.sto");
    (void)fprintf(file, "emg\nversion=1\nnRows=%d\nnColumns=%d\ninDegrees=no\nendheader\ntime",
                  (int)t->n_rows, (int)t->n_columns + 1);
    for (int32_t i = 0; i < t->n_labels; i++) {
        (void)fprintf(file, "\t%s", t->labels[i]);
    }
    for (int32_t k = 0; k < t->n_rows; k++) {
        (void)fprintf(file, "\n%.9g", t->time[k]);
        for (int32_t i = 0; i < t->n_columns; i++) {
            (void)fprintf(file, "\t%.9g", t->values[(ptrdiff_t)k * t->n_columns + i]);
        }
    }
    (void)fputc('\n', file);
    (void)fclose(file);
}

int main(int argc, char **argv) {
    if (argc == 2 && strcmp(argv[1], "--list") == 0) {
        for (size_t i = 0; i < N_KINDS; i++) {
            (void)printf("%s|%s\n", kinds[i].name, kinds[i].what);
        }
        return 0;
    }
    size_t kind = 0;
    while (argc == 5 && kind < N_KINDS && strcmp(kinds[kind].name, argv[1]) != 0) {
        kind++;
    }
    if (argc != 5 || kind == N_KINDS) {
        (void)fprintf(stderr, "corrupt --list | corrupt KIND MARKERS EMG OUT_DIR\n");
        return 2;
    }
    recording r = {.unit = "mm", .seed = 1};
    mhe_error err = {0};
    if (mhi_markers_read(argv[2], &r.markers, &err) != MHE_OK ||
        mhi_signals_read(argv[3], &r.emg, &err) != MHE_OK) {
        (void)fprintf(stderr, "%s\n", err.text);
        return 1;
    }
    kinds[kind].apply(&r);
    write_markers(&r, argv[4]);
    write_emg(&r, argv[4]);
    mhi_table_free(r.markers);
    mhi_table_free(r.emg);
    return 0;
}
