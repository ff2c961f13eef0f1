/* SPDX-License-Identifier: Apache-2.0 */
/* xdf_table.c: streams of an .xdf file as tables of markers and of analog channels. */
#include "io/xdf.h"

#include "io/length_unit.h"
#include "io/slurp.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Channels of one marker: x, y, z. */
typedef struct marker {
    const char *name;
    size_t length;
    int32_t channel[3]; /* -1: none */
} marker;

static mhe_status no_memory(const mhi_xdf *xdf, mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", xdf->path);
}

/* Axis 0..2 of a channel that is a position, else -1; its marker's name. Types are PositionX ..
 * (the community's description of motion capture); else labels end in .X, _X, -X or blank X. */
static int32_t position_axis(const mhi_xdf_channel *c, const char **name, size_t *length) {
    const size_t n = strlen(c->label);
    const char last = n > 1 ? c->label[n - 1] : '\0';
    const int32_t by_label = n > 2 && strchr("._- :", c->label[n - 2]) != NULL
                                 ? (int32_t)(strcspn("XYZxyz", (char[2]){last, '\0'}))
                                 : 6;
    int32_t axis = by_label < 6 ? by_label % 3 : -1;
    if (strncasecmp(c->type, "Position", 8) == 0 && strlen(c->type) == 9) {
        axis = (int32_t)strcspn("XYZ", (char[2]){c->type[8], '\0'});
        axis = axis < 3 ? axis : -1;
    } else if (c->type[0] != '\0' && strncasecmp(c->type, "Position", 8) != 0) {
        return -1; /* something else, as a confidence or an orientation */
    }
    if (c->marker[0] != '\0') {
        *name = c->marker;
        *length = strlen(c->marker);
    } else {
        *name = c->label;
        *length = by_label < 6 ? n - 2 : n;
    }
    return axis;
}

static int32_t find_markers(const mhi_xdf_stream *s, marker *out) {
    int32_t n = 0;
    for (int32_t i = 0; i < s->n_channels; i++) {
        const char *name;
        size_t length;
        const int32_t axis = position_axis(&s->channels[i], &name, &length);
        int32_t k = axis < 0 ? n : 0;
        while (k < n && (out[k].length != length || memcmp(out[k].name, name, length) != 0)) {
            k++;
        }
        if (axis < 0) {
            continue;
        }
        if (k == n) {
            out[n++] = (marker){name, length, {-1, -1, -1}};
        }
        out[k].channel[axis] = i;
    }
    int32_t whole = 0; /* those with all three */
    for (int32_t k = 0; k < n; k++) {
        if (out[k].channel[0] >= 0 && out[k].channel[1] >= 0 && out[k].channel[2] >= 0) {
            out[whole++] = out[k];
        }
    }
    return whole;
}

/* Without a word for it, metres, as the format's community has it. */
static double metres(const char *unit) {
    const mhi_length_unit known = mhi_length_unit_of((mhi_cell){unit, strlen(unit)});
    return known.metres > 0 ? known.metres : 1;
}

/* Samples whose time does not come after the last one's are left out: returns how many. */
static int64_t count_rows(const mhi_xdf_stream *s) {
    int64_t n = 0;
    double last = -INFINITY;
    for (int64_t k = 0; k < s->n_samples; k++) {
        n += s->time[k] > last;
        last = fmax(last, s->time[k]);
    }
    return n;
}

static mhe_status make_table(mhi_xdf *xdf, const mhi_xdf_stream *s, int32_t n_labels, int32_t width,
                             double start, mhi_table **out, mhe_error *err) {
    const int64_t n_rows = count_rows(s);
    mhi_table *t = calloc(1, sizeof *t);
    *out = t;
    if (t == NULL) {
        return no_memory(xdf, err);
    }
    if (n_rows < 1 || n_rows > INT32_MAX) {
        return mhe_fail(err, MHE_E_INPUT, "%s: stream '%s' has no samples, or too many to count",
                        xdf->path, s->name);
    }
    if (n_rows < s->n_samples) {
        char text[256];
        (void)snprintf(text, sizeof text,
                       "stream '%.80s': %lld samples whose times step back are left out", s->name,
                       (long long)(s->n_samples - n_rows));
        mhi_xdf_warn(xdf, text);
    }
    t->n_rows = (int32_t)n_rows;
    t->n_labels = n_labels;
    t->n_columns = n_labels * width;
    t->unit = 1;
    t->path = strdup(xdf->path);
    t->labels = calloc((size_t)n_labels + 1, sizeof *t->labels);
    t->time = malloc(sizeof(double) * (size_t)n_rows);
    t->values = malloc(sizeof(double) * ((size_t)n_rows * (size_t)t->n_columns + 1));
    if (t->path == NULL || t->labels == NULL || t->time == NULL || t->values == NULL) {
        return no_memory(xdf, err);
    }
    int32_t row = 0;
    for (int64_t k = 0; k < s->n_samples; k++) {
        if (row == 0 || s->time[k] - start > t->time[row - 1]) {
            t->time[row++] = s->time[k] - start;
        }
    }
    t->n_rows = row; /* a start far away may round two times to one */
    const double span = t->time[row - 1] - t->time[0];
    t->rate = s->rate > 0 ? s->rate : span > 1e-9 ? (row - 1) / span : 0;
    return MHE_OK;
}

