/* SPDX-License-Identifier: Apache-2.0 */
/* recording_table.c: what the recording's files have in common: times, and columns by name. */
#include "estimator/recording_private.h"

#include "base/text.h"
#include "base/values.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

const char **mhi_recording_names(const mhe_description *d, int kind, int32_t n) {
    const char **names = calloc((size_t)n + 1, sizeof *names);
    for (int32_t i = 0; i < n && names != NULL; i++) {
        names[i] = kind == 'q'   ? d->coordinates[i].name
                   : kind == 'm' ? d->muscles[i].name
                                 : d->markers[i].name;
    }
    return names;
}

mhe_status mhi_recording_columns(const mhi_recording *r, const mhi_table *table,
                                 const mhi_naming *naming, const char *const *names, int32_t n,
                                 int32_t width, int32_t rows, double **out, int32_t *n_found,
                                 const mhe_host *host, mhe_error *err) {
    const int32_t n_labels = table->n_columns / width;
    int32_t *column = calloc((size_t)n + 1, sizeof *column);
    uint8_t *used = calloc((size_t)table->n_columns + 1, 1);
    *out = malloc(sizeof(double) * ((size_t)r->n_frames * (size_t)(n * width) + 1));
    mhe_status status = MHE_OK;
    if (column == NULL || used == NULL || *out == NULL) {
        status = mhe_fail(err, MHE_E_MEMORY, "out of memory");
    } else {
        status =
            mhi_columns_match(table, naming, names, n, n_labels, column, used, n_found, host, err);
    }
    for (int32_t k = 0; k < r->n_frames && status == MHE_OK; k++) {
        for (int32_t i = 0; i < n * width; i++) {
            const int32_t label = column[i / width];
            (*out)[(ptrdiff_t)k * n * width + i] =
                label < 0 ? NAN
                : rows == MHI_ROWS_MEAN
                    ? mhi_column_mean(table, label * width + i % width, r->time[k], 1 / r->rate)
                    : mhi_column_at(table, label * width + i % width, r->time[k],
                                    rows == MHI_ROWS_HOLD);
        }
    }
    free(column);
    free(used);
    return status;
}

mhe_status mhi_recording_set_times(mhi_recording *r, const mhi_table *table, mhe_error *err) {
    r->n_frames = table->n_rows;
    r->rate = table->rate;
    r->time = malloc(sizeof(double) * (size_t)table->n_rows);
    if (r->time == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    memcpy(r->time, table->time, sizeof(double) * (size_t)table->n_rows);
    return MHE_OK;
}

mhe_status mhi_recording_check_table(const mhi_table *table, const mhe_host *host, mhe_error *err) {
    for (int32_t i = 0; i < table->n_warnings; i++) {
        host->log(host, MHE_LOG_WARNING, table->warnings[i]);
    }
    if (!(table->rate > 0) || table->rate > MHI_SLOWEST * (1 + 1e-6)) {
        return MHE_OK;
    }
    char line[16] = "";
    if (table->line > 0) {
        (void)snprintf(line, sizeof line, ":%d", table->line + 1);
    }
    return mhe_fail(
        err, MHE_E_INPUT,
        "%s%s: rows are %.6g s apart (%.6g Hz): are its times in ms instead of s? They must be "
        "%.6g s apart then",
        table->path, line, 1 / table->rate, table->rate, 1e-3 / table->rate);
}

#define GAP 1.5     /* steps: a longer one is a gap, as in clock.c */
#define GAPS_TOLD 3 /* then only their number */

/* Median step between frames; NaN without. */
static double median_step(const mhi_recording *r) {
    const int32_t n = r->n_frames - 1;
    double median = NAN, *steps = n < 1 ? NULL : malloc(sizeof *steps * (size_t)n);
    for (int32_t k = 0; k < n && steps != NULL; k++) {
        steps[k] = r->time[k + 1] - r->time[k];
    }
    if (steps != NULL) {
        mhi_sort(steps, n);
        median = steps[n / 2];
    }
    free(steps);
    return median;
}

void mhi_recording_warn_uneven(const mhi_recording *r, const char *path, double window,
                               const mhe_host *host) {
    const double step = median_step(r);
    double least = INFINITY, most = 0, missing = 0;
    mhi_text gaps = {0};
    int32_t n = 0;
    for (int32_t k = 0; k + 1 < r->n_frames; k++) {
        const double here = r->time[k + 1] - r->time[k];
        if (!(here > GAP * step)) {
            least = fmin(least, here);
            most = fmax(most, here);
            continue;
        }
        missing += here - step;
        if (n++ < GAPS_TOLD) {
            mhi_text_add(&gaps, "%s%.4g s without frames after %.6g s: %s", n == 1 ? "" : "; ",
                         here - step, r->time[k],
                         here > window ? "begins again there" : "bridged by the model");
        }
    }
    char line[512];
    if (n > GAPS_TOLD) {
        mhi_text_add(&gaps, "; and %d more gaps, together %.4g s", n - GAPS_TOLD, missing);
    }
    if (n > 0 && !gaps.failed) {
        (void)snprintf(line, sizeof line, "%.200s: %.300s", path, gaps.data);
        host->log(host, MHE_LOG_WARNING, line);
    }
    if (most > GAP * least) {
        (void)snprintf(line, sizeof line,
                       "%.400s: the times are uneven (steps of %.4g to %.4g s) but taken as even",
                       path, least, most);
        host->log(host, MHE_LOG_WARNING, line);
    }
    mhi_text_free(&gaps);
}
