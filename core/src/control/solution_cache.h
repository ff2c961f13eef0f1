/* SPDX-License-Identifier: Apache-2.0 */
/* solution_cache.h: solutions of steps on disk, each under all it was made from. */
#ifndef MHI_SOLUTION_CACHE_H
#define MHI_SOLUTION_CACHE_H

#include "base/text.h"
#include "control/step.h"

/* Appends all a step's solution depends on: the resolved config, the step without its name and
 * output, and the contents of the model, of files and earlier solutions it refers to, of the
 * plugins it uses and of the program itself. What cannot be read is MHE_E_INPUT: such a step has no
 * key. [cold] */
mhe_status mhi_solution_key(const mhi_step_setup *setup, mhi_text *key, mhe_error *err);

/* Fills `t`, taken for the step, and `info` from the file of this key in the folder. 0 where there
 * is none that is whole and made from the very same; `t` may then have been written to. [cold] */
int32_t mhi_solution_read(const char *dir, const mhi_text *key, mhi_trajectory *t,
                          mhe_solve_info *info);
/* MHE_E_IO: nothing is stored. [cold] */
mhe_status mhi_solution_write(const char *dir, const mhi_text *key, const mhi_trajectory *t,
                              const mhe_solve_info *info, mhe_error *err);

#endif
