/* SPDX-License-Identifier: Apache-2.0 */
/* picture.h: rate against window. */
#ifndef PICTURE_H
#define PICTURE_H

#include "bench.h"

/* Makes dir/rate.gp and dir/rate.svg of the first twenty groups. MHE_E_UNSUPPORTED: gnuplot is not
 * installed. */
mhe_status picture_rate(const bench *b, const char *dir, mhe_error *err);

#endif
