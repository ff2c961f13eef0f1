/* SPDX-License-Identifier: Apache-2.0 */
/* recording_labels.c: whose columns are read, and what the config calls them. */
#include "base/text.h"
#include "estimator/columns.h"
#include "estimator/recording_private.h"

#include <stdlib.h>
#include <string.h>

/* Takes columns of labels that are not kept out of the table. */
static void keep_columns(mhi_table *table, const uint8_t *keep, int32_t width) {
    const int32_t before = table->n_columns;
    int32_t n = 0;
    for (int32_t i = 0; i < table->n_labels; i++) {
        if (keep[i]) {
            table->labels[n++] = table->labels[i];
        } else {
            free(table->labels[i]);
        }
    }
    double *to = table->values;
    for (int32_t k = 0; k < table->n_rows; k++) {
        const double *from = table->values + (ptrdiff_t)k * before;
        for (int32_t i = 0; i < before; i++) {
            if (keep[i / width]) {
                *to++ = from[i];
            }
        }
    }
    table->n_labels = n;
    table->n_columns = n * width;
}

/* The columns of the subject lose its name, those of others go; a file that names no subject stays
 * as it is. */
static mhe_status take_subject(mhi_table *table, int32_t width, const mhi_run *run,
                               mhe_error *err) {
    const char *subject = run->data.subject;
    uint8_t *keep = calloc((size_t)table->n_labels + 1, 1);
    mhi_text others = {0};
    if (keep == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    int32_t n = 0;
    for (int32_t i = 0; i < table->n_labels; i++) {
        const int32_t own = mhi_label_is_of(table->labels[i], subject);
        keep[i] = own || mhi_label_subject(table->labels[i]) == 0;
        n += own;
    }
    mhi_list_subjects(table, &others);
    mhe_status status = MHE_OK;
    if (n == 0 && others.length > 0) {
        status = mhi_fail_at(
            err, MHE_E_CONFIG, run->tree, mhi_node_find(mhi_tree_root(run->tree), "data"),
            "data.subject: %s has no subject '%s' (it has %s)", table->path, subject, others.data);
    }
    if (status == MHE_OK && n > 0) {
        keep_columns(table, keep, width);
        for (int32_t i = 0; i < table->n_labels; i++) {
            const size_t length = mhi_label_subject(table->labels[i]);
            char *label = table->labels[i];
            if (length > 0) {
                memmove(label, label + length + 1, strlen(label) - length);
            }
        }
    }
    mhi_text_free(&others);
    free(keep);
    return status;
}

mhe_status mhi_recording_name(mhi_recording *r, const mhi_run *run, mhi_table *table, int32_t width,
                              mhe_error *err) {
    const mhe_text_map *map = &run->data.labels;
    mhe_status status = run->data.subject == NULL || *run->data.subject == '\0'
                            ? MHE_OK
                            : take_subject(table, width, run, err);
    if (r->labels_used == NULL && map->n > 0) {
        r->labels_used = calloc((size_t)map->n, 1);
    }
    for (int32_t i = 0; i < map->n && status == MHE_OK; i++) {
        int32_t column = mhi_table_find(table, map->keys[i]);
        column = column < 0 ? mhi_table_find_alike(table, map->keys[i], NULL) : column;
        if (column < 0) {
            continue;
        }
        char *name = strdup(map->values[i]);
        if (name == NULL || r->labels_used == NULL) {
            free(name);
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
        free(table->labels[column]);
        table->labels[column] = name;
        r->labels_used[i] = 1;
    }
    return status;
}

void mhi_recording_warn_labels(const mhi_recording *r, const mhi_run *run, const mhe_host *host) {
    mhi_text line = {0};
    int32_t n = 0;
    for (int32_t i = 0; i < run->data.labels.n; i++) {
        if (r->labels_used == NULL || !r->labels_used[i]) {
            mhi_text_add(&line, "%s%s", n++ == 0 ? "data.labels: no file has the column " : ", ",
                         run->data.labels.keys[i]);
        }
    }
    if (n > 0 && !line.failed) {
        host->log(host, MHE_LOG_WARNING, line.data);
    }
    mhi_text_free(&line);
}
