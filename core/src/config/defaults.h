/* SPDX-License-Identifier: Apache-2.0 */
/* defaults.h: plugins that a configuration need not name, from the installed
 * share/mhe/defaults.yaml (place.h says where that is). */
#ifndef MHI_DEFAULTS_H
#define MHI_DEFAULTS_H

#include "base/arena.h"

/* The id for a section ("solver"), taken from `arena`; NULL: the file names none, or there is no
 * such file. MHE_E_CONFIG, MHE_E_INPUT: the file is not what it should be, "file:line: ...". [cold]
 */
mhe_status mhi_default_plugin(const char *section, mhi_arena *arena, const char **id,
                              mhe_error *err);

/* The same of what is a list: "forces", those that act where a configuration has none.
 * "external_loads" is what reads data.external_loads. n 0: none. */
mhe_status mhi_default_plugins(const char *name, mhi_arena *arena, const char ***ids, int32_t *n,
                               mhe_error *err);

#endif
