/* SPDX-License-Identifier: Apache-2.0 */
#include "io/labels.h"

#include <stdlib.h>
#include <string.h>

static mhe_status no_memory(mhe_error *err) {
    return mhe_fail(err, MHE_E_MEMORY, "out of memory");
}

mhe_status mhi_label_number(char **label, const char *text, const char *between, int32_t number,
                            mhe_error *err) {
    const size_t size = strlen(text) + strlen(between) + 16;
    char *made = malloc(size);
    if (made == NULL) {
        return no_memory(err);
    }
    (void)snprintf(made, size, "%s%s%d", text, between, (int)number);
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
static mhe_status number_equal(char **labels, char ***sorted, int32_t n, int32_t *n_numbered,
                               int32_t *lowest, mhe_error *err) {
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
        const int32_t place = (int32_t)(sorted[i] - labels);
        status = mhi_label_number(sorted[i], *sorted[i], "__", place + 1, err);
        *n_numbered += 1;
        *lowest = place < *lowest ? place : *lowest;
    }
    return status;
}

mhe_status mhi_labels_tell_apart(char **labels, int32_t n, int32_t *n_equal, int32_t *first,
                                 mhe_error *err) {
    char ***sorted = malloc(sizeof *sorted * ((size_t)n + 1));
    mhe_status status = sorted == NULL ? no_memory(err) : MHE_OK;
    *n_equal = 0;
    *first = n;
    for (int32_t more = 1; more > 0 && status == MHE_OK;) {
        status = number_equal(labels, sorted, n, &more, first, err);
        *n_equal += more;
    }
    free(sorted);
    return status;
}
