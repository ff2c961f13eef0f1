/* SPDX-License-Identifier: Apache-2.0 */
/* reference.h: reference motions by optimal control: the steps of a config, one after the other. */
#ifndef REFERENCE_H
#define REFERENCE_H

#include "base/text.h"
#include "plugin/registry.h"

typedef struct reference_setup {
    const char *config; /* file with a list `steps` */
    const char *const *set;
    int32_t n_set;
    const mhe_host *host;
    mhi_registry *registry;
    const char *out; /* folder of results; NULL: out/<config name> */
    int32_t cache;   /* steps that were solved before are read back */
} reference_setup;

/* Solves all steps, then integrates those with an `output` with CVODES and writes what an
 * experiment would have recorded. Prints a line a step. */
mhe_status reference_run(const reference_setup *setup, mhe_error *err);

/* Every key of a step and of its bounds. */
void reference_describe(mhi_text *out);

#endif
