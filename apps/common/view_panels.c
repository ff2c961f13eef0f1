/* SPDX-License-Identifier: Apache-2.0 */
#include "view_panels.h"

#include "base/pi.h"
#include "escape.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define POINTS 600   /* of a line; more would not be seen */
#define PRINTED 1e-4 /* of the smallest axis: less is printed as 0 */

/* ---- numbers ---- */

void view_numbers(mhi_text *out, const float *values, size_t n) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const size_t n_bytes = 4 * n;
    char part[4001];
    size_t at = 0;
    mhi_text_add(out, "\"");
    for (size_t i = 0; i < n_bytes; i += 3) {
        uint32_t bits = 0;
        for (size_t k = i; k < i + 3; k++) {
            uint32_t word = 0;
            if (k < n_bytes) {
                memcpy(&word, values + k / 4, sizeof word);
            }
            bits = bits << 8 | (word >> 8 * (k % 4) & 0xff); /* least byte first, on any machine */
        }
        for (size_t k = 0; k < 4; k++) {
            part[at++] = i + k > n_bytes ? '=' : digits[bits >> (18 - 6 * k) & 63];
        }
        if (at + 4 >= sizeof part || i + 3 >= n_bytes) {
            part[at] = '\0';
            mhi_text_add(out, "%s", part);
            at = 0;
        }
    }
    mhi_text_add(out, "\"");
}

/* ---- tables, thinned to the time of the estimates ---- */

static const rows *shown(const view_tables *t, int32_t i) {
    return t->table[i].table == NULL || t->table[i].is.n_rows < 1 ? NULL : &t->table[i];
}

/* The rows of a table that a line has; returns their number. */
static int32_t thinned(const view_tables *t, int32_t i, int32_t *kept) {
    const rows *r = shown(t, i), *frame = shown(t, VIEW_Q);
    int32_t n = 0;
    for (int32_t k = 0; r != NULL && k < r->is.n_rows; k += r->is.n_rows / POINTS + 1) {
        if (r->is.time[k] >= frame->is.time[0] &&
            r->is.time[k] <= frame->is.time[frame->is.n_rows - 1]) {
            kept[n++] = k;
        }
    }
    return n;
}

static double value_at(const rows *r, int32_t row, int32_t column) {
    return r->is.values[(ptrdiff_t)row * r->is.n_columns + column];
}

/* The smallest and the largest value of rows `from` to `to`, in the order in which they come; NaN
 * where there is none. */
static void extremes(const rows *r, int32_t column, int32_t from, int32_t to, double out[2]) {
    int32_t low = -1, high = -1;
    for (int32_t k = from; k < to; k++) {
        const double v = value_at(r, k, column);
        low = isfinite(v) && (low < 0 || v < value_at(r, low, column)) ? k : low;
        high = isfinite(v) && (high < 0 || v > value_at(r, high, column)) ? k : high;
    }
    out[0] = low < 0 ? NAN : value_at(r, low < high ? low : high, column);
    out[1] = low < 0 ? NAN : value_at(r, low < high ? high : low, column);
}

/* `column` -1: the time. Of a table with more rows than are drawn, two rows that follow each other
 * have what lies between this pair and the next at its smallest and largest: no peak is lost, and
 * what is periodic is no other wave. */
static void add_column(mhi_text *out, const view_tables *t, int32_t i, int32_t column,
                       double scale) {
    int32_t kept[POINTS + 1];
    float values[POINTS + 1];
    const rows *r = shown(t, i);
    const int32_t n = thinned(t, i, kept);
    for (int32_t k = 0; k < n; k++) {
        values[k] =
            (float)(column < 0 ? r->is.time[kept[k]] : scale * value_at(r, kept[k], column));
    }
    for (int32_t k = 0; column >= 0 && k + 1 < n && kept[k + 1] - kept[k] > 1; k += 2) {
        const int32_t end = 2 * kept[k + 1] - kept[k];
        double pair[2];
        extremes(r, column, kept[k], end < r->is.n_rows ? end : r->is.n_rows, pair);
        values[k] = (float)(scale * pair[0]);
        values[k + 1] = (float)(scale * pair[1]);
    }
    view_numbers(out, values, (size_t)n);
}

/* ---- small pictures ---- */

/* What is drawn, against what; least: the axis spans at least that much. */
typedef struct quantity {
    const char *heading, *prefix, *unit;
    int32_t table, measured, truth, sd; /* VIEW_*; -1: none */
    const char *truth_prefix, *sd_prefix;
    double scale, least;
} quantity;

static int32_t find(const view_tables *t, int32_t i, const char *prefix, const char *name) {
    char label[256];
    const rows *r = i < 0 ? NULL : shown(t, i);
    (void)snprintf(label, sizeof label, "%s%s", prefix, name);
    return r == NULL ? -1 : mhe_table_find(r->table, label);
}

