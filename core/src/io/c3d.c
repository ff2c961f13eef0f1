/* SPDX-License-Identifier: Apache-2.0 */
#include "io/c3d.h"

#include "io/c3d_layout.h"
#include "io/length_unit.h"
#include "io/slurp.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef mhi_c3d_layout layout;

static mhe_status fail(const mhi_c3d_file *file, const char *what) {
    return mhe_fail(file->err, MHE_E_INPUT, "%s: %s", file->name, what);
}

/* ---- tables ---- */

static mhe_status no_memory(const mhi_c3d_file *file) {
    return mhe_fail(file->err, MHE_E_MEMORY, "%s: out of memory", file->name);
}

static void warn(mhi_table *table, const char *text) {
    char **grown = realloc(table->warnings, sizeof *grown * (size_t)(table->n_warnings + 1));
    if (grown == NULL) {
        return;
    }
    table->warnings = grown;
    char line[MHE_ERROR_TEXT];
    (void)snprintf(line, sizeof line, "%.180s: %s", table->path, text);
    grown[table->n_warnings] = strdup(line);
    table->n_warnings += grown[table->n_warnings] != NULL;
}

static mhe_status read_labels(const mhi_c3d_file *file, const char *group, const char *substitute,
                              mhi_table *table) {
    int32_t n_equal = 0;
    mhe_status status =
        mhi_c3d_labels(file, group, substitute, table->labels, table->n_labels, &n_equal);
    if (n_equal > 0) {
        warn(table, "some labels are there twice; the later ones have their number behind them");
    }
    return status;
}

static mhe_status make_table(const mhi_c3d_file *file, const layout *l, int32_t n_labels,
                             int32_t width, int32_t per_frame, mhi_table **out) {
    const int64_t n_rows = (int64_t)l->n_frames * per_frame;
    *out = NULL;
    if (n_rows > INT32_MAX) {
        return fail(file, "holds more samples than can be counted");
    }
    mhi_table *t = calloc(1, sizeof *t);
    if (t == NULL) {
        return no_memory(file);
    }
    *out = t;
    t->n_rows = (int32_t)n_rows;
    t->n_columns = n_labels * width;
    t->n_labels = n_labels;
    t->rate = l->rate * per_frame;
    t->unit = 1;
    t->path = strdup(file->name);
    t->labels = calloc((size_t)n_labels, sizeof *t->labels);
    t->time = malloc(sizeof(double) * (size_t)n_rows);
    t->values = malloc(sizeof(double) * (size_t)n_rows * (size_t)t->n_columns);
    if (t->path == NULL || t->labels == NULL || t->time == NULL || t->values == NULL) {
        return no_memory(file);
    }
    for (int32_t k = 0; k < t->n_rows; k++) {
        t->time[k] = (l->first - 1) / l->rate + k / t->rate;
    }
    static const char what_holds[] = "POINT:SCALE contradicts the header's scale: %s of %g taken";
    char text[160];
    if (l->scales_differ) {
        (void)snprintf(text, sizeof text, what_holds, l->is_float ? "floats" : "integers",
                       l->scale);
        warn(t, text);
    }
    if (l->starts_differ) {
        (void)snprintf(
            text, sizeof text,
            "POINT:DATA_START contradicts the header: the data are read from byte %zu on",
            l->start);
        warn(t, text);
    }
    if (l->counts_differ) {
        warn(t, "ANALOG:USED contradicts the header, whose number of samples is taken");
    }
    if (l->by_size) {
        (void)snprintf(text, sizeof text,
                       "the header counts to 65535 frames only; by its size the file holds %d",
                       (int)l->n_frames);
        warn(t, text);
    }
    if (l->lost > 0) {
        (void)snprintf(text, sizeof text, "the file ends %lld frames too early; %d are there",
                       (long long)l->lost, (int)l->n_frames);
        warn(t, text);
    }
    return MHE_OK;
}

static double sample(const mhi_c3d_file *file, const layout *l, const uint8_t *at) {
    return l->is_float ? mhi_c3d_float(file, at) : mhi_c3d_int16(file, at);
}

static mhe_status take_unit(const mhi_c3d_file *file, mhi_table *t) {
    const mhi_c3d_parameter p = mhi_c3d_find(file, "POINT", "UNITS");
    char *text = mhi_c3d_text(&p, 0);
    if (text == NULL) {
        return no_memory(file);
    }
    mhi_length_unit unit = mhi_length_unit_of((mhi_cell){text, strlen(text)});
    if (unit.metres == 0) {
        char line[128];
        (void)snprintf(line, sizeof line, "POINT:UNITS is '%.20s', none of mm, cm, m; mm is taken",
                       text);
        warn(t, line);
        unit = (mhi_length_unit){"mm", 1e-3};
    }
    t->unit = unit.metres;
    memcpy(t->unit_name, unit.name, sizeof t->unit_name);
    free(text);
    return MHE_OK;
}

