/* SPDX-License-Identifier: Apache-2.0 */
/* options.h: from a YAML mapping to a config struct by an option table, and back. */
#ifndef MHI_OPTIONS_H
#define MHI_OPTIONS_H

#include "base/arena.h"
#include "config/tree.h"

#include <mhe/option.h>

/* Fills `config` (zeroed, of the table's struct) from `mapping` (NULL or empty: all defaults). Keys
 * in `common` [n_common] belong to the caller and are passed over ("plugin", "weight"...). `what`
 * names the table in messages
 * ("org.lab.solver.x"). Paths become absolute with respect to `dir`. Strings and lists live in
 * `arena`. MHE_E_CONFIG: unknown key (nearest valid key named), wrong type, out of range, required
 * key absent. [cold] */
mhe_status mhi_options_fill(const mhe_option *options, int32_t n_options, const mhi_tree *tree,
                            const mhi_node *mapping, const char *const *common, int32_t n_common,
                            const char *what, const char *dir, mhi_arena *arena, void *config,
                            mhe_error *err);

/* Checks a table itself: keys unique and well formed, defaults in range, choices hold the default,
 * fields inside config_size. `reason` of the first fault. [cold] */
mhe_status mhi_options_check(const mhe_option *options, int32_t n_options, uint32_t config_size,
                             mhe_error *err);

/* Appends "key: value" lines, each behind `indent` blanks, of a filled config: valid YAML that
 * reads back the same. */
void mhi_options_write(const mhe_option *options, int32_t n_options, const void *config,
                       int32_t indent, mhi_text *out);

#endif
