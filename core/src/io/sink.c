/* SPDX-License-Identifier: Apache-2.0 */
/* Rows of .sto and .trc. The number of rows stands in the header but is known last: the header is
 * written again at the end, made as long as the first time by blanks behind its first, free line.
 */
#include <mhe/outbox.h>

#include "base/need.h"
#include "base/number.h"
#include "base/text.h"
#include "io/outbox.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

struct mhe_sink {
    mhi_outbox_file *file;
    char *first_line;
    mhi_text header[3]; /* its further text; the number of rows stands between the parts */
    int32_t n_counts;   /* how often: parts - 1 */
    int32_t is_trc, is_csv;
    int32_t n_rows, n_columns;
    double unit; /* metres per unit written */
};

#define COUNT_DIGITS 10 /* of INT32_MAX */

static mhe_status write_header(const mhe_sink *sink, mhe_error *err) {
    char count[16];
    int32_t digits = snprintf(count, sizeof count, "%d", sink->n_rows);
    int32_t pad = sink->n_counts * (COUNT_DIGITS - digits);
    FILE *out = sink->file->stream;
    const char *head = sink->header[0].data == NULL ? "" : sink->header[0].data;
    int failed = fprintf(out, "%s%*s\n%s", sink->first_line, pad, "", head) < 0;
    for (int32_t i = 0; i < sink->n_counts && !failed; i++) {
        failed = fprintf(out, "%s%s", count, sink->header[i + 1].data) < 0;
    }
    return failed ? mhi_outbox_write_failed(sink->file, err) : MHE_OK;
}

static mhe_status complete(mhi_outbox_file *file, mhe_error *err) {
    const mhe_sink *sink = file->owner;
    if (fseek(file->stream, 0, SEEK_SET) != 0) {
        return mhi_outbox_write_failed(file, err);
    }
    return write_header(sink, err);
}

static void free_sink(mhe_sink *sink) {
    for (int32_t i = 0; i < 3; i++) {
        mhi_text_free(&sink->header[i]);
    }
    free(sink->first_line);
    free(sink);
}

static void release(mhi_outbox_file *file) {
    free_sink(file->owner);
}

/* Puts a sink whose header is ready into the outbox, or frees it. */
static mhe_status open_sink(mhe_outbox *outbox, const char *name, mhe_sink *made, mhe_sink **sink,
                            mhe_error *err) {
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i <= made->n_counts; i++) {
        if (made->header[i].failed || made->first_line == NULL) {
            status = mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
        }
    }
    if (status == MHE_OK) {
        status = mhi_outbox_add(outbox, name, &made->file, err);
    }
    if (status != MHE_OK) {
        free_sink(made);
        return status;
    }
    made->file->owner = made;
    made->file->complete = complete;
    made->file->release = release;
    status = write_header(made, err);
    *sink = status == MHE_OK ? made : NULL;
    return status;
}

static mhe_sink *new_sink(int32_t n_columns, int32_t n_counts) {
    mhe_sink *made = calloc(1, sizeof *made);
    if (made != NULL) {
        made->n_columns = n_columns;
        made->n_counts = n_counts;
        made->unit = 1;
    }
    return made;
}

mhe_status mhe_sink_sto(mhe_outbox *outbox, const char *name, const char *title,
                        const char *const *labels, int32_t n_columns, mhe_sink **sink,
                        mhe_error *err) {
    mhe_status needed = MHI_NEED(err, {"outbox", outbox}, {"name", name}, {"title", title},
                                 {"labels", labels}, {"sink", sink});
    if (needed != MHE_OK) {
        return needed;
    }
    *sink = NULL;
    mhe_sink *made = new_sink(n_columns, 1);
    if (made == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
    }
    made->first_line = strdup(title);
    mhi_text_add(&made->header[0], "version=1\nnRows=");
    mhi_text_add(&made->header[1], "\nnColumns=%d\ninDegrees=no\nendheader\ntime", n_columns + 1);
    for (int32_t i = 0; i < n_columns; i++) {
        mhi_text_add(&made->header[1], "\t%s", labels[i]);
    }
    mhi_text_add(&made->header[1], "\n");
    return open_sink(outbox, name, made, sink, err);
}

