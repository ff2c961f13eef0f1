/* SPDX-License-Identifier: Apache-2.0 */
/* .trc: marker trajectories as Motion Analysis, Vicon, Mokka and OpenSim write them. */
#include "io/length_unit.h"
#include "io/table_reader.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What the header says; -1: nothing. */
typedef struct trc_header {
    int32_t n_frames, n_markers;
    int32_t n_zeros; /* samples of a marker at exactly 0 0 0 */
} trc_header;

/* Where the unit is none, the distances between markers settle it later (marker_unit.h). */
static void take_unit(mhi_table_reader *reader, mhi_cell value) {
    mhi_table *table = reader->table;
    char shown[MHI_SHOWN];
    mhi_length_unit unit = mhi_length_unit_of(value);
    if (unit.metres == 0) {
        mhi_table_warn(reader, "Units '%s' is none of mm, cm, m; mm is taken",
                       mhi_cell_show(shown, value));
        unit = (mhi_length_unit){"mm", 1e-3};
    }
    table->unit = unit.metres;
    memcpy(table->unit_name, unit.name, sizeof table->unit_name);
}

/* Drops empty cells, as double tabs and tabs at the end leave them. */
static mhe_status split_words(mhi_table_reader *reader) {
    int32_t tabs = memchr(reader->line.text, '\t', reader->line.length) != NULL;
    mhe_status status = mhi_table_split(reader, tabs ? '\t' : ' ');
    int32_t n = 0;
    for (int32_t i = 0; i < reader->n_cells && status == MHE_OK; i++) {
        if (reader->cells[i].length > 0) {
            reader->cells[n++] = reader->cells[i];
        }
    }
    reader->n_cells = n;
    return status;
}

static mhe_status next_words(mhi_table_reader *reader, const char *wanted) {
    return mhi_table_next(reader) ? split_words(reader)
                                  : mhi_table_fail(reader, "the file ends before %s", wanted);
}

/* One key of line 2 with its value of line 3; keys not named here do not matter to us. */
static mhe_status take_key(mhi_table_reader *reader, mhi_cell key, mhi_cell value,
                           trc_header *header) {
    double number = -1;
    int32_t is_number = mhi_number(value, &number);
    if (mhi_cell_is(key, "Units")) {
        take_unit(reader, value);
        return MHE_OK;
    }
    if (mhi_cell_is(key, "DataRate") && is_number && number > 0) {
        reader->table->rate = number;
    } else if (mhi_cell_is(key, "NumFrames") && is_number && number >= 0 && number < 1e9) {
        header->n_frames = (int32_t)number;
    } else if (mhi_cell_is(key, "NumMarkers") && is_number && number >= 0 && number < 1e9) {
        header->n_markers = (int32_t)number;
    }
    return MHE_OK;
}

#define KEYS_MAX 16 /* there are 8 */

/* Lines 1 to 3. */
static mhe_status read_header(mhi_table_reader *reader, trc_header *header) {
    static const char first[] = "PathFileType";
    mhe_status status = next_words(reader, "its first line (PathFileType 4 (X/Y/Z) name)");
    if (status == MHE_OK && (reader->line.length < sizeof first - 1 ||
                             memcmp(reader->line.text, first, sizeof first - 1) != 0)) {
        return mhi_table_fail(reader, "a .trc file must begin with 'PathFileType'");
    }
    mhi_cell keys[KEYS_MAX];
    int32_t n_keys = 0;
    if (status == MHE_OK && (status = next_words(reader, "the header's keys")) == MHE_OK) {
        n_keys = reader->n_cells < KEYS_MAX ? reader->n_cells : KEYS_MAX;
        memcpy(keys, reader->cells, sizeof *keys * (size_t)n_keys);
        status = next_words(reader, "the header's values");
    }
    for (int32_t i = 0; i < n_keys && i < reader->n_cells && status == MHE_OK; i++) {
        status = take_key(reader, keys[i], reader->cells[i], header);
    }
    if (status == MHE_OK && reader->table->unit_name[0] == '\0') {
        take_unit(reader, (mhi_cell){"", 0});
    }
    return status;
}

/* Names stand above the first of their three columns; where one is missing between others its place
 * is kept, or all behind it would be another's. Else words as they come. */
