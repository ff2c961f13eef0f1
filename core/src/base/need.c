/* SPDX-License-Identifier: Apache-2.0 */
#include "base/need.h"

#include <string.h>

mhe_status mhi_need(const char *function, const mhi_needed *list, size_t n, mhe_error *err) {
    for (size_t i = 0; i < n; i++) {
        if (list[i].pointer == NULL) {
            return mhe_fail(err, MHE_E_ARGUMENT, "%s: '%s' is NULL", function, list[i].name);
        }
    }
    return MHE_OK;
}

static uint32_t size_of(const void *sized) {
    uint32_t size = 0;
    memcpy(&size, sized, sizeof size);
    return size;
}

static mhe_status no_size(const char *function, mhe_error *err) {
    return mhe_fail(err, MHE_E_ARGUMENT, "%s: a struct whose 'size' is not set", function);
}

mhe_status mhi_give(const char *function, void *to, const void *from, mhe_error *err) {
    const uint32_t room = size_of(to), own = size_of(from);
    if (room < sizeof room) {
        return no_size(function, err);
    }
    memcpy(to, from, room < own ? room : own);
    memcpy(to, &room, sizeof room);
    return MHE_OK;
}

mhe_status mhi_take(const char *function, void *to, uint32_t own, const void *from,
                    mhe_error *err) {
    const uint32_t room = size_of(from);
    if (room < sizeof room) {
        return no_size(function, err);
    }
    memset(to, 0, own);
    memcpy(to, from, room < own ? room : own);
    return MHE_OK;
}
