/* SPDX-License-Identifier: Apache-2.0 */
/* columns.h: which column of a table belongs to which name of the model, and its values at given
 * times. */
#ifndef MHI_COLUMNS_H
#define MHI_COLUMNS_H

#include "base/text.h"
#include "io/table.h"

#include <mhe/host.h>

#define MHI_PATTERNS 6

/* How the columns of one quantity may be called: any of the patterns, where %s stands for the
 * model's name and %d for its number, counted from 0 or 1. */
typedef struct mhi_naming {
    const char *what;                   /* "marker", "muscle": for messages */
    const char *patterns[MHI_PATTERNS]; /* NULL-terminated */
    int32_t required; /* no column matches: an error; other spellings are taken, and what is left
                         over or missing is told */
} mhi_naming;

/* column[i] of names[i] [n], -1 if absent; `*n_found` counts. `used` [n_columns or labels] is
 * marked. MHE_E_INPUT as recording.h says. */
mhe_status mhi_columns_match(const mhi_table *table, const mhi_naming *naming,
                             const char *const *names, int32_t n, int32_t n_labels, int32_t *column,
                             uint8_t *used, int32_t *n_found, const mhe_host *host, mhe_error *err);

/* Value of a column at a time: the row within half a microsecond of it, else linear between
 * neighbours (`hold`: the row before); NaN outside the table and beside missing values. */
double mhi_column_at(const mhi_table *table, int32_t column, double time, int32_t hold);
/* The mean of the rows from `time` on, `span` s long; where there is none, the value at `time`. */
double mhi_column_mean(const mhi_table *table, int32_t column, double time, double span);

/* Is "NAME:LABEL" of this subject (data.subject)? */
int32_t mhi_label_is_of(const char *label, const char *subject);
/* Appends the subjects of a table, "A, B". */
void mhi_list_subjects(const mhi_table *table, mhi_text *out);

#endif
