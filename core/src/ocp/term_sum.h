/* SPDX-License-Identifier: Apache-2.0 */
/* term_sum.h: adds the residuals of a term, with their rows in the workspace, to gradient and
 * Hessian (Gauss-Newton). */
#ifndef MHI_OCP_TERM_SUM_H
#define MHI_OCP_TERM_SUM_H

#include "ocp/term.h"

/* Each residual of one entry of y alone. [hot] */
void mhi_term_sum_diagonal(const mhi_term *t, mhi_term_workspace *w, const mhi_signals *signals,
                           const double *jacobian, double scale, int32_t n_z, mhi_term_sum *sum);
/* Each of all of them. [hot] */
void mhi_term_sum_dense(const mhi_term *t, mhi_term_workspace *w, const mhi_signals *signals,
                        const double *jacobian, double scale, int32_t n_z, mhi_term_sum *sum);

#endif
