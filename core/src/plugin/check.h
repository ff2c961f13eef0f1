/* SPDX-License-Identifier: Apache-2.0 */
/* check.h: all that is checked of a plugin's tables, once, at load; hot code then tests nothing. */
#ifndef MHI_CHECK_H
#define MHI_CHECK_H

#include "base/arena.h"

#include <mhe/plugin.h>

/* Magic and ABI version first, then the rest of the library's table. [cold] */
mhe_status mhi_check_library(const mhe_library *library, mhe_error *err);

/* Checks one plugin's descriptor, function table and options. `plugin` becomes a copy in `arena`
 * whose tables have this core's sizes: entries past the plugin's own `size` are NULL. [cold] */
mhe_status mhi_check_plugin(const mhe_plugin *raw, mhi_arena *arena, const mhe_plugin **plugin,
                            mhe_error *err);

#endif
