/* SPDX-License-Identifier: Apache-2.0 */
#include "report.h"

#include "base/pi.h"
#include "escape.h"
#include "rows.h"

#include <errno.h>
#include <math.h>
#include <mhe/outbox.h>
#include <string.h>

#define WIDTH 300.0
#define HEIGHT 120.0
#define POINTS 600   /* of a line; more would not be seen */
#define PRINTED 1e-4 /* of the smallest axis: less is printed as 0 */

static double value_at(const rows *t, int32_t row, int32_t column, double scale) {
    return scale * t->is.values[(ptrdiff_t)row * t->is.n_columns + column];
}

static void widen(const rows *t, int32_t column, double scale, double range[2]) {
    for (int32_t k = 0; t != NULL && column >= 0 && k < t->is.n_rows; k++) {
        range[0] = fmin(range[0], value_at(t, k, column, scale)); /* of a number and NaN: it */
        range[1] = fmax(range[1], value_at(t, k, column, scale));
    }
}

/* A line through the rows of a column within the time of `frame`; missing values break it. */
static void add_line(mhi_text *out, const rows *t, int32_t column, double scale,
                     const double range[2], const rows *frame, const char *style) {
    const int32_t step = t->is.n_rows / POINTS + 1;
    const double begin = frame->is.time[0];
    const double span = frame->is.time[frame->is.n_rows - 1] - begin;
    int open = 0;
    mhi_text_add(out, "<path class=\"%s\" d=\"", style);
    for (int32_t k = 0; k < t->is.n_rows; k += step) {
        const double y = value_at(t, k, column, scale);
        if (isnan(y) || t->is.time[k] < begin || t->is.time[k] > begin + span) {
            open = 0;
            continue;
        }
        mhi_text_add(out, "%c%.1f %.1f", open ? 'L' : 'M',
                     span > 0 ? WIDTH * (t->is.time[k] - begin) / span : 0,
                     HEIGHT * (range[1] - y) / (range[1] - range[0]));
        open = 1;
    }
    mhi_text_add(out, "\"/>");
}

#define NOMINAL_95 1.96 /* standard deviations on both sides */

/* The band of a column about the estimate, in both directions one line; rows are those of the
 * estimates. */
static void add_band(mhi_text *out, const rows *t, int32_t column, const rows *sd,
                     int32_t sd_column, double scale, const double range[2]) {
    const int32_t step = t->is.n_rows / POINTS + 1, n = (t->is.n_rows - 1) / step + 1;
    const double begin = t->is.time[0], span = t->is.time[t->is.n_rows - 1] - begin;
    int open = 0;
    mhi_text_add(out, "<path class=\"band\" d=\"");
    for (int32_t i = 0; i < 2 * n; i++) {
        const int32_t k = step * (i < n ? i : 2 * n - 1 - i);
        const double half = NOMINAL_95 * value_at(sd, k, sd_column, scale);
        const double y = value_at(t, k, column, scale) + (i < n ? half : -half);
        if (isfinite(y)) {
            mhi_text_add(out, "%c%.1f %.1f", open ? 'L' : 'M',
                         span > 0 ? WIDTH * (t->is.time[k] - begin) / span : 0,
                         HEIGHT * (range[1] - y) / (range[1] - range[0]));
            open = 1;
        }
    }
    mhi_text_add(out, "%s\"/>", open ? "Z" : "");
}

/* The range of a picture holds the band, too. */
static void widen_by_band(const rows *t, int32_t column, const rows *sd, int32_t sd_column,
                          double scale, double range[2]) {
    for (int32_t k = 0; k < t->is.n_rows; k++) {
        const double half = NOMINAL_95 * value_at(sd, k, sd_column, scale);
        range[0] = fmin(range[0], value_at(t, k, column, scale) - half);
        range[1] = fmax(range[1], value_at(t, k, column, scale) + half);
    }
}

/* A row of pictures: what is drawn, against what; least: the axis spans at least that much. */
typedef struct quantity {
    const char *heading, *prefix, *unit;
    const rows *table, *measured, *truth; /* of the last two NULL: none */
    const char *truth_prefix;
    double scale, least;
    const rows *sd; /* NULL: none */
    const char *sd_prefix;
} quantity;

