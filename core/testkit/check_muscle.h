/* SPDX-License-Identifier: Apache-2.0 */
/* check_muscle.h: what the parts of the muscles' check share. */
#ifndef CHECK_MUSCLE_H
#define CHECK_MUSCLE_H

#include "kit.h"

#include <mhe/muscle.h>

#define N_M 4 /* made-up muscles */
#define MAX_S (MHE_MUSCLE_MAX_STATES * N_M)

typedef struct muscle_case {
    const mhe_muscle_ops *ops;
    void *self;
    mhe_muscle_layout layout;
    int32_t n_s; /* states of all muscles: layout.n_states N_M */
    mhi_probe probe;
} muscle_case;

enum { EXCITATION, STATE, LENGTH, VELOCITY, N_IN };
enum { FORCE, FORCE_S, FORCE_L, FORCE_W, RATE, RATE_E, RATE_S, RATE_L, RATE_W, N_OUT };

/* Entries that no muscle has mean nothing: whatever the plugin left there becomes 0. */
void mhi_muscle_blank(const muscle_case *c, double *values);
/* evaluate() as a probe calls it; `data` is the case. */
mhe_status mhi_muscle_evaluate(void *data, void *worker, void *scratch, const double *const *in,
                               double *const *out, mhe_error *err);
/* check_muscle_parameters.c: derivatives by parameters at the point `in`. */
void mhi_check_muscle_parameters(mhi_kit *kit, const muscle_case *c, const mhe_muscle *muscles,
                                 const double *const *in);

#endif
