/* SPDX-License-Identifier: Apache-2.0 */
/* .sto and .mot: OpenSim storage (v1, v3) and SIMM motion files, and the same rows with commas. */
#include "io/table_reader.h"

#include <string.h>
#include <strings.h>

/* What the header says about the table. */
typedef struct sto_header {
    int32_t absent;            /* the file begins with its labels */
    int32_t n_rows, n_columns; /* -1: nothing said */
    int32_t has_version;       /* 1 or later: an OpenSim storage, no SIMM motion */
    int32_t has_degrees;       /* inDegrees is said */
} sto_header;

static int32_t is_end_of_header(const mhi_table_reader *reader) {
    return mhi_cell_is(mhi_cell_trim(reader->line), "endheader");
}

static int32_t has_end_of_header(const mhi_table_reader *reader) {
    mhi_table_reader look = *reader;
    while (mhi_table_next(&look)) {
        if (is_end_of_header(&look)) {
            return 1;
        }
    }
    return 0;
}

static int32_t starts_with_time(const mhi_table_reader *reader) {
    const mhi_cell first = reader->n_cells > 1 ? reader->cells[0] : (mhi_cell){"", 0};
    const mhi_cell word = {first.text, first.length < 4 ? first.length : 4};
    return mhi_cell_is(word, "time") &&
           (first.length == 4 || strchr(" ([_", first.text[4]) != NULL); /* "time (s)" */
}

static int32_t looks_like_data(const mhi_table_reader *reader) {
    double number;
    for (int32_t i = 0; i < reader->n_cells; i++) {
        if (!mhi_number(reader->cells[i], &number)) {
            return 0;
        }
    }
    return reader->n_cells > 1;
}

/* A count in the header; a wrong one is no reason to refuse the file. */
static int32_t take_count(mhi_table_reader *reader, mhi_cell value) {
    double number = -1;
    char shown[MHI_SHOWN];
    if (!mhi_number(value, &number) || number < 0 || number > 1e9) {
        mhi_table_warn(reader, "'%s' is no count; it is passed over", mhi_cell_show(shown, value));
        return -1;
    }
    return (int32_t)number;
}

static mhe_status take_key(mhi_table_reader *reader, mhi_cell key, mhi_cell value,
                           sto_header *header) {
    char shown[MHI_SHOWN];
    if (mhi_cell_is(key, "nRows") || mhi_cell_is(key, "datarows")) {
        header->n_rows = take_count(reader, value);
    } else if (mhi_cell_is(key, "nColumns") || mhi_cell_is(key, "datacolumns")) {
        header->n_columns = take_count(reader, value);
    } else if (mhi_cell_is(key, "inDegrees")) {
        int32_t yes = mhi_cell_is(value, "yes") || mhi_cell_is(value, "true");
        if (!yes && !mhi_cell_is(value, "no") && !mhi_cell_is(value, "false")) {
            return mhi_table_fail(reader, "inDegrees=%s: yes or no is needed",
                                  mhi_cell_show(shown, value));
        }
        reader->table->in_degrees = yes;
        header->has_degrees = 1;
    } else if (mhi_cell_is(key, "version")) {
        double number = 0;
        header->has_version = mhi_number(value, &number) && number >= 1;
    } else if (mhi_cell_is(key, "DataType") && !mhi_cell_is(value, "double")) {
        return mhi_table_fail(reader,
                              "DataType=%s: only tables of plain numbers (double) are read here",
                              mhi_cell_show(shown, value));
    }
    return MHE_OK;
}

/* "key=value", SIMM's "datacolumns 7", or free text, which says nothing to us. */
static mhe_status header_line(mhi_table_reader *reader, sto_header *header) {
    const char *equals = memchr(reader->line.text, '=', reader->line.length);
    if (equals != NULL) {
        size_t before = (size_t)(equals - reader->line.text);
        mhi_cell key = {reader->line.text, before};
        mhi_cell value = {equals + 1, reader->line.length - before - 1};
        return take_key(reader, mhi_cell_trim(key), mhi_cell_trim(value), header);
    }
    mhe_status status = mhi_table_split_row(reader, -1);
    if (status == MHE_OK && looks_like_data(reader)) {
        return mhi_table_fail(
            reader, "numbers before the end of the header: a line 'endheader' must stand before "
                    "the labels");
    }
    if (status == MHE_OK && reader->n_cells == 1) {
        status = mhi_table_split(reader, ' ');
    }
    if (status == MHE_OK && reader->n_cells == 2) {
        status = take_key(reader, reader->cells[0], reader->cells[1], header);
    }
    return status;
}

