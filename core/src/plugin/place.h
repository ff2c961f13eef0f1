/* SPDX-License-Identifier: Apache-2.0 */
/* place.h: where this library (or the program that holds it) lies, and what was installed with it.
 * Nothing here depends on the working directory or on the environment. */
#ifndef MHI_PLACE_H
#define MHI_PLACE_H

#include "base/arena.h"

#define MHI_PLACES 3

/* Absolute paths where something installed may be: as seen from the library, as seen from a program
 * in bin/, and where the build was told to install to; for what lies in the build tree that tree
 * instead. */
typedef struct mhi_places {
    const char *path[MHI_PLACES];
    int32_t n;
} mhi_places;

/* Folders of plugins. MHE_E_MEMORY. [cold] */
mhe_status mhi_places_of_plugins(mhi_arena *arena, mhi_places *places, mhe_error *err);
/* "share/mhe/<name>". MHE_E_MEMORY. [cold] */
mhe_status mhi_places_of_data(mhi_arena *arena, const char *name, mhi_places *places,
                              mhe_error *err);

#endif
