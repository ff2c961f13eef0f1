/* SPDX-License-Identifier: Apache-2.0 */
/* external_loads.h: OpenSim's ExternalLoads (.xml with a .mot or .sto), as mhe/force.h offers them.
 */
#ifndef MHI_EXTERNAL_LOADS_H
#define MHI_EXTERNAL_LOADS_H

#include <mhe/force.h>

extern const mhe_external_loads_service mhi_external_loads;

#endif
