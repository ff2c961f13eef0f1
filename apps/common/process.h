/* SPDX-License-Identifier: Apache-2.0 */
/* process.h: other programs. */
#ifndef PROCESS_H
#define PROCESS_H

#include "base/arena.h"

/* Path of a program in the folder of this one. MHE_E_INPUT: it is not there. */
mhe_status process_beside(const char *name, mhi_arena *arena, const char **path, mhe_error *err);
/* Path of a file of the installation, "share/..." beside the programs' folder. MHE_E_INPUT. */
mhe_status process_share(const char *name, mhi_arena *arena, const char **path, mhe_error *err);

/* Runs argv (NULL-terminated; argv[0] without '/' is looked up in PATH) and waits. `quiet`: its
 * stdout is dropped. MHE_E_IO: it cannot be started, or fails; its own message is on stderr. */
mhe_status process_run(const char *const *argv, int quiet, mhe_error *err);
/* The same, with its standard output as text. */
mhe_status process_read(const char *const *argv, mhi_arena *arena, const char **text,
                        mhe_error *err);

#endif
