/* SPDX-License-Identifier: Apache-2.0 */
/* c3d_labels.c: names of points and channels, all different. */
#include "io/c3d_parameters.h"

#include <stdlib.h>
#include <string.h>

#define PARTS_MAX 1000

mhi_c3d_parameter mhi_c3d_part(const mhi_c3d_file *file, const char *group, const char *name,
                               int32_t *part) {
    char numbered[24];
    (void)snprintf(numbered, sizeof numbered, *part == 0 ? "%s" : "%s%d", name, (int)*part + 1);
    *part += 1;
    return *part < PARTS_MAX ? mhi_c3d_find(file, group, numbered) : (mhi_c3d_parameter){0};
}

static mhe_status no_memory(const mhi_c3d_file *file) {
    return mhe_fail(file->err, MHE_E_MEMORY, "%s: out of memory", file->name);
}

/* Replaces a label by itself and a number. */
static mhe_status number(const mhi_c3d_file *file, char **label, const char *text,
                         const char *between, int32_t value) {
    const size_t size = strlen(text) + 24;
    char *made = malloc(size);
    if (made == NULL) {
        return no_memory(file);
    }
    (void)snprintf(made, size, "%s%s%d", text, between, (int)value);
    free(*label);
    *label = made;
    return MHE_OK;
}

static int by_text_and_place(const void *a, const void *b) {
    char *const *x = *(char *const *const *)a, *const *y = *(char *const *const *)b;
    const int order = strcmp(*x, *y);
    return order != 0 ? order : (x > y) - (x < y);
}

/* One pass; a label that got its number may equal another that was there. */
static mhe_status number_equal(const mhi_c3d_file *file, char **labels, char ***sorted, int32_t n,
                               int32_t *n_numbered) {
    for (int32_t i = 0; i < n; i++) {
        sorted[i] = &labels[i];
    }
    qsort(sorted, (size_t)n, sizeof *sorted, by_text_and_place);
    mhe_status status = MHE_OK;
    *n_numbered = 0;
    for (int32_t i = 1, first = 0; i < n && status == MHE_OK; i++) {
        if (strcmp(*sorted[i], *sorted[first]) != 0) {
            first = i;
            continue;
        }
        status = number(file, sorted[i], *sorted[i], "__", (int32_t)(sorted[i] - labels) + 1);
        *n_numbered += 1;
    }
    return status;
}

static mhe_status tell_apart(const mhi_c3d_file *file, char **labels, int32_t n, int32_t *n_equal) {
    char ***sorted = malloc(sizeof *sorted * ((size_t)n + 1));
    mhe_status status = sorted == NULL ? no_memory(file) : MHE_OK;
    for (int32_t more = 1; more > 0 && status == MHE_OK;) {
        status = number_equal(file, labels, sorted, n, &more);
        *n_equal += more;
    }
    free(sorted);
    return status;
}

mhe_status mhi_c3d_labels(const mhi_c3d_file *file, const char *group, const char *substitute,
                          char **labels, int32_t n, int32_t *n_equal) {
    int32_t n_read = 0, part = 0;
    mhi_c3d_parameter p;
    *n_equal = 0;
    while (n_read < n && (p = mhi_c3d_part(file, group, "LABELS", &part)).n > 0) {
        for (int32_t i = 0; i < p.n && n_read < n; i++) {
            labels[n_read] = mhi_c3d_text(&p, i);
            if (labels[n_read++] == NULL) {
                return no_memory(file);
            }
        }
    }
    for (int32_t i = 0; i < n; i++) {
        if (labels[i] == NULL || *labels[i] == '\0') {
            mhe_status status = number(file, &labels[i], substitute, "_", i + 1);
            if (status != MHE_OK) {
                return status;
            }
        }
    }
    return tell_apart(file, labels, n, n_equal);
}