mhe_status mhe_sink_trc(mhe_outbox *outbox, const char *name, const char *const *markers,
                        int32_t n_markers, double rate, double unit, const char *unit_name,
                        mhe_sink **sink, mhe_error *err) {
    mhe_status needed = MHI_NEED(err, {"outbox", outbox}, {"name", name}, {"markers", markers},
                                 {"unit_name", unit_name}, {"sink", sink});
    if (needed != MHE_OK) {
        return needed;
    }
    *sink = NULL;
    mhe_sink *made = new_sink(3 * n_markers, 2);
    if (made == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
    }
    mhi_c_locale locale = mhi_c_locale_begin();
    mhi_text line = {0};
    mhi_text_add(&line, "PathFileType\t4\t(X/Y/Z)\t%s", name);
    made->first_line = line.data;
    made->is_trc = 1;
    made->unit = unit;
    mhi_text_add(&made->header[0],
                 "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\t"
                 "OrigDataStartFrame\tOrigNumFrames\n%.10g\t%.10g\t",
                 rate, rate);
    mhi_text_add(&made->header[1], "\t%d\t%s\t%.10g\t1\t", n_markers, unit_name, rate);
    mhi_text *rest = &made->header[2];
    mhi_text_add(rest, "\nFrame#\tTime");
    for (int32_t i = 0; i < n_markers; i++) {
        mhi_text_add(rest, "\t%s%s", markers[i], i + 1 < n_markers ? "\t\t" : "");
    }
    mhi_text_add(rest, "\n\t");
    for (int32_t i = 1; i <= n_markers; i++) {
        mhi_text_add(rest, "\tX%d\tY%d\tZ%d", i, i, i);
    }
    mhi_text_add(rest, "\n\n");
    mhi_c_locale_end(locale);
    return open_sink(outbox, name, made, sink, err);
}

/* A label in quotes where it holds what would end it. */
static void add_csv_label(mhi_text *line, const char *label) {
    if (strpbrk(label, ",\"\n\r") == NULL) {
        mhi_text_add(line, ",%s", label);
        return;
    }
    mhi_text_add(line, ",\"");
    for (; *label != '\0'; label++) {
        mhi_text_add(line, *label == '"' ? "\"\"" : "%c", *label);
    }
    mhi_text_add(line, "\"");
}

mhe_status mhe_sink_csv(mhe_outbox *outbox, const char *name, const char *const *labels,
                        int32_t n_columns, mhe_sink **sink, mhe_error *err) {
    mhe_status needed =
        MHI_NEED(err, {"outbox", outbox}, {"name", name}, {"labels", labels}, {"sink", sink});
    if (needed != MHE_OK) {
        return needed;
    }
    *sink = NULL;
    mhe_sink *made = new_sink(n_columns, 0);
    if (made == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
    }
    mhi_text line = {0};
    mhi_text_add(&line, "time");
    for (int32_t i = 0; i < n_columns; i++) {
        add_csv_label(&line, labels[i]);
    }
    made->header[0].failed = line.failed;
    made->first_line = line.data;
    made->is_csv = 1;
    return open_sink(outbox, name, made, sink, err);
}

mhe_status mhe_sink_row(mhe_sink *sink, double time, const double *values, mhe_error *err) {
    mhe_status needed = MHI_NEED(err, {"sink", sink}, {"values", values});
    if (needed != MHE_OK) {
        return needed;
    }
    FILE *out = sink->file->stream;
    mhi_c_locale locale = mhi_c_locale_begin();
    int failed = sink->is_trc ? fprintf(out, "%d\t%.10g", sink->n_rows + 1, time) < 0
                              : fprintf(out, "%.10g", time) < 0;
    const char separator = sink->is_csv ? ',' : '\t';
    const char *missing = sink->is_trc ? "" : sink->is_csv ? "NaN" : "nan";
    for (int32_t i = 0; i < sink->n_columns && !failed; i++) {
        failed = isnan(values[i]) ? fprintf(out, "%c%s", separator, missing) < 0
                                  : fprintf(out, "%c%.12g", separator, values[i] / sink->unit) < 0;
    }
    failed = failed || fputc('\n', out) == EOF || ferror(out);
    mhi_c_locale_end(locale);
    if (failed) {
        return mhi_outbox_write_failed(sink->file, err);
    }
    sink->n_rows++;
    return MHE_OK;
}
