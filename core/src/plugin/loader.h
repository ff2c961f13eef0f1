/* SPDX-License-Identifier: Apache-2.0 */
/* loader.h: from a shared object to checked plugins. */
#ifndef MHI_LOADER_H
#define MHI_LOADER_H

#include "base/arena.h"

#include <mhe/plugin.h>

/* Loads `path` (RTLD_NOW | RTLD_LOCAL, never unloaded) and checks everything that it declares.
 * `plugins` [n_plugins] live in `arena`. MHE_E_PLUGIN: refused; the text is the reason, without the
 * path. [cold] */
mhe_status mhi_loader_open(const char *path, mhi_arena *arena, const mhe_plugin *const **plugins,
                           int32_t *n_plugins, mhe_error *err);

/* The shared object that a plugin lives in, absolute; as long as it is loaded: until exit.
 * MHE_E_INPUT: not known. */
mhe_status mhi_plugin_library(const mhe_plugin *plugin, const char **path, mhe_error *err);

#endif
