/* SPDX-License-Identifier: Apache-2.0 */
/* variants.h: one config, many times: every combination of the values that --vary lists. */
#ifndef VARIANTS_H
#define VARIANTS_H

#include "config/run.h"

#define VARIANTS_MAX 64

typedef struct variant {
    const char *name;       /* "formulation=activation horizon.window=7"; "as given" */
    const char *group_name; /* the same without horizon.window */
    int32_t group;          /* variants of one group differ in horizon.window alone */
    int32_t opens_group;    /* the first of its group */
    mhi_run *run;
} variant;

typedef struct variants {
    variant list[VARIANTS_MAX];
    int32_t n, n_groups;
    mhi_arena arena;
} variants;

/* Reads the config once for each combination of `vary` [n_vary], "key=v1,v2" each; commas within
 * brackets and braces part nothing. `set` holds for all. MHE_E_ARGUMENT and as mhi_run_read; give
 * back with variants_free in any case. */
mhe_status variants_read(const char *config, const char *const *set, int32_t n_set,
                         const char *const *vary, int32_t n_vary, mhi_registry *registry,
                         variants *v, mhe_error *err);
void variants_free(variants *v);

#endif
