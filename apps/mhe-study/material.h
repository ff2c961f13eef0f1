/* SPDX-License-Identifier: Apache-2.0 */
/* material.h: what trials are made of: models and reference motions, read once for all workers. */
#ifndef MATERIAL_H
#define MATERIAL_H

#include "study.h"

typedef struct material_model {
    const mhi_model_section *section;
    mhe_description *description;
} material_model;

typedef struct material_motion {
    const char *path;
    const material_model *model;
    mhi_recording *recording;
} material_motion;

typedef struct material {
    material_model *models; /* [n_models] */
    material_motion *motions;
    int32_t n_models, n_motions;
    mhi_arena arena;
} material;

/* Every condition's motion has a file, or will be made by the study's reference_config: checked
 * before anything is computed. */
mhe_status material_check(const study *s, mhi_registry *registry, mhe_error *err);
/* Makes the motions that are missing in dir/motions with the mhe-sim beside this program. */
mhe_status material_make(const study *s, const char *dir, int quiet, mhe_error *err);
/* Reads models and motions and gives them to the conditions; motions below `dir` that were not made
 * yet are left out where `dir` is NULL. Give it back with material_free, also after a failure. */
mhe_status material_load(study *s, const char *dir, const mhe_host *host, material *m,
                         mhe_error *err);
void material_free(material *m);

#endif
