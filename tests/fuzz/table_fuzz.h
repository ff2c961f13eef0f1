/* SPDX-License-Identifier: Apache-2.0 */
/* table_fuzz.h: what must hold for a table read from any bytes. */
#ifndef TABLE_FUZZ_H
#define TABLE_FUZZ_H

#include "fuzz.h"
#include "io/table.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static inline void table_require(int condition) {
    if (!condition) {
        abort();
    }
}

static inline void table_check(const mhi_table *t) {
    table_require(t->n_rows > 0 && t->n_labels > 0 && t->n_columns % t->n_labels == 0);
    table_require(t->rate >= 0 && isfinite(t->rate) && t->unit > 0);
    for (int32_t k = 0; k < t->n_rows; k++) {
        table_require(isfinite(t->time[k]) && (k == 0 || t->time[k] > t->time[k - 1]));
    }
    for (ptrdiff_t i = 0; i < (ptrdiff_t)t->n_rows * t->n_columns; i++) {
        table_require(!isinf(t->values[i]));
    }
    for (int32_t i = 0; i < t->n_warnings; i++) {
        table_require(strpbrk(t->warnings[i], "\n\r") == NULL);
    }
    /* each label finds itself; a few are enough where there are thousands */
    for (int32_t i = 0; i < t->n_labels && i < 50; i++) {
        table_require(mhi_table_find(t, t->labels[i]) == i);
    }
}

/* Reads and either holds a sound table or tells one line that begins with the file's name. */
static inline int table_fuzz(mhe_status (*parse)(const char *, const char *, size_t, mhi_table **,
                                                 mhe_error *),
                             const uint8_t *data, size_t size) {
    mhi_table *table = NULL;
    mhe_error err = {0};
    mhe_status status = parse("fuzz", (const char *)data, size, &table, &err);
    table_require((status == MHE_OK) == (table != NULL));
    if (table != NULL) {
        table_check(table);
    } else {
        table_require(status == MHE_E_INPUT && strncmp(err.text, "fuzz:", 5) == 0);
        table_require(strpbrk(err.text, "\n\r") == NULL);
    }
    mhi_table_free(table);
    return 0;
}

#endif
