/* SPDX-License-Identifier: Apache-2.0 */
/* unresolved.c: needs a function that nobody defines. */
#include <mhe/plugin.h>

const mhe_library *mhe_function_that_nobody_defines(void);
MHE_EXPORT const mhe_library *mhe_plugin_entry(void);
const mhe_library *mhe_plugin_entry(void) {
    return mhe_function_that_nobody_defines();
}
