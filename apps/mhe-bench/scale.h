/* SPDX-License-Identifier: Apache-2.0 */
/* scale.h: how a frame's time grows with coordinates and muscles. */
#ifndef SCALE_H
#define SCALE_H

#include "arguments.h"
#include "bench.h"

/* Makes models of several sizes in the folder a->out (./out/scale), has mhe-sim, which lies beside
 * this program, move them, times the estimator on each and prints a table with the exponents. */
mhe_status scale_measure(const arguments *a, mhi_registry *registry, const mhe_host *host,
                         mhe_error *err);

#endif
