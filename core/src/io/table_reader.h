/* SPDX-License-Identifier: Apache-2.0 */
/* table_reader.h: what the readers of .sto and .trc share: lines, cells, rows, messages. */
#ifndef MHI_TABLE_READER_H
#define MHI_TABLE_READER_H

#include "base/kinds.h"
#include "base/number.h"
#include "io/decode.h"
#include "io/table.h"

typedef struct mhi_table_reader {
    mhi_table *table;
    const char *at, *end; /* rest of the text */
    int32_t line_number;  /* of `line` */
    mhi_cell line;        /* without its end */
    mhi_cell *cells;      /* of the line, trimmed */
    int32_t n_cells, cells_capacity;
    int32_t rows_capacity;
    double *frame;               /* [n_rows] numbers of the frames; NULL: the format has none */
    int32_t decimals;            /* most that a time is printed with */
    int32_t n_equal, equal_line; /* rows whose time is that of the row before; the first's line */
    int32_t n_missing;           /* empty cells */
    int32_t has_commas;          /* decimal ones; told */
    mhi_kinds kinds;             /* of warnings */
    int32_t no_memory;           /* for one of them: the table is not handed out */
    mhi_decoded decoded;
    char *spent; /* text before `at` that may be given back from here on; NULL: it is lent */
    mhi_c_locale locale;
    mhe_error *err;
} mhi_table_reader;

/* begin makes the empty table; finish checks that there are rows, sets the rate where it is 0 and
 * hands the table over; or, given a status other than MHE_OK, frees it and returns that status. */
mhe_status mhi_table_begin(mhi_table_reader *reader, const char *name, const char *text,
                           size_t length, mhe_error *err);
mhe_status mhi_table_finish(mhi_table_reader *reader, mhe_status status, mhi_table **table);
/* What a format does between begin and finish. */
typedef mhe_status (*mhi_table_body)(mhi_table_reader *reader);
/* begin, `body` and finish on a text; and on a file, whose text is given back to the system while
 * the table grows: ten minutes of EMG are 200 MB of it. */
mhe_status mhi_table_parse(const char *name, const char *text, size_t length, mhi_table_body body,
                           mhi_table **table, mhe_error *err);
mhe_status mhi_table_read(const char *path, mhi_table_body body, mhi_table **table, mhe_error *err);

/* Steps to the next line; 0 at the end of the text. */
int32_t mhi_table_next(mhi_table_reader *reader);
int32_t mhi_table_blank(const mhi_table_reader *reader); /* the line holds nothing */

/* One more cell, trimmed. MHE_E_MEMORY. */
mhe_status mhi_table_add_cell(mhi_table_reader *reader, mhi_cell cell);
/* Cuts the line into cells at `separator`; ' ' stands for any run of blanks and tabs. */
mhe_status mhi_table_split(mhi_table_reader *reader, char separator);
/* Cuts it as its content suggests: tabs, else commas, else blanks. Where `expected` cells do not
 * come out, but do by another of these, that one is taken. Empty cells beyond `expected` at the
 * end are dropped. expected < 0: unknown. */
mhe_status mhi_table_split_row(mhi_table_reader *reader, int32_t expected);

/* After a row: gives back the text before it, a parcel at a time, where it is the reader's own. */
void mhi_table_give_back(mhi_table_reader *reader);

/* Takes cells from `first` on as the labels, `width` columns each. */
mhe_status mhi_table_labels(mhi_table_reader *reader, int32_t first, int32_t width);
/* Appends a row: time in cell `first`, values behind it. Cells beyond the labels are left out,
 * cells cut off at the row's end are missing; both are told. */
mhe_status mhi_table_row(mhi_table_reader *reader, int32_t first);
/* table_times.c: times that were printed with too few digits become even, and of rows with one time
 * the later ones go. MHE_E_INPUT: the time stands still. */
mhe_status mhi_table_settle_times(mhi_table_reader *reader);
/* A blank line has ended the data: warns where more follows. */
void mhi_table_ended(mhi_table_reader *reader);

/* MHE_E_INPUT with "file:line: " before the text. */
MHE_PRINTF(2, 3)
mhe_status mhi_table_fail(mhi_table_reader *reader, const char *format, ...);
MHE_PRINTF(2, 3) void mhi_table_warn(mhi_table_reader *reader, const char *format, ...);

#define MHI_SHOWN 48
/* A cell as a message shows it: cut to the room, without control characters. */
const char *mhi_cell_show(char out[MHI_SHOWN], mhi_cell cell);
/* Equal without regard to letter case. */
int32_t mhi_cell_is(mhi_cell cell, const char *word);
mhi_cell mhi_cell_trim(mhi_cell cell);

#endif
