/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* dladdr1, realpath */
#include "plugin/place.h"

#include <dlfcn.h>
#include <limits.h>
#include <link.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The folder that this code was loaded from: that of libmhe.so, or of the program where the core
 * is linked statically. "" where it cannot be told. */
static void own_folder(char folder[PATH_MAX]) {
    static const char here = 0; /* an address inside this object */
    Dl_info info;
    struct link_map *map = NULL;
    folder[0] = '\0';
    if (dladdr1(&here, &info, (void **)&map, RTLD_DL_LINKMAP) == 0 || map == NULL) {
        return;
    }
    /* The program itself has no name in the linker's list. */
    if (realpath(map->l_name[0] == '\0' ? "/proc/self/exe" : map->l_name, folder) == NULL) {
        folder[0] = '\0';
        return;
    }
    char *slash = strrchr(folder, '/');
    if (slash != NULL) {
        *slash = '\0';
    }
}

static int is_below(const char *path, const char *folder) {
    char real[PATH_MAX];
    if (realpath(folder, real) == NULL) {
        return 0;
    }
    const size_t n = strlen(real);
    return strncmp(path, real, n) == 0 && (path[n] == '/' || path[n] == '\0');
}

/* `from_library` and `from_program` are relative to where those lie, the others absolute. What is
 * installed does not depend on who may write where it was built. */
static mhe_status places(mhi_arena *arena, const char *from_library, const char *from_program,
                         const char *installed, const char *built, const char *name,
                         mhi_places *out, mhe_error *err) {
    char folder[PATH_MAX];
    const char *slash = name[0] == '\0' ? "" : "/";
    own_folder(folder);
    *out = (mhi_places){.n = 0};
    if (folder[0] != '\0') {
        out->path[out->n++] =
            mhi_arena_format(arena, "%s/%s%s%s", folder, from_library, slash, name);
        out->path[out->n++] =
            mhi_arena_format(arena, "%s/%s%s%s", folder, from_program, slash, name);
    }
    out->path[out->n++] = mhi_arena_format(
        arena, "%s%s%s", is_below(folder, MHE_BUILD_DIR) ? built : installed, slash, name);
    for (int32_t i = 0; i < out->n; i++) {
        if (out->path[i] == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
    }
    return MHE_OK;
}

mhe_status mhi_places_of_plugins(mhi_arena *arena, mhi_places *out, mhe_error *err) {
    return places(arena, MHE_PLUGINS_FROM_LIBRARY, MHE_PLUGINS_FROM_PROGRAM, MHE_PLUGINS_INSTALLED,
                  MHE_PLUGINS_BUILT, "", out, err);
}

mhe_status mhi_places_of_data(mhi_arena *arena, const char *name, mhi_places *out, mhe_error *err) {
    return places(arena, MHE_DATA_FROM_LIBRARY, MHE_DATA_FROM_PROGRAM, MHE_DATA_INSTALLED,
                  MHE_DATA_BUILT, name, out, err);
}