/* As it is printed: what is nothing beside the smallest axis is 0, not 2e-47. */
static double printed(const quantity *q, double value) {
    return fabs(value) < PRINTED * q->least ? 0 : value;
}

/* One small picture: a column, what was measured of it and what is true, where these are known. */
static void add_panel(mhi_text *out, const quantity *q, const char *name, int32_t column) {
    const rows *t = q->table, *other = q->measured;
    const int32_t other_column = other == NULL ? -1 : mhe_table_find(other->table, name);
    const double scale = q->scale;
    char label[256];
    (void)snprintf(label, sizeof label, "%s%s", q->truth_prefix, name);
    const int32_t truth = q->truth == NULL ? -1 : mhe_table_find(q->truth->table, label);
    (void)snprintf(label, sizeof label, "%s%s", q->sd_prefix, name);
    int32_t sd = q->sd == NULL ? -1 : mhe_table_find(q->sd->table, label);
    sd = sd >= 0 && q->sd->is.n_rows == t->is.n_rows ? sd : -1;
    double range[2] = {INFINITY, -INFINITY};
    widen(t, column, scale, range);
    widen(other, other_column, scale, range);
    widen(q->truth, truth, scale, range);
    if (!(range[0] <= range[1])) {
        return;
    }
    mhi_text_add(out, "<figure><figcaption>");
    add_escaped(out, name);
    mhi_text_add(out,
                 " <small>%.3g to %.3g %s</small></figcaption><svg viewBox=\"0 -2 %g %g\" "
                 "role=\"img\">",
                 printed(q, range[0]), printed(q, range[1]), q->unit, WIDTH, HEIGHT + 4);
    if (sd >= 0) { /* the axis alone, too */
        widen_by_band(t, column, q->sd, sd, scale, range);
    }
    if (range[1] - range[0] < q->least) { /* the axis alone: small changes stay small */
        const double middle = 0.5 * (range[0] + range[1]);
        const int grounded = range[0] >= 0 && middle < 0.5 * q->least;
        range[0] = grounded ? 0 : middle - 0.5 * q->least;
        range[1] = range[0] + q->least;
    }
    if (sd >= 0) {
        add_band(out, t, column, q->sd, sd, scale, range);
    }
    if (truth >= 0) {
        add_line(out, q->truth, truth, scale, range, t, "true");
    }
    if (other != NULL && other_column >= 0) {
        add_line(out, other, other_column, scale, range, t, "measured");
    }
    add_line(out, t, column, scale, range, t, "estimated");
    mhi_text_add(out, "</svg></figure>\n");
}

static void add_all(mhi_text *out, const quantity *q) {
    const rows *t = q->table;
    const size_t length = strlen(q->prefix);
    if (t == NULL) {
        return;
    }
    mhi_text_add(out, "<h2>%s</h2>\n<div>\n", q->heading);
    for (int32_t i = 0; i < t->is.n_labels; i++) {
        if (strncmp(t->is.labels[i], q->prefix, length) == 0) {
            add_panel(out, q, t->is.labels[i] + length, i);
        }
    }
    mhi_text_add(out, "</div>\n");
}

static const char head[] =
    "<!DOCTYPE html>\n<html lang=\"en\"><meta charset=\"utf-8\">\n"
    "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><style>\n"
    "body{font:15px/1.4 sans-serif;max-width:1000px;margin:2em auto;padding:0 1em}\n"
    "div{display:grid;grid-template-columns:repeat(auto-fill,minmax(230px,1fr));gap:10px}\n"
    "figure{margin:0}figcaption{overflow-wrap:anywhere}small{color:#666}\n"
    "svg{width:100%;background:#f6f6f6}path{fill:none;stroke-width:1.5}\n"
    ".estimated{stroke:#1f5fa8}.measured{stroke:#d9822b}.true{stroke:#999;stroke-width:3}\n"
    ".band{fill:#1f5fa8;fill-opacity:.18;stroke:none}\n"
    ".verdict{padding:.4em .6em;font-weight:bold;background:#eee;border-left:6px solid #999}\n"
    ".yes{border-color:#2a8a43}.doubtful{border-color:#d9a400}.no{border-color:#c0392b}\n"
    "pre{white-space:pre-wrap;overflow-wrap:anywhere}\n"
    "@media(max-width:600px){body{margin:1em auto}\n"
    "div{grid-template-columns:repeat(auto-fill,minmax(150px,1fr))}h1{font-size:1.4em}}\n"
    "</style>\n";

