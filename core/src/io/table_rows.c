/* SPDX-License-Identifier: Apache-2.0 */
/* Labels and rows of a table being read, and its rate. */
#include "io/table_reader.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static mhe_status out_of_memory(const mhi_table_reader *reader) {
    return mhe_fail(reader->err, MHE_E_MEMORY, "%s: out of memory", reader->table->path);
}

static int by_text(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

static mhe_status check_unique(mhi_table_reader *reader) {
    const mhi_table *table = reader->table;
    char **sorted = malloc(sizeof *sorted * ((size_t)table->n_labels + 1));
    if (sorted == NULL) {
        return out_of_memory(reader);
    }
    mhe_status status = MHE_OK;
    if (table->n_labels > 0) {
        memcpy(sorted, table->labels, sizeof *sorted * (size_t)table->n_labels);
        qsort(sorted, (size_t)table->n_labels, sizeof *sorted, by_text);
    }
    for (int32_t i = 1; i < table->n_labels && status == MHE_OK; i++) {
        if (strcmp(sorted[i - 1], sorted[i]) == 0) {
            char shown[MHI_SHOWN];
            mhi_cell label = {sorted[i], strlen(sorted[i])};
            status = mhi_table_fail(reader, "the label '%s' stands twice; each must be unique",
                                    mhi_cell_show(shown, label));
        }
    }
    free(sorted);
    return status;
}

mhe_status mhi_table_labels(mhi_table_reader *reader, int32_t first, int32_t width) {
    mhi_table *table = reader->table;
    int32_t n = reader->n_cells - first;
    if (n <= 0) {
        return mhi_table_fail(reader,
                              "no label stands beside the time; one for each column is needed");
    }
    if (n > INT32_MAX / width - 2) {
        return mhi_table_fail(reader, "%d labels are too many", n);
    }
    table->labels = calloc((size_t)n, sizeof *table->labels);
    for (int32_t i = 0; i < n && table->labels != NULL; i++) {
        mhi_cell cell = reader->cells[first + i];
        if (cell.length == 0) {
            return mhi_table_fail(reader, "label %d is empty; each column needs a name", i + 1);
        }
        table->labels[i] = strndup(cell.text, cell.length);
        if (table->labels[i] == NULL) {
            return out_of_memory(reader);
        }
        table->n_labels = i + 1;
    }
    table->n_columns = n * width;
    return table->labels == NULL ? out_of_memory(reader) : check_unique(reader);
}

static mhe_status grow(mhi_table_reader *reader) {
    mhi_table *table = reader->table;
    if (table->n_rows < reader->rows_capacity) {
        return MHE_OK;
    }
    if (table->n_rows > INT32_MAX / 2) {
        return mhi_table_fail(reader, "more than %d rows; split the file", table->n_rows);
    }
    int32_t capacity = reader->rows_capacity == 0 ? 16 : 2 * reader->rows_capacity;
    double *time = realloc(table->time, sizeof *time * (size_t)capacity);
    table->time = time != NULL ? time : table->time;
    double *values =
        realloc(table->values, sizeof *values * (size_t)capacity * (size_t)table->n_columns);
    table->values = values != NULL ? values : table->values;
    if (time == NULL || values == NULL) {
        return out_of_memory(reader);
    }
    reader->rows_capacity = capacity;
    return MHE_OK;
}

static mhe_status take_time(mhi_table_reader *reader, mhi_cell cell) {
    mhi_table *table = reader->table;
    char shown[MHI_SHOWN];
    double time = 0;
    if (!mhi_number(cell, &time)) {
        return mhi_table_fail(reader, "time '%s' is not a finite number of seconds",
                              mhi_cell_show(shown, cell));
    }
    double before = table->n_rows > 0 ? table->time[table->n_rows - 1] : -INFINITY;
    if (time <= before) {
        return mhi_table_fail(reader, "time %.10g s does not come after %.10g s; it must increase",
                              time, before);
    }
    table->time[table->n_rows] = time;
    return MHE_OK;
}

static mhe_status take_value(mhi_table_reader *reader, int32_t column, mhi_cell cell,
                             double *value) {
    const mhi_table *table = reader->table;
    if (mhi_number(cell, value)) {
        *value *= table->unit;
        return MHE_OK;
    }
    if (mhi_number_missing(cell)) {
        reader->n_missing += cell.length == 0 && reader->n_missing < INT32_MAX;
        *value = NAN;
        return MHE_OK;
    }
    char shown[MHI_SHOWN], label[MHI_SHOWN];
    const char *name = table->labels[column / (table->n_columns / table->n_labels)];
    return mhi_table_fail(
        reader, "column '%s': '%s' is not a finite number; write 1.5 (a point, no comma) or NaN",
        mhi_cell_show(label, (mhi_cell){name, strlen(name)}), mhi_cell_show(shown, cell));
}

mhe_status mhi_table_row(mhi_table_reader *reader, int32_t first) {
    mhi_table *table = reader->table;
    int32_t expected = first + 1 + table->n_columns;
    mhe_status status = mhi_table_split_row(reader, expected);
    if (status == MHE_OK && reader->n_cells != expected) {
        status = mhi_table_fail(reader, "this row has %d columns; %d labels need %d",
                                reader->n_cells, table->n_labels, expected);
    }
    if (status == MHE_OK) {
        status = grow(reader);
    }
    if (status == MHE_OK) {
        status = take_time(reader, reader->cells[first]);
    }
    if (status != MHE_OK) {
        return status;
    }
    double *row = table->values + (size_t)table->n_rows * (size_t)table->n_columns;
    for (int32_t i = 0; i < table->n_columns && status == MHE_OK; i++) {
        status = take_value(reader, i, reader->cells[first + 1 + i], &row[i]);
    }
    table->line = table->n_rows == 0 ? reader->line_number : table->line;
    table->n_rows += status == MHE_OK;
    mhi_table_give_back(reader);
    return status;
}

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Rows per second by the median step, or by the mean where the steps differ by rounding alone; 0
 * where there is no step. */
static mhe_status measure_rate(const mhi_table_reader *reader, double *rate) {
    const mhi_table *table = reader->table;
    int32_t n = table->n_rows - 1;
    *rate = 0;
    if (n < 1) {
        return MHE_OK;
    }
    double *steps = malloc(sizeof *steps * (size_t)n);
    if (steps == NULL) {
        return out_of_memory(reader);
    }
    for (int32_t i = 0; i < n; i++) {
        steps[i] = table->time[i + 1] - table->time[i];
    }
    qsort(steps, (size_t)n, sizeof *steps, by_value);
    double span = table->time[n] - table->time[0];
    *rate = steps[n - 1] < 1.5 * steps[0] ? n / span : 1 / steps[n / 2];
    free(steps);
    return MHE_OK;
}

/* The time column is what the rows were sampled at; a header that contradicts it is a warning. */
static mhe_status settle_rate(mhi_table_reader *reader) {
    mhi_table *table = reader->table;
    double measured = 0;
    mhe_status status = measure_rate(reader, &measured);
    if (status != MHE_OK || measured == 0 || !isfinite(measured)) {
        return status;
    }
    if (table->rate > 0 && fabs(1000 * measured / table->rate - 1) < 0.01) {
        mhi_table_warn(reader, "the header says %g Hz, the times %g Hz: they are taken as ms",
                       table->rate, measured);
        for (int32_t i = 0; i < table->n_rows; i++) {
            table->time[i] /= 1000;
        }
    } else if (table->rate > 0 && fabs(measured / table->rate - 1) > 0.01) {
        mhi_table_warn(reader, "the header says %g Hz, the time column %g Hz; the latter is used",
                       table->rate, measured);
        table->rate = 0;
    }
    table->rate = table->rate > 0 ? table->rate : measured;
    return MHE_OK;
}

mhe_status mhi_table_finish(mhi_table_reader *reader, mhe_status status, mhi_table **table) {
    if (status == MHE_OK && reader->table->n_rows == 0) {
        status = mhi_table_fail(reader, "the file ends without a row of data");
    }
    if (status == MHE_OK && reader->n_missing > 0) {
        mhi_table_warn(reader, "%d empty cells are taken as missing values", reader->n_missing);
    }
    if (status == MHE_OK) {
        status = settle_rate(reader);
    }
    mhi_c_locale_end(reader->locale);
    free(reader->cells);
    *table = status == MHE_OK ? reader->table : NULL;
    if (status != MHE_OK) {
        mhi_table_free(reader->table);
    }
    return status;
}
