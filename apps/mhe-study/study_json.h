/* SPDX-License-Identifier: Apache-2.0 */
/* study_json.h: the study for the report. */
#ifndef STUDY_JSON_H
#define STUDY_JSON_H

/* name, file (absolute), set (--set), version, machine, seed, measure, exclude_below, n_trials,
 * factors with their labels in order, report (the section as it stands), conditions with labels,
 * trials, motion file and the noise's size. */
#include "study.h"

/* File and assignments of dir/study.json: how the study of a results folder was called. Texts live
 * in `arena`. MHE_E_INPUT: the folder holds no study. */
mhe_status study_json_origin(const char *dir, mhi_arena *arena, const char **file,
                             const char ***set, int32_t *n_set, mhe_error *err);

mhe_status study_json(const study *s, mhi_text *out, mhe_error *err);

#endif