static void widen(const view_tables *t, int32_t i, int32_t column, double scale, double range[2]) {
    const rows *r = i < 0 ? NULL : shown(t, i);
    for (int32_t k = 0; r != NULL && column >= 0 && k < r->is.n_rows; k++) {
        const double y = scale * r->is.values[(ptrdiff_t)k * r->is.n_columns + column];
        range[0] = fmin(range[0], y); /* of a number and NaN: it */
        range[1] = fmax(range[1], y);
    }
}

/* As it is printed: what is nothing beside the smallest axis is 0, not 2e-47. */
static double printed(const quantity *q, double value) {
    return fabs(value) < PRINTED * q->least ? 0 : value;
}

static void add_line(mhi_text *out, const view_tables *t, int32_t i, int32_t column, double scale,
                     const char *kind, int *n) {
    if (i >= 0 && column >= 0) {
        mhi_text_add(out, "%s[\"%s\",%d,", (*n)++ > 0 ? "," : "", kind, (int)i);
        add_column(out, t, i, column, scale);
        mhi_text_add(out, "]");
    }
}

static void add_panel(mhi_text *out, const view_tables *t, const quantity *q, const char *name,
                      int32_t column, int *n_panels) {
    const int32_t measured = find(t, q->measured, "", name);
    const int32_t truth = find(t, q->truth, q->truth_prefix, name);
    int32_t sd = find(t, q->sd, q->sd_prefix, name);
    sd = sd >= 0 && shown(t, q->sd)->is.n_rows == shown(t, q->table)->is.n_rows ? sd : -1;
    double range[2] = {INFINITY, -INFINITY};
    int n = 0;
    widen(t, q->table, column, q->scale, range);
    widen(t, q->measured, measured, q->scale, range);
    widen(t, q->truth, truth, q->scale, range);
    if (!(range[0] <= range[1])) {
        return;
    }
    mhi_text_add(out, "%s{\"name\":", (*n_panels)++ > 0 ? "," : "");
    add_escaped_json(out, name);
    mhi_text_add(out, ",\"range\":[%.9g,%.9g],\"lines\":[", printed(q, range[0]),
                 printed(q, range[1]));
    add_line(out, t, q->truth, truth, q->scale, "true", &n);
    add_line(out, t, q->measured, measured, q->scale, "measured", &n);
    add_line(out, t, q->table, column, q->scale, "estimated", &n);
    add_line(out, t, q->sd, sd, q->scale, "sd", &n);
    mhi_text_add(out, "]}");
}

static void add_group(mhi_text *out, const view_tables *t, const quantity *q, int *n_groups) {
    const rows *r = shown(t, q->table);
    const size_t length = strlen(q->prefix);
    int n = 0;
    if (r == NULL) {
        return;
    }
    mhi_text_add(out, "%s{\"heading\":\"%s\",\"unit\":\"%s\",\"least\":%g,\"panels\":[",
                 (*n_groups)++ > 0 ? "," : "", q->heading, q->unit, q->least);
    for (int32_t i = 0; i < r->is.n_labels; i++) {
        if (strncmp(r->is.labels[i], q->prefix, length) == 0) {
            add_panel(out, t, q, r->is.labels[i] + length, i, &n);
        }
    }
    mhi_text_add(out, "]}");
}

void view_add_panels(mhi_text *out, const view_tables *t) {
    const quantity all[] = {
        {"Joint coordinates (of a slider, 1 deg is 17.5 mm)", t->q_prefix, "deg", VIEW_Q, -1,
         VIEW_TRUTH, VIEW_SD, "q_", "q_", MHI_DEGREES, 1},
        {"Activation against EMG", t->a_prefix, "of 1", VIEW_ACTIVATION, VIEW_EMG, VIEW_TRUTH,
         VIEW_SD, "a_", "a_", 1, 0.1},
        {"Muscle forces", "", "N", VIEW_FORCE, -1, VIEW_TRUTH, VIEW_SD, "F_", "force_", 1, 10},
        {"Distance of markers", "", "mm", VIEW_DISTANCE, -1, -1, -1, "", "", 1e3, 1},
        {"Solve time", "solve_", "ms", VIEW_QUALITY, -1, -1, -1, "", "", 1, 1}};
    int n = 0;
    mhi_text_add(out, "\"times\":[");
    for (int32_t i = 0; i < VIEW_TABLES; i++) {
        mhi_text_add(out, "%s", i > 0 ? "," : "");
        add_column(out, t, i, -1, 1);
    }
    mhi_text_add(out, "],\"groups\":[");
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        add_group(out, t, &all[i], &n);
    }
    mhi_text_add(out, "]");
}
