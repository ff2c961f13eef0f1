/* SPDX-License-Identifier: Apache-2.0 */
/* no_entry.c: a shared object without mhe_plugin_entry. */
#include <mhe/abi.h>

MHE_EXPORT int32_t mhe_not_an_entry(void);
int32_t mhe_not_an_entry(void) {
    return 1;
}