static mhe_status read_points(const mhi_c3d_file *file, const layout *l, mhi_table **out) {
    mhe_status status = make_table(file, l, l->n_points, 3, 1, out);
    if (status == MHE_OK) {
        status = read_labels(file, "POINT", "point", *out);
    }
    if (status != MHE_OK) {
        return status;
    }
    mhi_table *t = *out;
    status = take_unit(file, t);
    if (status != MHE_OK) {
        return status;
    }
    const double factor = (l->is_float ? 1 : l->scale) * t->unit;
    double *value = t->values;
    for (int32_t k = 0; k < l->n_frames; k++) {
        const uint8_t *at = file->data + l->start + (size_t)k * l->frame_bytes;
        for (int32_t i = 0; i < l->n_points; i++, at += 4 * l->word, value += 3) {
            for (size_t axis = 0; axis < 3; axis++) {
                value[axis] = factor * sample(file, l, at + axis * l->word);
            }
            const int nowhere = value[0] == 0 && value[1] == 0 && value[2] == 0;
            if (nowhere || !isfinite(value[0] + value[1] + value[2]) ||
                !(sample(file, l, at + 3 * l->word) >= 0)) {
                value[0] = value[1] = value[2] = NAN;
            }
        }
    }
    return MHE_OK;
}

/* Numbers of all channels; `fallback` where the file says nothing. */
static void of_channels(const mhi_c3d_file *file, const char *name, int32_t unsigned_,
                        double fallback, double *out, int32_t n) {
    int32_t i = 0, part = 0;
    mhi_c3d_parameter p;
    while (i < n && (p = mhi_c3d_part(file, "ANALOG", name, &part)).n > 0) {
        for (int32_t k = 0; k < p.n && i < n; k++) {
            out[i++] = mhi_c3d_number(file, &p, k, unsigned_, fallback);
        }
    }
    while (i < n) {
        out[i++] = fallback;
    }
}

static mhe_status read_analog(const mhi_c3d_file *file, const layout *l, mhi_table **out) {
    mhe_status status = make_table(file, l, l->n_channels, 1, l->per_frame, out);
    if (status == MHE_OK) {
        status = read_labels(file, "ANALOG", "analog", *out);
    }
    const size_t n = (size_t)l->n_channels;
    double *scale = malloc(sizeof(double) * 2 * n), *offset = scale == NULL ? NULL : scale + n;
    if (status == MHE_OK && scale == NULL) {
        status = no_memory(file);
    }
    if (status == MHE_OK) {
        const mhi_c3d_parameter p = mhi_c3d_find(file, "ANALOG", "FORMAT");
        char *format = mhi_c3d_text(&p, 0);
        if (format == NULL) {
            free(scale);
            return no_memory(file);
        }
        const int unsigned_ = strcmp(format, "UNSIGNED") == 0;
        free(format);
        const double general = mhi_c3d_find_number(file, "ANALOG", "GEN_SCALE", 1);
        of_channels(file, "SCALE", 0, 1, scale, l->n_channels);
        of_channels(file, "OFFSET", unsigned_, 0, offset, l->n_channels);
        double *value = (*out)->values;
        for (int32_t k = 0; k < (*out)->n_rows; k++) {
            const uint8_t *at =
                file->data + l->start + (size_t)(k / l->per_frame) * l->frame_bytes +
                l->word * (4 * (size_t)l->n_points + (size_t)(k % l->per_frame) * n);
            for (size_t c = 0; c < n; c++, at += l->word, value++) {
                const double raw =
                    unsigned_ && !l->is_float ? mhi_c3d_uint16(file, at) : sample(file, l, at);
                *value = (raw - offset[c]) * scale[c] * general;
                *value = isfinite(*value) ? *value : NAN;
            }
        }
    }
    free(scale);
    return status;
}

mhe_status mhi_c3d_parse(const char *name, const char *data, size_t length, mhi_table **points,
                         mhi_table **analog, mhe_error *err) {
    mhi_c3d_file file = {.name = name, .data = (const uint8_t *)data, .length = length, .err = err};
    mhi_table *tables[2] = {NULL, NULL};
    layout l;
    mhe_status status = mhi_c3d_open(&file);
    if (status == MHE_OK) {
        status = mhi_c3d_read_layout(&file, &l);
    }
    if (status == MHE_OK && points != NULL && l.n_points > 0) {
        status = read_points(&file, &l, &tables[0]);
    }
    if (status == MHE_OK && analog != NULL && l.n_channels > 0) {
        status = read_analog(&file, &l, &tables[1]);
    }
    mhi_table **out[2] = {points, analog};
    for (int32_t i = 0; i < 2; i++) {
        if (status != MHE_OK) {
            mhi_table_free(tables[i]);
            tables[i] = NULL;
        }
        if (out[i] != NULL) {
            *out[i] = tables[i];
        }
    }
    return status;
}

mhe_status mhi_c3d_read(const char *path, mhi_table **points, mhi_table **analog, mhe_error *err) {
    char *data = NULL;
    size_t length = 0;
    if (points != NULL) {
        *points = NULL;
    }
    if (analog != NULL) {
        *analog = NULL;
    }
    mhe_status status = mhi_slurp(path, &data, &length, err);
    if (status == MHE_OK) {
        status = mhi_c3d_parse(path, data, length, points, analog, err);
    }
    free(data);
    return status;
}
