/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/columns.h"

#include "base/text.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NAME_LENGTH 256
#define SAME_TIME 5e-7 /* s: files print times with six digits */

/* A pattern with %s or %d filled in. */
static void fill(char *out, const char *pattern, const char *name, int32_t number) {
    const char *mark = strchr(pattern, '%');
    const int head = mark == NULL ? (int)strlen(pattern) : (int)(mark - pattern);
    if (mark == NULL) {
        (void)snprintf(out, NAME_LENGTH, "%s", pattern);
    } else if (mark[1] == 's') {
        (void)snprintf(out, NAME_LENGTH, "%.*s%s%s", head, pattern, name, mark + 2);
    } else {
        (void)snprintf(out, NAME_LENGTH, "%.*s%d%s", head, pattern, (int)number, mark + 2);
    }
}

/* Numbered columns count from 0 where there is a number 0, else from 1. */
static int32_t find(const mhi_table *table, const mhi_naming *naming, const char *name,
                    int32_t position) {
    char label[NAME_LENGTH];
    for (size_t p = 0; p < sizeof naming->patterns / sizeof naming->patterns[0]; p++) {
        if (naming->patterns[p] == NULL) {
            break;
        }
        fill(label, naming->patterns[p], name, 0);
        const int from_zero =
            strstr(naming->patterns[p], "%d") != NULL && mhi_table_find(table, label) >= 0;
        fill(label, naming->patterns[p], name, from_zero ? position : position + 1);
        const int32_t column = mhi_table_find(table, label);
        if (column >= 0) {
            return column;
        }
    }
    return -1;
}

/* A label that matches nothing but is nearly a name that no column has was meant to be that one. */
static mhe_status report_unmatched(const mhi_table *table, const mhi_naming *naming,
                                   const char *const *absent, int32_t n, int32_t n_labels,
                                   const uint8_t *used, const mhe_host *host, mhe_error *err) {
    mhi_text extra = {0};
    mhe_status status = MHE_OK;
    for (int32_t i = 0; i < n_labels && status == MHE_OK; i++) {
        if (used[i]) {
            continue;
        }
        const char *near = mhi_nearest(table->labels[i], absent, n);
        if (near != NULL) {
            status = mhe_fail(err, MHE_E_INPUT,
                              "%s: column '%s' is no %s of the model (did you mean '%s'?)",
                              table->path, table->labels[i], naming->what, near);
        }
        mhi_text_add(&extra, "%s%s", extra.length == 0 ? "" : ", ", table->labels[i]);
    }
    if (status == MHE_OK && extra.length > 0) {
        mhi_text line = {0};
        mhi_text_add(&line, "%s: columns that are no %s of the model are left out: %s", table->path,
                     naming->what, extra.data);
        if (!line.failed) {
            host->log(host, MHE_LOG_WARNING, line.data);
        }
        mhi_text_free(&line);
    }
    mhi_text_free(&extra);
    return status;
}

mhe_status mhi_columns_match(const mhi_table *table, const mhi_naming *naming,
                             const char *const *names, int32_t n, int32_t n_labels, int32_t *column,
                             uint8_t *used, int32_t *n_found, const mhe_host *host,
                             mhe_error *err) {
    const char **absent = calloc((size_t)n + 1, sizeof *absent);
    if (absent == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    mhi_text missing = {0};
    *n_found = 0;
    for (int32_t i = 0; i < n; i++) {
        column[i] = find(table, naming, names[i], i);
        if (column[i] >= 0) {
            used[column[i]] = 1;
            *n_found += 1;
        } else {
            absent[i] = names[i];
            mhi_text_add(&missing, "%s%s", missing.length == 0 ? "" : ", ", names[i]);
        }
    }
    mhe_status status = MHE_OK;
    if (naming->required) {
        status = report_unmatched(table, naming, absent, n, n_labels, used, host, err);
        if (status == MHE_OK && *n_found == 0) {
            status = mhe_fail(
                err, MHE_E_INPUT,
                "%s: no column is a %s of the model (first column: '%s', the model's first: "
                "'%s')",
                table->path, naming->what, n_labels > 0 ? table->labels[0] : "",
                n > 0 ? names[0] : "none");
        }
        if (status == MHE_OK && missing.length > 0) {
            mhi_text line = {0};
            mhi_text_add(&line, "%s: no column for %s %s", table->path, naming->what, missing.data);
            if (!line.failed) {
                host->log(host, MHE_LOG_WARNING, line.data);
            }
            mhi_text_free(&line);
        }
    }
    mhi_text_free(&missing);
    free(absent);
    return status;
}

/* Last row whose time is not after `time`, -1 if none. */
static int32_t row_before(const mhi_table *table, double time) {
    int32_t low = -1, high = table->n_rows;
    while (high - low > 1) {
        const int32_t middle = low + (high - low) / 2;
        if (table->time[middle] <= time + SAME_TIME) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

double mhi_column_at(const mhi_table *table, int32_t column, double time, int32_t hold) {
    if (column < 0) {
        return NAN;
    }
    const int32_t row = row_before(table, time);
    if (row < 0) {
        return NAN;
    }
    const double *value = table->values + (ptrdiff_t)row * table->n_columns + column;
    const double since = time - table->time[row];
    if (fabs(since) <= SAME_TIME) {
        return *value;
    }
    if (row + 1 >= table->n_rows) {
        return NAN;
    }
    if (hold) {
        return *value;
    }
    const double step = table->time[row + 1] - table->time[row];
    return *value + (value[table->n_columns] - *value) * since / step;
}
