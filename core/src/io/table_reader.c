/* SPDX-License-Identifier: Apache-2.0 */
/* From text to lines and cells, with messages that say where. */
#include "io/table_reader.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

mhe_status mhi_table_fail(mhi_table_reader *reader, const char *format, ...) {
    char text[MHE_ERROR_TEXT];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    return mhe_fail(reader->err, MHE_E_INPUT, "%s:%d: %s", reader->table->path, reader->line_number,
                    text);
}

void mhi_table_warn(mhi_table_reader *reader, const char *format, ...) {
    mhi_table *table = reader->table;
    char text[MHE_ERROR_TEXT], where[MHE_ERROR_TEXT];
    if (!mhi_kinds_count(&reader->kinds, format, reader->line_number, table->n_warnings)) {
        return;
    }
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    int n = snprintf(where, sizeof where, "%s:%d: %s", table->path, reader->line_number, text);
    char **grown = realloc(table->warnings, sizeof *grown * ((size_t)table->n_warnings + 1));
    table->warnings = grown != NULL ? grown : table->warnings;
    char *line = grown != NULL && n > 0 ? strdup(where) : NULL;
    reader->no_memory = reader->no_memory || line == NULL;
    if (line != NULL) {
        table->warnings[table->n_warnings++] = line;
    }
}

/* Puts the number of what was only counted behind the last one that was told. */
static void count_kinds(mhi_table_reader *reader) {
    mhi_table *table = reader->table;
    for (int32_t i = 0; i < reader->kinds.n; i++) {
        const mhi_kind *kind = &reader->kinds.of[i];
        char rest[128], line[MHE_ERROR_TEXT + 128];
        if (*mhi_kinds_rest(kind, rest, sizeof rest) == '\0' || kind->place >= table->n_warnings) {
            continue;
        }
        (void)snprintf(line, sizeof line, "%s%s", table->warnings[kind->place], rest);
        char *copy = strdup(line);
        reader->no_memory = reader->no_memory || copy == NULL;
        if (copy != NULL) {
            free(table->warnings[kind->place]);
            table->warnings[kind->place] = copy;
        }
    }
}

mhi_cell mhi_cell_trim(mhi_cell cell) {
    while (cell.length > 0 && strchr(" \t\r", cell.text[0]) != NULL) {
        cell.text++;
        cell.length--;
    }
    while (cell.length > 0 && strchr(" \t\r", cell.text[cell.length - 1]) != NULL) {
        cell.length--;
    }
    return cell;
}

int32_t mhi_cell_is(mhi_cell cell, const char *word) {
    return strlen(word) == cell.length && strncasecmp(cell.text, word, cell.length) == 0;
}

const char *mhi_cell_show(char out[MHI_SHOWN], mhi_cell cell) {
    size_t n = cell.length < MHI_SHOWN - 4 ? cell.length : MHI_SHOWN - 4;
    for (size_t i = 0; i < n; i++) {
        unsigned char c = (unsigned char)cell.text[i];
        out[i] = c < 0x20 || c == 0x7f ? '.' : (char)c;
    }
    (void)snprintf(out + n, MHI_SHOWN - n, "%s", n < cell.length ? "..." : "");
    return out;
}

int32_t mhi_table_next(mhi_table_reader *reader) {
    if (reader->at == reader->end) {
        return 0;
    }
    const char *start = reader->at;
    while (reader->at < reader->end && *reader->at != '\n' && *reader->at != '\r') {
        reader->at++;
    }
    reader->line = (mhi_cell){start, (size_t)(reader->at - start)};
    if (reader->at < reader->end && *reader->at == '\r') { /* CRLF, or CR alone (old Mac) */
        reader->at++;
        if (reader->at < reader->end && *reader->at == '\n') {
            reader->at++;
        }
    } else if (reader->at < reader->end) {
        reader->at++;
    }
    reader->line_number++;
    return 1;
}

int32_t mhi_table_blank(const mhi_table_reader *reader) {
    for (size_t i = 0; i < reader->line.length; i++) {
        if (strchr(" \t\r,;", reader->line.text[i]) == NULL) {
            return 0;
        }
    }
    return 1; /* a spreadsheet's empty row is made of separators */
}

void mhi_table_ended(mhi_table_reader *reader) {
    int32_t ended = reader->line_number, more = 0;
    while (mhi_table_next(reader)) {
        more += !mhi_table_blank(reader);
    }
    if (more > 0) {
        reader->line_number = ended;
        mhi_table_warn(reader, "this blank line ends the data; %d later lines are not read", more);
    }
}

