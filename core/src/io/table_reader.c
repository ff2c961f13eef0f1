/* SPDX-License-Identifier: Apache-2.0 */
/* From text to lines and cells, with messages that say where. */
#include "io/table_reader.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define WARNINGS_MAX 32 /* a file wrong in every row does not fill the screen */

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
    if (table->n_warnings == WARNINGS_MAX) {
        return;
    }
    if (table->warnings == NULL) {
        table->warnings = calloc(WARNINGS_MAX, sizeof *table->warnings);
    }
    va_list args;
    va_start(args, format);
    (void)vsnprintf(text, sizeof text, format, args);
    va_end(args);
    int n = snprintf(where, sizeof where, "%s:%d: %s", table->path, reader->line_number, text);
    char *line = table->warnings != NULL && n > 0 ? strdup(where) : NULL;
    if (line != NULL) {
        table->warnings[table->n_warnings++] = line;
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
    return mhi_cell_trim(reader->line).length == 0;
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

static mhe_status add_cell(mhi_table_reader *reader, mhi_cell cell) {
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
            status = add_cell(reader, (mhi_cell){at, (size_t)(p - at)});
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
    text = length == 0 ? "" : text;
    *reader = (mhi_table_reader){.at = text, .end = text + length, .err = err};
    reader->locale = mhi_c_locale_begin();
    reader->table = calloc(1, sizeof *reader->table);
    if (reader->table == NULL || (reader->table->path = strdup(name)) == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "%s: out of memory", name);
    }
    reader->table->unit = 1;
    if (length >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0) { /* byte order mark */
        reader->at += 3;
    }
    const char *nul = length == 0 ? NULL : memchr(text, '\0', length);
    if (nul != NULL) {
        return mhe_fail(err, MHE_E_INPUT,
                        "%s:1: holds binary data (a zero byte at %td); plain text is needed", name,
                        nul - text);
    }
    return MHE_OK;
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
