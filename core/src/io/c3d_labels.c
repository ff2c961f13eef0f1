/* SPDX-License-Identifier: Apache-2.0 */
/* c3d_labels.c: names of points and channels, all different. */
#include "io/c3d_parameters.h"

#include "io/labels.h"

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
            mhe_status status = mhi_label_number(&labels[i], substitute, "_", i + 1, file->err);
            if (status != MHE_OK) {
                return status;
            }
        }
    }
    int32_t first = 0;
    return mhi_labels_tell_apart(labels, n, n_equal, &first, file->err);
}