/* Steps to the line of labels. */
static mhe_status read_header(mhi_table_reader *reader, sto_header *header) {
    header->absent = !has_end_of_header(reader);
    int32_t ended = header->absent;
    while (mhi_table_next(reader)) {
        if (!ended && is_end_of_header(reader)) {
            ended = 1;
        } else if (!ended) {
            mhe_status status = header_line(reader, header);
            if (status != MHE_OK) {
                return status;
            }
        } else if (!mhi_table_blank(reader)) {
            return MHE_OK;
        }
    }
    return mhi_table_fail(reader,
                          "the file ends before the labels ('time' and one for each column)");
}

/* OpenSim reads a .mot of a version below 1, which is one of SIMM's header, as degrees where it
 * does not say itself (Common/Storage.cpp). */
static void settle_degrees(mhi_table_reader *reader, const sto_header *header) {
    const char *dot = strrchr(reader->table->path, '.');
    if (header->absent || header->has_version || header->has_degrees || dot == NULL ||
        strcasecmp(dot, ".mot") != 0) {
        return;
    }
    reader->table->in_degrees = 1;
    mhi_table_warn(reader,
                   "a .mot of SIMM's kind (no 'version=1'): angles are taken as degrees, as "
                   "OpenSim does; 'inDegrees=no' in the header says otherwise");
}

static mhe_status read_labels(mhi_table_reader *reader, const sto_header *header) {
    char shown[MHI_SHOWN];
    mhe_status status = mhi_table_split_row(reader, header->n_columns);
    while (status == MHE_OK && reader->n_cells > 0 &&
           reader->cells[reader->n_cells - 1].length == 0) {
        reader->n_cells--;
    }
    if (status == MHE_OK && !starts_with_time(reader)) {
        mhi_cell first = reader->n_cells > 0 ? reader->cells[0] : reader->line;
        return mhi_table_fail(reader, "%s must be 'time' and one for each column; found '%s'",
                              header->absent ? "there is no line 'endheader'; so the first labels"
                                             : "labels",
                              mhi_cell_show(shown, first));
    }
    if (status == MHE_OK && header->absent) {
        mhi_table_warn(reader, "no header with 'endheader'; the first line is taken as the labels");
    }
    if (status == MHE_OK && header->n_columns >= 0 && header->n_columns != reader->n_cells) {
        mhi_table_warn(reader, "the header says %d columns, there are %d labels", header->n_columns,
                       reader->n_cells);
    }
    return status == MHE_OK ? mhi_table_labels(reader, 1, 1) : status;
}

static mhe_status read_rows(mhi_table_reader *reader, const sto_header *header) {
    while (mhi_table_next(reader)) {
        if (mhi_table_blank(reader)) {
            mhi_table_ended(reader);
            break;
        }
        mhe_status status = mhi_table_row(reader, 0);
        if (status != MHE_OK) {
            return status;
        }
    }
    if (header->n_rows >= 0 && header->n_rows != reader->table->n_rows) {
        mhi_table_warn(reader, "the header says %d rows, there are %d", header->n_rows,
                       reader->table->n_rows);
    }
    return MHE_OK;
}

static mhe_status read_sto(mhi_table_reader *reader) {
    sto_header header = {0, -1, -1, 0, 0};
    mhe_status status = read_header(reader, &header);
    if (status == MHE_OK) {
        settle_degrees(reader, &header);
        status = read_labels(reader, &header);
    }
    return status == MHE_OK ? read_rows(reader, &header) : status;
}

mhe_status mhi_sto_parse(const char *name, const char *text, size_t length, mhi_table **table,
                         mhe_error *err) {
    return mhi_table_parse(name, text, length, read_sto, table, err);
}

mhe_status mhi_sto_read(const char *path, mhi_table **table, mhe_error *err) {
    return mhi_table_read(path, read_sto, table, err);
}
