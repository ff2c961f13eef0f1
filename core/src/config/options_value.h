/* SPDX-License-Identifier: Apache-2.0 */
/* options_value.h: one option at a time; private to the filling of a table. */
#ifndef MHI_OPTIONS_VALUE_H
#define MHI_OPTIONS_VALUE_H

#include "base/arena.h"
#include "config/tree.h"

#include <mhe/option.h>

#define MHI_MAX_NAMES 256 /* names weighed when a key or choice is unknown */

/* What all values of one table share; see mhi_options_fill. */
typedef struct mhi_filler {
    const mhi_tree *tree;
    const char *what, *dir;
    mhi_arena *arena;
    void *config;
    mhe_error *err;
} mhi_filler;

/* Sets the option's field from `node`, or to its default. */
mhe_status mhi_filler_read(const mhi_filler *filler, const mhe_option *option,
                           const mhi_node *node);
mhe_status mhi_filler_default(const mhi_filler *filler, const mhe_option *option);

/* MHE_E_CONFIG with place and `what` in front. */
MHE_PRINTF(3, 4)
mhe_status mhi_filler_refuse(const mhi_filler *filler, const mhi_node *node, const char *format,
                             ...);
mhe_status mhi_filler_no_memory(const mhi_filler *filler);

/* `path` with respect to the folder `dir` (NULL: as it is); NULL when memory is out. */
const char *mhi_path_absolute(const char *dir, const char *path, mhi_arena *arena);

#endif
