/* SPDX-License-Identifier: Apache-2.0 */
#include "estimator/columns.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
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
    for (size_t p = 0; p < MHI_PATTERNS; p++) {
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

/* What is said of the columns of a table: lists of names. */
typedef struct lists {
    mhi_text alike, extra, missing;
} lists;

static void add_name(mhi_text *list, const char *format, const char *a, const char *b) {
    mhi_text_add(list, "%s", list->length == 0 ? "" : ", ");
    mhi_text_add(list, format, a, b);
}

MHE_PRINTF(3, 4)
static void tell(const mhe_host *host, const mhi_text *list, const char *format, ...) {
    char head[512];
    mhi_text line = {0};
    if (list->length == 0) {
        return;
    }
    va_list args;
    va_start(args, format);
    (void)vsnprintf(head, sizeof head, format, args);
    va_end(args);
    mhi_text_add(&line, "%s%s", head, list->data);
    if (!line.failed) {
        host->log(host, MHE_LOG_WARNING, line.data);
    }
    mhi_text_free(&line);
}

/* Names without a column whose label is one of them in another spelling. */
static void match_alike(const mhi_table *table, const mhi_naming *naming, const char *const *names,
                        int32_t n, int32_t *column, uint8_t *used, lists *told) {
    for (int32_t i = 0; i < n; i++) {
        int32_t twice = 0;
        for (int32_t k = 0; k < n && column[i] < 0; k++) {
            twice += k != i && mhi_names_alike(names[k], names[i]);
        }
        for (size_t p = 0; p < MHI_PATTERNS && naming->patterns[p] != NULL && !twice; p++) {
            char label[NAME_LENGTH];
            if (column[i] >= 0 || strstr(naming->patterns[p], "%s") == NULL) {
                continue;
            }
            fill(label, naming->patterns[p], names[i], 0);
            column[i] = mhi_table_find_alike(table, label, used);
            if (column[i] >= 0) {
                used[column[i]] = 1;
                add_name(&told->alike, "%s as %s", table->labels[column[i]], names[i]);
            }
        }
    }
}

/* Two labels that are one name of two subjects: nobody can guess which is meant. */
static mhe_status check_subjects(const mhi_table *table, const mhi_naming *naming, const char *name,
                                 mhe_error *err) {
    const char *first = NULL;
    for (int32_t i = 0; i < table->n_labels; i++) {
        const char *label = table->labels[i];
        const size_t length = mhi_label_subject(label);
        if (length == 0 || !mhi_names_alike(label + length + 1, name)) {
            continue;
        }
        if (first == NULL) {
            first = label;
        } else if (mhi_label_subject(first) != length || memcmp(first, label, length) != 0) {
            return mhe_fail(err, MHE_E_INPUT,
                            "%s: two subjects (%.*s, %.*s) have %s %s: name one with data.subject",
                            table->path, (int)mhi_label_subject(first), first, (int)length, label,
                            naming->what, name);
        }
    }
    return MHE_OK;
}

static mhe_status list_rest(const mhi_table *table, const mhi_naming *naming,
                            const char *const *names, int32_t n, int32_t n_labels,
                            const int32_t *column, const uint8_t *used, lists *told,
                            mhe_error *err) {
    const char **absent = calloc((size_t)n + 1, sizeof *absent);
    mhe_status status = absent == NULL ? mhe_fail(err, MHE_E_MEMORY, "out of memory") : MHE_OK;
    for (int32_t i = 0; i < n && status == MHE_OK; i++) {
        if (column[i] < 0) {
            absent[i] = names[i];
            add_name(&told->missing, "%s", names[i], "");
            status = check_subjects(table, naming, names[i], err);
        }
    }
    for (int32_t i = 0; i < n_labels && status == MHE_OK; i++) {
        if (!used[i]) {
            const char *near = mhi_slip_of(table->labels[i], absent, n);
            add_name(&told->extra, near == NULL ? "%s" : "%s (did you mean '%s'?)",
                     table->labels[i], near);
        }
    }
    free(absent);
    return status;
}

mhe_status mhi_columns_match(const mhi_table *table, const mhi_naming *naming,
                             const char *const *names, int32_t n, int32_t n_labels, int32_t *column,
                             uint8_t *used, int32_t *n_found, const mhe_host *host,
                             mhe_error *err) {
    lists told = {{0}, {0}, {0}};
    *n_found = 0;
    for (int32_t i = 0; i < n; i++) {
        column[i] = find(table, naming, names[i], i);
        if (column[i] >= 0) {
            used[column[i]] = 1;
        }
    }
    if (naming->required) {
        match_alike(table, naming, names, n, column, used, &told);
    }
    for (int32_t i = 0; i < n; i++) {
        *n_found += column[i] >= 0;
    }
    mhe_status status = MHE_OK;
    if (naming->required) {
        status = list_rest(table, naming, names, n, n_labels, column, used, &told, err);
        if (status == MHE_OK && *n_found == 0) {
            status = mhe_fail(
                err, MHE_E_INPUT,
                "%s: no column is a %s of the model (first column: '%s', the model's first: "
                "'%s'); data.labels can say which is which",
                table->path, naming->what, n_labels > 0 ? table->labels[0] : "",
                n > 0 ? names[0] : "none");
        }
        if (status == MHE_OK) {
            tell(host, &told.alike, "%s: columns taken for a %s in another spelling: ", table->path,
                 naming->what);
            tell(host, &told.extra,
                 "%s: columns that are no %s of the model are left out: ", table->path,
                 naming->what);
            tell(host, &told.missing, "%s: no column for %s ", table->path, naming->what);
        }
    }
    mhi_text_free(&told.alike);
    mhi_text_free(&told.extra);
    mhi_text_free(&told.missing);
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

double mhi_column_mean(const mhi_table *table, int32_t column, double time, double span) {
    if (column < 0) {
        return NAN;
    }
    double sum = 0;
    int32_t n = 0, row = row_before(table, time);
    row = row >= 0 && fabs(table->time[row] - time) <= SAME_TIME ? row : row + 1;
    for (; row < table->n_rows && table->time[row] < time + span - SAME_TIME; row++) {
        const double value = table->values[(ptrdiff_t)row * table->n_columns + column];
        n += !isnan(value);
        sum += isnan(value) ? 0 : value;
    }
    return n > 0 ? sum / n : mhi_column_at(table, column, time, 0);
}

/* ---- subjects ---- */

int32_t mhi_label_is_of(const char *label, const char *subject) {
    const size_t length = mhi_label_subject(label);
    char name[256];
    if (length == 0 || length >= sizeof name) {
        return 0;
    }
    memcpy(name, label, length);
    name[length] = '\0';
    return strcmp(name, subject) == 0 || mhi_names_alike(name, subject);
}

void mhi_list_subjects(const mhi_table *table, mhi_text *out) {
    for (int32_t i = 0; i < table->n_labels; i++) {
        const size_t length = mhi_label_subject(table->labels[i]);
        int32_t known = length == 0;
        for (int32_t k = 0; k < i && !known; k++) {
            known = mhi_label_subject(table->labels[k]) == length &&
                    memcmp(table->labels[k], table->labels[i], length) == 0;
        }
        if (!known) {
            mhi_text_add(out, "%s%.*s", out->length == 0 ? "" : ", ", (int)length,
                         table->labels[i]);
        }
    }
}