static mhe_status split_names(mhi_table_reader *reader) {
    mhe_status status = mhi_table_split(reader, '\t');
    int32_t last = 0, in_place = 1;
    for (int32_t i = 2; i < reader->n_cells && status == MHE_OK; i++) {
        const int32_t named = reader->cells[i].length > 0;
        last = named ? i : last;
        in_place = in_place && (!named || (i - 2) % 3 == 0);
    }
    if (status != MHE_OK || !in_place || last < 5) {
        return status == MHE_OK ? split_words(reader) : status;
    }
    int32_t n = 2;
    for (int32_t i = 2; i <= last; i += 3) {
        reader->cells[n++] = reader->cells[i];
    }
    reader->n_cells = n;
    return MHE_OK;
}

/* Lines 4 and 5: names; and X1 Y1 Z1 ..., which may be absent. */
static mhe_status read_labels(mhi_table_reader *reader, const trc_header *header) {
    mhe_status status = mhi_table_next(reader)
                            ? split_names(reader)
                            : mhi_table_fail(reader, "the file ends before %s",
                                             "the marker names (Frame# Time ...)");
    if (status != MHE_OK) {
        return status;
    }
    if (reader->n_cells < 2 ||
        !(mhi_cell_is(reader->cells[0], "Frame#") || mhi_cell_is(reader->cells[0], "Frame")) ||
        !(mhi_cell_is(reader->cells[1], "Time") || mhi_cell_is(reader->cells[1], "Times"))) {
        return mhi_table_fail(reader, "line 4 must hold 'Frame#', 'Time' and the marker names");
    }
    if (header->n_markers >= 0 && header->n_markers != reader->n_cells - 2) {
        mhi_table_warn(reader, "the header says %d markers, there are %d names", header->n_markers,
                       reader->n_cells - 2);
    }
    status = mhi_table_labels(reader, 2, 3);
    mhi_table_reader before = *reader;
    if (status == MHE_OK && mhi_table_next(reader)) {
        mhi_cell line = mhi_cell_trim(reader->line);
        if (line.length > 0 && *line.text != 'X' && *line.text != 'x') {
            *reader = before; /* already data */
        }
    }
    return status;
}

/* A marker is known in all three coordinates or not at all; exactly 0 0 0 is how several systems
 * write that it was not seen. */
static void complete_markers(mhi_table *table, trc_header *header) {
    double *row = table->values + (size_t)(table->n_rows - 1) * (size_t)table->n_columns;
    for (int32_t i = 0; i < table->n_columns; i += 3) {
        const int nowhere = row[i] == 0 && row[i + 1] == 0 && row[i + 2] == 0;
        header->n_zeros += nowhere && header->n_zeros < INT32_MAX;
        if (nowhere || isnan(row[i] + row[i + 1] + row[i + 2])) {
            row[i] = row[i + 1] = row[i + 2] = NAN;
        }
    }
}

static mhe_status read_rows(mhi_table_reader *reader, trc_header *header) {
    mhi_table *table = reader->table;
    while (mhi_table_next(reader)) {
        if (mhi_table_blank(reader) && table->n_rows == 0) {
            continue;
        }
        if (mhi_table_blank(reader)) {
            mhi_table_ended(reader);
            break;
        }
        const int32_t before = table->n_rows;
        mhe_status status = mhi_table_row(reader, 1);
        if (status != MHE_OK) {
            return status;
        }
        if (table->n_rows > before) {
            complete_markers(table, header);
        }
    }
    if (header->n_zeros > 0) {
        reader->line_number = table->line;
        mhi_table_warn(reader, "%d samples of a marker at exactly 0 0 0 are taken as gaps",
                       header->n_zeros);
    }
    if (header->n_frames >= 0 && header->n_frames != table->n_rows) {
        mhi_table_warn(reader, "the header says %d frames, there are %d", header->n_frames,
                       table->n_rows);
    }
    reader->n_missing = 0; /* the usual way to say it in this format: nothing to warn of */
    return MHE_OK;
}

static mhe_status read_trc(mhi_table_reader *reader) {
    trc_header header = {-1, -1, 0};
    mhe_status status = read_header(reader, &header);
    if (status == MHE_OK) {
        status = read_labels(reader, &header);
    }
    return status == MHE_OK ? read_rows(reader, &header) : status;
}

mhe_status mhi_trc_parse(const char *name, const char *text, size_t length, mhi_table **table,
                         mhe_error *err) {
    return mhi_table_parse(name, text, length, read_trc, table, err);
}

mhe_status mhi_trc_read(const char *path, mhi_table **table, mhe_error *err) {
    return mhi_table_read(path, read_trc, table, err);
}
