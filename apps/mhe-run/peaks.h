/* SPDX-License-Identifier: Apache-2.0 */
/* peaks.h: the largest reactions and residual forces of a run, and the largest load beside them. */
#ifndef PEAKS_H
#define PEAKS_H

#include <mhe/estimator.h>

typedef struct peaks {
    int32_t n_joints, n_residuals, n_estimates;
    double *force, *moment, *time; /* [n_joints] N, N m, s of the force */
    double *residual, *squares;    /* [n_residuals] largest, sum of squares */
    double load;                   /* N, the largest force of an input that is one */
} peaks;

mhe_status peaks_open(peaks *p, const mhe_estimator_info *info, mhe_error *err);
void peaks_add(peaks *p, const mhe_estimate *estimate);
void peaks_free(peaks *p);

#endif