mhe_status mhi_table_add_cell(mhi_table_reader *reader, mhi_cell cell) {
    if (reader->n_cells == reader->cells_capacity) {
        int32_t capacity = reader->cells_capacity == 0 ? 64 : 2 * reader->cells_capacity;
        mhi_cell *grown = realloc(reader->cells, sizeof *grown * (size_t)capacity);
        if (grown == NULL) {
            return mhe_fail(reader->err, MHE_E_MEMORY, "%s: out of memory", reader->table->path);
        }
        reader->cells = grown;
        reader->cells_capacity = capacity;
    }
    reader->cells[reader->n_cells++] = mhi_cell_trim(cell);
    return MHE_OK;
}

mhe_status mhi_table_split(mhi_table_reader *reader, char separator) {
    const char *at = reader->line.text, *end = at + reader->line.length;
    mhe_status status = MHE_OK;
    reader->n_cells = 0;
    for (const char *p = at; p <= end && status == MHE_OK; p++) {
        int32_t cut = p == end || *p == separator || (separator == ' ' && *p == '\t');
        if (cut && (separator != ' ' || p > at)) {
            status = mhi_table_add_cell(reader, (mhi_cell){at, (size_t)(p - at)});
        }
        at = cut && p < end ? p + 1 : at;
    }
    return status;
}

mhe_status mhi_table_split_row(mhi_table_reader *reader, int32_t expected) {
    static const char separators[] = "\t, ";
    char first = 0;
    for (const char *s = separators; *s != '\0'; s++) {
        if (*s != ' ' && memchr(reader->line.text, *s, reader->line.length) == NULL) {
            continue;
        }
        first = first == 0 ? *s : first;
        mhe_status status = mhi_table_split(reader, *s);
        if (status != MHE_OK) {
            return status;
        }
        while (expected >= 0 && reader->n_cells > expected &&
               reader->cells[reader->n_cells - 1].length == 0) {
            reader->n_cells--;
        }
        if (expected < 0 || reader->n_cells == expected) {
            return MHE_OK;
        }
    }
    return mhi_table_split(reader, first); /* for the message: the count by the usual rule */
}

mhe_status mhi_table_begin(mhi_table_reader *reader, const char *name, const char *text,
                           size_t length, mhe_error *err) {
    *reader = (mhi_table_reader){.err = err};
    reader->locale = mhi_c_locale_begin();
    reader->table = calloc(1, sizeof *reader->table);
    if (reader->table == NULL || (reader->table->path = strdup(name)) == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
    }
    reader->table->unit = 1;
    const mhe_status status = mhi_decode(name, text, length, &reader->decoded, err);
    if (status != MHE_OK) {
        return status;
    }
    reader->at = reader->decoded.text;
    reader->end = reader->at + reader->decoded.length;
    const char *nul = memchr(reader->at, '\0', reader->decoded.length);
    if (nul != NULL) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s:1: holds binary data (a zero byte at %td); plain text is needed", name,
                        nul - reader->at);
    }
    if (reader->decoded.foreign_line > 0) {
        reader->line_number = reader->decoded.foreign_line;
        mhi_table_warn(reader, "bytes that are no UTF-8 (%d) are read as Windows-1252",
                       reader->decoded.foreign_n);
        reader->line_number = 0;
    }
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
        status = mhi_table_settle_times(reader);
    }
    if (status == MHE_OK) {
        count_kinds(reader);
    }
    if (status == MHE_OK && reader->no_memory) {
        status = mhe_fail(reader->err, MHE_E_MEMORY, "%s: out of memory", reader->table->path);
    }
    mhi_c_locale_end(reader->locale);
    free(reader->cells);
    free(reader->frame);
    free(reader->decoded.owned);
    *table = status == MHE_OK ? reader->table : NULL;
    if (status != MHE_OK) {
        mhi_table_free(reader->table);
    }
    return status;
}

mhe_status mhi_table_parse(const char *name, const char *text, size_t length, mhi_table_body body,
                           mhi_table **table, mhe_error *err) {
    mhi_table_reader reader;
    mhe_status status = mhi_table_begin(&reader, name, text, length, err);
    if (status == MHE_OK) {
        status = body(&reader);
    }
    return mhi_table_finish(&reader, status, table);
}
