/* SPDX-License-Identifier: Apache-2.0 */
/* study_private.h: what the files that read a study share. */
#ifndef STUDY_PRIVATE_H
#define STUDY_PRIVATE_H

#include "study.h"

#define STUDY_FACTORS_MAX 16

/* Sections whose keys are no plain values. */
extern const char *const study_sections[];
extern const int32_t study_n_sections;

mhe_status study_read_factors(study *s, mhe_error *err);
/* Conditions of all grids. */
mhe_status study_read_grids(study *s, mhe_error *err);
/* The level with this label; -1 if there is none. */
int32_t study_find_level(const factor *f, const char *label);
/* The level that a value in a grid means, added where the factor is open. MHE_E_CONFIG. */
mhe_status study_take_level(study *s, factor *f, const mhi_node *value, int32_t *found,
                            mhe_error *err);
mhe_status study_no_memory(mhe_error *err);

#endif
