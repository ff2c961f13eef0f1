/* SPDX-License-Identifier: Apache-2.0 */
/* throws.cpp: its entry throws a C++ exception. */
#include <mhe/plugin.h>

#include <stdexcept>

extern "C" MHE_EXPORT const mhe_library *mhe_plugin_entry(void);
const mhe_library *mhe_plugin_entry(void) {
    throw std::runtime_error("no table today");
}
