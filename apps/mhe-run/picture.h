/* SPDX-License-Identifier: Apache-2.0 */
/* picture.h: estimated against true joint angles and muscle forces, drawn by gnuplot. */
#ifndef MHE_RUN_PICTURE_H
#define MHE_RUN_PICTURE_H

#include <mhe/abi.h>

/* From dir/estimates.sto and dir/forces.sto (complete), and `reference` (a .sto with columns q_*
 * and F_*, or NULL), writes dir/estimates.gp, which holds its data and can be edited and run again,
 * and with gnuplot makes dir/estimates.svg of it. Coordinates are shown as angles in degrees;
 * of many muscles those with the largest forces are shown. MHE_E_UNSUPPORTED: gnuplot is not
 * installed; the script is there. [cold] */
mhe_status picture_estimates(const char *dir, const char *reference, mhe_error *err);

#endif
