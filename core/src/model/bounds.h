/* SPDX-License-Identifier: Apache-2.0 */
/* bounds.h: the general bounds that a run's section `bounds` states. */
#ifndef MHI_BOUNDS_H
#define MHI_BOUNDS_H

#include "config/run.h"
#include "model/system.h"

/* Arrays from the arena. MHE_E_CONFIG: no such coordinate, no number. [cold] */
mhe_status mhi_bounds_read(const mhi_run *run, const mhe_description *description, mhi_arena *arena,
                           mhi_bounds *bounds, mhe_error *err);

#endif
