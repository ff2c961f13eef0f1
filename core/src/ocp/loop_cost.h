/* SPDX-License-Identifier: Apache-2.0 */
/* loop_cost.h: the terms that a problem gets by itself where its model has loops. */
#ifndef MHI_LOOP_COST_H
#define MHI_LOOP_COST_H

#include "ocp/term.h"

#define MHI_LOOP_TERMS 2

/* Residuals: the gaps of the loops, and their rates, each with a sigma far below what is measured.
 * The system's motion keeps closed loops closed; these find the closed ones. */
extern const mhi_term_setup mhi_loop_terms[MHI_LOOP_TERMS];

#endif
