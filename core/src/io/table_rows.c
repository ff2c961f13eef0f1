/* SPDX-License-Identifier: Apache-2.0 */
/* Labels and rows of a table being read. */
#include "io/labels.h"
#include "io/table_reader.h"

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

static mhe_status out_of_memory(const mhi_table_reader *reader) {
    return mhe_fail(reader->err, MHE_E_MEMORY, "%s: out of memory", reader->table->path);
}

/* Of equal labels the first keeps its name. */
static mhe_status tell_apart(mhi_table_reader *reader) {
    const mhi_table *table = reader->table;
    int32_t n_equal = 0, first = 0;
    const mhe_status status =
        mhi_labels_tell_apart(table->labels, table->n_labels, &n_equal, &first, reader->err);
    if (status == MHE_OK && n_equal > 0) {
        char shown[MHI_SHOWN];
        const char *label = table->labels[first];
        mhi_table_warn(reader,
                       "%d of the labels stand twice; the later ones have their number behind "
                       "them ('%s')",
                       n_equal, mhi_cell_show(shown, (mhi_cell){label, strlen(label)}));
    }
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
        table->labels[i] = strndup(cell.text, cell.length);
        if (table->labels[i] == NULL) {
            return out_of_memory(reader);
        }
        table->n_labels = i + 1;
        if (cell.length == 0) {
            mhi_table_warn(reader, "column %d has no label: it is called 'column_%d'",
                           first + 1 + i, first + 1 + i);
            const mhe_status status =
                mhi_label_number(&table->labels[i], "column", "_", first + 1 + i, reader->err);
            if (status != MHE_OK) {
                return status;
            }
        }
    }
    table->n_columns = n * width;
    return table->labels == NULL ? out_of_memory(reader) : tell_apart(reader);
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
    double *frame = realloc(reader->frame, sizeof *frame * (size_t)capacity);
    reader->frame = frame != NULL ? frame : reader->frame;
    if (time == NULL || values == NULL || frame == NULL) {
        return out_of_memory(reader);
    }
    reader->rows_capacity = capacity;
    return MHE_OK;
}

/* Digits behind the point of a number as it is printed; one with an exponent has no end of them. */
static int32_t count_decimals(mhi_cell cell) {
    const char *point = memchr(cell.text, '.', cell.length);
    point = point == NULL ? memchr(cell.text, ',', cell.length) : point;
    if (memchr(cell.text, 'e', cell.length) != NULL ||
        memchr(cell.text, 'E', cell.length) != NULL) {
        return 17;
    }
    return point == NULL ? 0 : (int32_t)(cell.text + cell.length - point) - 1;
}

/* A number, also one with a decimal comma: no row is split by commas that has tabs or blanks. */
static int32_t read_number(mhi_table_reader *reader, mhi_cell cell, double *value) {
    char copy[64], shown[MHI_SHOWN];
    if (mhi_number(cell, value)) {
        return 1;
    }
    const char *comma = memchr(cell.text, ',', cell.length);
    if (comma == NULL || cell.length >= sizeof copy ||
        memchr(cell.text, '.', cell.length) != NULL) {
        return 0;
    }
    memcpy(copy, cell.text, cell.length);
    copy[comma - cell.text] = '.';
    if (!mhi_number((mhi_cell){copy, cell.length}, value)) {
        return 0;
    }
    if (!reader->has_commas) {
        reader->has_commas = 1;
        mhi_table_warn(reader, "numbers with a comma ('%s') are read as with a point",
                       mhi_cell_show(shown, cell));
    }
    return 1;
}

static mhe_status take_time(mhi_table_reader *reader, mhi_cell cell) {
    mhi_table *table = reader->table;
    char shown[MHI_SHOWN];
    double time = 0;
    if (!read_number(reader, cell, &time)) {
        return mhi_table_fail(reader, "time '%s' is not a finite number of seconds",
                              mhi_cell_show(shown, cell));
    }
    const double before = table->n_rows > 0 ? table->time[table->n_rows - 1] : -INFINITY;
    if (time < before) {
        return mhi_table_fail(reader, "time %.10g s does not come after %.10g s; it must increase",
                              time, before);
    }
    if (time == before) {
        reader->equal_line = reader->n_equal++ == 0 ? reader->line_number : reader->equal_line;
    }
    const int32_t decimals = count_decimals(cell);
    reader->decimals = decimals > reader->decimals ? decimals : reader->decimals;
    table->time[table->n_rows] = time;
    return MHE_OK;
}

static mhe_status take_value(mhi_table_reader *reader, int32_t column, mhi_cell cell,
                             double *value) {
    const mhi_table *table = reader->table;
    if (read_number(reader, cell, value)) {
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

/* The row has `expected` cells afterwards; *whole: it is worth being kept. */
static mhe_status mend_row(mhi_table_reader *reader, int32_t first, int32_t expected,
                           int32_t *whole) {
    const mhi_table *table = reader->table;
    *whole = 1;
    if (reader->n_cells > expected) {
        mhi_table_warn(reader,
                       "this row has %d cells; %d labels need %d: what is beyond is left out",
                       reader->n_cells, table->n_labels, expected);
        reader->n_cells = expected;
    }
    if (reader->n_cells == expected) {
        return MHE_OK;
    }
    const int tabs = memchr(reader->line.text, '\t', reader->line.length) != NULL;
    if (reader->at == reader->end && reader->end[-1] != '\n' && table->n_rows > 0) {
        mhi_table_warn(reader, "the file ends within this row, which is left out");
        *whole = 0;
        return MHE_OK;
    }
    if (reader->n_cells <= first || (!tabs && memchr(reader->line.text, ',', reader->line.length) ==
                                                  NULL)) { /* blanks: which one is missing? */
        return mhi_table_fail(reader, "this row has %d columns; %d labels need %d", reader->n_cells,
                              table->n_labels, expected);
    }
    mhi_table_warn(reader, "this row has %d cells; %d labels need %d: the rest is taken as missing",
                   reader->n_cells, table->n_labels, expected);
    mhe_status status = MHE_OK;
    while (reader->n_cells < expected && status == MHE_OK) {
        status = mhi_table_add_cell(reader, (mhi_cell){reader->line.text, 0});
    }
    return status;
}

mhe_status mhi_table_row(mhi_table_reader *reader, int32_t first) {
    mhi_table *table = reader->table;
    const int32_t expected = first + 1 + table->n_columns;
    int32_t whole = 0;
    mhe_status status = mhi_table_split_row(reader, expected);
    if (status == MHE_OK) {
        status = mend_row(reader, first, expected, &whole);
    }
    if (status != MHE_OK || !whole) {
        return status;
    }
    status = grow(reader);
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
    if (first == 0 || !mhi_number(reader->cells[0], &reader->frame[table->n_rows])) {
        reader->frame[table->n_rows] = NAN;
    }
    table->line = table->n_rows == 0 ? reader->line_number : table->line;
    table->n_rows += status == MHE_OK;
    mhi_table_give_back(reader);
    return status;
}
