/* SPDX-License-Identifier: Apache-2.0 */
/* fit_private.h: between the files that make fits. */
#ifndef SIMBODY_FIT_PRIVATE_H
#define SIMBODY_FIT_PRIVATE_H

#include "context.h"
#include "fit.h"

#define TRAINING 1600
#define VALIDATION 400
#define TEST 800
#define POSES (TRAINING + VALIDATION + TEST)

/* Poses of all coordinates, with lengths and gradients of all paths there. */
typedef struct samples {
    int32_t n_q, n_p;
    double *q, *length, *gradient; /* [POSES x n_q], [POSES x n_p], [POSES x n_p x n_q] */
    double *lower, *upper;
} samples;

/* Poses over the share `range` of the coordinates' ranges, always the same ones. What the model
 * says. [cold] */
mhe_status samples_make(const mhe_description *description, void *model, double range, samples *s,
                        mhe_error *err);
void samples_free(samples *s);

/* Largest jumps where conditional points go on or off, of every path. [cold] */
mhe_status samples_jumps(const mhe_description *description, const samples *s, void *model,
                         path_fits *fits, mhe_error *err);

/* Fits one path; 0: done, whether it is fitted or stays. [cold] */
int fit_path(const simbody_model *model, const samples *s, int32_t path, double tolerance,
             path_fit *fit);

#endif
