/* SPDX-License-Identifier: Apache-2.0 */
#include <mhe/library.h>
#include <mhe/version.h>

const char *mhe_version(void) {
    return MHE_VERSION;
}

const char *mhe_status_text(mhe_status status) {
    switch (status) {
#define TEXT(name, value, text) \
    case name:                  \
        return text;
        MHE_STATUS_LIST(TEXT)
#undef TEXT
    default:
        return "an unknown status";
    }
}
