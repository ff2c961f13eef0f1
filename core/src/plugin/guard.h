/* SPDX-License-Identifier: Apache-2.0 */
/* guard.h: cold calls into a plugin that survive a C++ exception thrown out of it.
 *
 * How: an exception that finds no handler never unwinds: the C++ runtime calls std::terminate with
 * the whole stack still in place. A terminate handler of ours, set in the runtime that the plugin
 * brought along, jumps from there back into mhi_guard.
 *
 * Why that is sound enough: between the guard and the throw there are only frames of the plugin and
 * of the C++ runtime, and a cold call holds no lock of ours. Those frames are dropped without their
 * destructors, so whatever they owned leaks and the instance must be given up.
 *
 * Limits: an exception in a library constructor still ends the process (a jump out of dlopen would
 * leave its lock held); in a C++ application with a handler further up, the exception goes there; a
 * runtime linked statically into a plugin and hidden cannot be reached; abort() is abort(). */
#ifndef MHI_GUARD_H
#define MHI_GUARD_H

#include <mhe/abi.h>

/* Runs call(data). An exception that would have left the plugin ends the call instead:
 * MHE_E_PLUGIN. Calls may nest. [any] */
mhe_status mhi_guard(mhe_status (*call)(void *data), void *data, mhe_error *err);

/* Arms the guard for the C++ runtime that `library` (of dlopen) uses, if it uses one. The loader
 * calls it. [any] */
void mhi_guard_watch(void *library);

#endif
