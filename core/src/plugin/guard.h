/* SPDX-License-Identifier: Apache-2.0 */
/* guard.h: cold calls into a plugin that survive a C++ exception thrown out of it. */
#ifndef MHI_GUARD_H
#define MHI_GUARD_H

#include <mhe/abi.h>

/* Runs call(data). An exception that would have left the plugin ends the call instead:
 * MHE_E_PLUGIN. [cold] */
mhe_status mhi_guard(mhe_status (*call)(void *data), void *data, mhe_error *err);

#endif
