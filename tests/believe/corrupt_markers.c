/* SPDX-License-Identifier: Apache-2.0 */
/* corrupt_markers.c: what laboratories do to markers, and to their clock. */
#include "corrupt.h"

#include <math.h>
#include <string.h>

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
static void drift_60(recording *r) {
    mhi_table *t = r->markers;
    for (int32_t k = 0; k < t->n_rows; k++) {
        for (int32_t i = 0; i < t->n_columns; i += 3) {
            *corrupt_cell(t, k, i) += 0.06 * k / t->n_rows;
        }
    }
}
static void moved_40(recording *r) { /* someone bumps into a camera */
    mhi_table *t = r->markers;
    for (int32_t k = t->n_rows / 2; k < t->n_rows; k++) {
        for (int32_t i = 1; i < t->n_columns; i += 3) {
            *corrupt_cell(t, k, i) += 0.04;
        }
    }
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
        double *p = corrupt_cell(r->markers, k, 3 * marker);
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
        memcpy(corrupt_cell(t, k, 3 * from), corrupt_cell(t, first, 3 * from),
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
            *corrupt_cell(t, k, i) = value;
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
        r->markers->values[i] += 0.015 * corrupt_normal(r);
    }
}
static void spikes(recording *r) {
    for (ptrdiff_t i = 0; i < (ptrdiff_t)r->markers->n_rows * r->markers->n_columns; i++) {
        r->markers->values[i] += corrupt_uniform(r) < 0.03 ? 0.3 : 0;
    }
}
void corrupt_stretch(mhi_table *t, double factor) {
    for (int32_t k = 0; k < t->n_rows; k++) {
        t->time[k] *= factor;
    }
    t->rate /= factor;
}
static void time_markers(recording *r) {
    corrupt_stretch(r->markers, 1.2);
}
static void late_hand(recording *r) { /* two markers 0.1 s late */
    mhi_table *t = r->markers;
    const int32_t late = (int32_t)(0.1 * t->rate);
    for (int32_t k = t->n_rows - 1; k >= late; k--) {
        memcpy(corrupt_cell(t, k, t->n_columns - 6), corrupt_cell(t, k - late, t->n_columns - 6),
               6 * sizeof(double));
    }
}
static void backwards(recording *r) {
    mhi_table *t = r->markers;
    for (int32_t k = 0; k < t->n_rows / 2; k++) {
        for (int32_t i = 0; i < t->n_columns; i++) {
            const double value = *corrupt_cell(t, k, i);
            *corrupt_cell(t, k, i) = *corrupt_cell(t, t->n_rows - 1 - k, i);
            *corrupt_cell(t, t->n_rows - 1 - k, i) = value;
        }
    }
}

const corruption corrupt_markers[] = {
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
    {"drift_60", "markers: origin drifts by 60 mm", drift_60},
    {"moved_40", "markers: origin 40 mm beside from the middle on", moved_40},
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
};
const size_t corrupt_n_markers = sizeof corrupt_markers / sizeof corrupt_markers[0];
