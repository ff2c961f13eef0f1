/* SPDX-License-Identifier: Apache-2.0 */
#include "base/kinds.h"

int32_t mhi_kinds_count(mhi_kinds *kinds, const char *format, int32_t line, int32_t place) {
    int32_t i = 0;
    while (i < kinds->n && kinds->of[i].format != format) {
        i++;
    }
    if (i == MHI_KINDS_MAX) {
        return 1;
    }
    mhi_kind *kind = &kinds->of[i];
    if (i == kinds->n) {
        kinds->n++;
        kind->format = format;
    }
    kind->last_line = line;
    kind->n += kind->n < INT32_MAX;
    if (kind->n > MHI_KINDS_SHOWN) {
        return 0;
    }
    kind->place = place;
    return 1;
}

const char *mhi_kinds_rest(const mhi_kind *kind, char *out, size_t size) {
    out[0] = '\0';
    if (kind->n > MHI_KINDS_SHOWN) {
        (void)snprintf(out, size, " (and %d more of this kind, the last in line %d)",
                       (int)(kind->n - MHI_KINDS_SHOWN), (int)kind->last_line);
    }
    return out;
}