static int is_taken(const mhi_table *t, int32_t n, const char *label) {
    for (int32_t k = 0; k < n; k++) {
        if (strcmp(t->labels[k], label) == 0) {
            return 1;
        }
    }
    return 0;
}

#define MOST_LABEL 512

/* Label i of a table: the text, or `substitute` and its number where there is none; with its number
 * behind it where it is there already. NULL: no memory. */
static char *unique_label(const mhi_table *t, int32_t i, const char *text, size_t length,
                          const char *substitute) {
    char label[MOST_LABEL + 32];
    if (length == 0) {
        (void)snprintf(label, sizeof label, "%s_%d", substitute, (int)i + 1);
    } else {
        const size_t kept = length < MOST_LABEL / 2 ? length : MOST_LABEL / 2;
        memcpy(label, text, kept);
        label[kept] = '\0';
    }
    while (is_taken(t, i, label) && strlen(label) < MOST_LABEL) {
        const size_t end = strlen(label);
        (void)snprintf(label + end, sizeof label - end, "_%d", (int)i + 1);
    }
    return strdup(label);
}

static mhe_status fill_markers(mhi_xdf *xdf, const mhi_xdf_stream *s, const marker *markers,
                               int32_t n, double start, mhi_table **out, mhe_error *err) {
    mhe_status status = make_table(xdf, s, n, 3, start, out, err);
    if (status != MHE_OK) {
        return status;
    }
    mhi_table *t = *out;
    t->unit = metres(s->channels[markers[0].channel[0]].unit);
    const char *name = t->unit == 1e-3 ? "mm" : t->unit == 1e-2 ? "cm" : "m";
    memcpy(t->unit_name, name, strlen(name) + 1);
    for (int32_t i = 0; i < n; i++) {
        t->labels[i] = unique_label(t, i, markers[i].name, markers[i].length, "point");
        if (t->labels[i] == NULL) {
            return no_memory(xdf, err);
        }
    }
    int32_t row = 0;
    for (int64_t k = 0; k < s->n_samples && row < t->n_rows; k++) {
        if (s->time[k] - start != t->time[row]) {
            continue;
        }
        for (int32_t i = 0; i < n; i++) {
            double *p = t->values + ((ptrdiff_t)row * n + i) * 3;
            for (int32_t axis = 0; axis < 3; axis++) {
                p[axis] = t->unit * s->values[k * s->n_channels + markers[i].channel[axis]];
            }
            const int nowhere = p[0] == 0 && p[1] == 0 && p[2] == 0;
            if (nowhere || !isfinite(p[0] + p[1] + p[2])) {
                p[0] = p[1] = p[2] = NAN;
            }
        }
        row++;
    }
    return MHE_OK;
}

static mhe_status fill_analog(mhi_xdf *xdf, const mhi_xdf_stream *s, double start, mhi_table **out,
                              mhe_error *err) {
    mhe_status status = make_table(xdf, s, s->n_channels, 1, start, out, err);
    mhi_table *t = *out;
    for (int32_t i = 0; i < s->n_channels && status == MHE_OK; i++) {
        const char *text = s->channels[i].label;
        t->labels[i] = unique_label(t, i, text, strlen(text), "analog");
        status = t->labels[i] == NULL ? no_memory(xdf, err) : MHE_OK;
    }
    int32_t row = 0;
    for (int64_t k = 0; k < s->n_samples && status == MHE_OK && row < t->n_rows; k++) {
        if (s->time[k] - start != t->time[row]) {
            continue;
        }
        for (int32_t i = 0; i < s->n_channels; i++) {
            const double value = s->values[k * s->n_channels + i];
            t->values[(ptrdiff_t)row * s->n_channels + i] = isfinite(value) ? value : NAN;
        }
        row++;
    }
    return status;
}

/* How well a stream serves: 0 not at all. */
typedef int32_t (*fitness)(const mhi_xdf_stream *s, int32_t n_markers);

static int32_t fits_markers(const mhi_xdf_stream *s, int32_t n_markers) {
    return n_markers == 0 ? 0 : strcasecmp(s->type, "MoCap") == 0 ? 2 : 1;
}

static int32_t fits_analog(const mhi_xdf_stream *s, int32_t n_markers) {
    return strcasecmp(s->type, "EMG") == 0 ? 2 : n_markers == 0 ? 1 : 0;
}