/* NULL where it could not be read. */
static const rows *shown(const rows *r) {
    return r->table == NULL ? NULL : r;
}

/* The first line, where it is "usable: WORD", as one that is not overlooked; what follows it. */
static const char *add_verdict(mhi_text *out, const char *summary) {
    static const char *const words[] = {"yes", "doubtful", "no"};
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        char line[32];
        const size_t n = (size_t)snprintf(line, sizeof line, "usable: %s\n", words[i]);
        if (strncmp(summary, line, n) == 0) {
            mhi_text_add(out, "<p class=\"verdict %s\">usable: %s</p>\n", words[i], words[i]);
            return summary + n;
        }
    }
    return summary;
}

static void compose(mhi_text *out, const char *name, const char *summary, const rows *tables) {
    mhi_text_add(out, "%s<title>", head);
    add_escaped(out, name);
    mhi_text_add(out, "</title>\n<h1>");
    add_escaped(out, name);
    mhi_text_add(out, "</h1>\n");
    summary = add_verdict(out, summary);
    mhi_text_add(out, "<pre>");
    add_escaped(out, summary);
    mhi_text_add(
        out,
        "</pre>\n<p>Blue: estimated%s. Orange: measured.%s Time from %.4g to %.4g s. Least "
        "and largest value stand above each picture.</p>\n",
        tables[6].table != NULL ? ", with its nominal 95 % band" : "",
        tables[5].table != NULL ? " Grey: the known truth." : "", tables[0].is.time[0],
        tables[0].is.time[tables[0].is.n_rows - 1]);
    const rows *truth = shown(&tables[5]), *states = shown(&tables[0]);
    const rows *sd = shown(&tables[6]);
    const quantity all[] = {
        {"Joint coordinates (of a slider, 1 deg is 17.5 mm)", "q_", "deg", states, NULL, truth,
         "q_", MHI_DEGREES, 1, sd, "q_"},
        {"Activation against EMG", "a_", "of 1", states, shown(&tables[3]), truth, "a_", 1, 0.1, sd,
         "a_"},
        {"Muscle forces", "", "N", shown(&tables[1]), NULL, truth, "F_", 1, 10, sd, "force_"},
        {"Distance of markers", "", "mm", shown(&tables[2]), NULL, NULL, "", 1e3, 1, NULL, ""},
        {"Solve time", "solve_", "ms", shown(&tables[4]), NULL, NULL, "", 1, 1, NULL, ""}};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        add_all(out, &all[i]);
    }
}

mhe_status report_write(const char *dir, const char *name, const char *summary,
                        const char *reference, int with_bands, mhe_error *err) {
    static const char *const files[] = {"estimates.sto", "forces.sto", "marker_residuals.sto",
                                        "emg.sto", "quality.sto"};
    rows tables[7] = {{0}}; /* the last: the known truth, standard deviations */
    mhi_text page = {0};
    mhe_outbox *outbox = NULL;
    mhe_status status = rows_read_in(dir, files[0], &tables[0], err);
    for (int i = 1; i < 5 && status == MHE_OK; i++) {
        /* without muscles or markers a table has no columns and cannot be read */
        (void)rows_read_in(dir, files[i], &tables[i], NULL);
    }
    if (status == MHE_OK && reference != NULL) {
        (void)rows_read(reference, &tables[5], NULL);
    }
    if (status == MHE_OK && with_bands) {
        (void)rows_read_in(dir, "uncertainty.sto", &tables[6], NULL);
    }
    if (status == MHE_OK) {
        compose(&page, name, summary, tables);
        status = page.failed ? mhe_fail(err, MHE_E_MEMORY, "out of memory")
                             : mhe_outbox_open(dir, &outbox, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_text(outbox, "report.html", page.data, err);
    }
    if (status == MHE_OK) {
        status = mhe_outbox_commit(outbox, err);
    }
    mhe_outbox_close(outbox);
    mhi_text_free(&page);
    for (int i = 0; i < 7; i++) {
        rows_close(&tables[i]);
    }
    return status;
}
