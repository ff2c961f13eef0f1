/* SPDX-License-Identifier: Apache-2.0 */
/* reference_picture.h: the motions of a reference, one over the other. */
#ifndef REFERENCE_PICTURE_H
#define REFERENCE_PICTURE_H

#include <mhe/abi.h>

/* Reads dir/<output>/reference.sto of the first few outputs [n] and draws dir/motion.svg: joint
 * angles and the excitations of the muscles that are excited most. The columns are those that
 * simulation_files names, of n_q coordinates and n_m muscles. MHE_E_UNSUPPORTED: no gnuplot. */
mhe_status reference_picture(const char *dir, const char *const *outputs, int32_t n, int32_t n_q,
                             int32_t n_m, mhe_error *err);

#endif