static int32_t choose(mhi_xdf *xdf, const int32_t *n_markers, fitness fits, const char *what) {
    int32_t best = -1, best_fit = 0;
    char text[MHE_ERROR_TEXT];
    for (int32_t i = 0; i < xdf->n_streams; i++) {
        const mhi_xdf_stream *s = &xdf->streams[i];
        if (s->format == MHI_XDF_STRING || s->n_samples == 0 || s->n_channels == 0) {
            continue;
        }
        const int32_t fit = fits(s, n_markers[i]);
        const int better = fit > best_fit || (fit > 0 && fit == best_fit &&
                                              s->n_samples > xdf->streams[best].n_samples);
        const int32_t other = better ? best : fit > 0 && fit == best_fit ? i : -1;
        if (other >= 0 && best_fit <= fit) {
            (void)snprintf(text, sizeof text, "stream '%.80s' could be %s too; '%.80s' is taken",
                           xdf->streams[other].name, what,
                           better ? s->name : xdf->streams[best].name);
            mhi_xdf_warn(xdf, text);
        }
        best = better ? i : best;
        best_fit = better ? fit : best_fit;
    }
    return best;
}

static double earliest(const mhi_xdf *xdf) {
    double start = INFINITY;
    for (int32_t i = 0; i < xdf->n_streams; i++) {
        for (int64_t k = 0; k < xdf->streams[i].n_samples; k++) {
            start = fmin(start, xdf->streams[i].time[k]);
        }
    }
    return start;
}

/* The file's warnings go with the first table. */
static void hand_over_warnings(mhi_xdf *xdf, mhi_table *t) {
    if (t != NULL) {
        t->warnings = xdf->warnings;
        t->n_warnings = xdf->n_warnings;
        xdf->warnings = NULL;
        xdf->n_warnings = 0;
    }
}

static mhe_status make_tables(mhi_xdf *xdf, mhi_table **points, mhi_table **analog,
                              mhe_error *err) {
    const double start = earliest(xdf);
    int32_t widest = 0;
    for (int32_t i = 0; i < xdf->n_streams; i++) {
        widest = xdf->streams[i].n_channels > widest ? xdf->streams[i].n_channels : widest;
    }
    marker *markers = calloc((size_t)widest + 1, sizeof *markers);
    int32_t *n_markers = calloc((size_t)xdf->n_streams + 1, sizeof *n_markers);
    mhe_status status = markers == NULL || n_markers == NULL ? no_memory(xdf, err) : MHE_OK;
    for (int32_t i = 0; i < xdf->n_streams && status == MHE_OK; i++) {
        n_markers[i] = find_markers(&xdf->streams[i], markers);
    }
    if (status == MHE_OK && points != NULL) {
        const int32_t i = choose(xdf, n_markers, fits_markers, "the markers");
        if (i >= 0) {
            const int32_t n = find_markers(&xdf->streams[i], markers);
            status = fill_markers(xdf, &xdf->streams[i], markers, n, start, points, err);
        }
    }
    if (status == MHE_OK && analog != NULL) {
        const int32_t i = choose(xdf, n_markers, fits_analog, "the EMG");
        if (i >= 0) {
            status = fill_analog(xdf, &xdf->streams[i], start, analog, err);
        }
    }
    free(markers);
    free(n_markers);
    return status;
}

mhe_status mhi_xdf_tables_parse(const char *name, const char *data, size_t length,
                                mhi_table **markers, mhi_table **analog, mhe_error *err) {
    mhi_xdf *xdf = NULL;
    mhi_table *tables[2] = {NULL, NULL};
    mhe_status status = mhi_xdf_parse(name, data, length, &xdf, err);
    if (status == MHE_OK) {
        status = make_tables(xdf, markers == NULL ? NULL : &tables[0],
                             analog == NULL ? NULL : &tables[1], err);
    }
    if (status == MHE_OK) {
        hand_over_warnings(xdf, tables[0] != NULL ? tables[0] : tables[1]);
    }
    mhi_table **out[2] = {markers, analog};
    for (int32_t i = 0; i < 2; i++) {
        if (status != MHE_OK) {
            mhi_table_free(tables[i]);
            tables[i] = NULL;
        }
        if (out[i] != NULL) {
            *out[i] = tables[i];
        }
    }
    mhi_xdf_free(xdf);
    return status;
}

mhe_status mhi_xdf_tables(const char *path, mhi_table **markers, mhi_table **analog,
                          mhe_error *err) {
    char *data = NULL;
    size_t length = 0;
    if (markers != NULL) {
        *markers = NULL;
    }
    if (analog != NULL) {
        *analog = NULL;
    }
    mhe_status status = mhi_slurp(path, &data, &length, err);
    if (status == MHE_OK) {
        status = mhi_xdf_tables_parse(path, data, length, markers, analog, err);
    }
    free(data);
    return status;
}
