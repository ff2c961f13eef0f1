/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* dladdr */
#include "lsl_library.h"

#include <dlfcn.h>
#include <string.h>

/* The library that lies beside this plugin, or in the folder above. */
static void *open_beside(const char *folder_of, const char *name) {
    char path[4096];
    const char *slash = strrchr(folder_of, '/');
    const int length = slash == NULL ? 0 : (int)(slash - folder_of);
    const int n = snprintf(path, sizeof path, "%.*s/%s", length, folder_of, name);
    return slash == NULL || n < 0 || n >= (int)sizeof path ? NULL
                                                           : dlopen(path, RTLD_NOW | RTLD_LOCAL);
}

/* Data of this plugin, whose place tells where its file lies. */
static const char here_i_am[] = "source";

static void *open_any(const char *path) {
    static const char *const system[] = {"liblsl.so.2", "liblsl.so", "liblsl64.so"};
    if (path != NULL) {
        return dlopen(path, RTLD_NOW | RTLD_LOCAL);
    }
    void *found = NULL;
    for (size_t i = 0; i < sizeof system / sizeof *system && found == NULL; i++) {
        found = dlopen(system[i], RTLD_NOW | RTLD_LOCAL);
    }
    Dl_info here;
    if (found == NULL && dladdr(here_i_am, &here) != 0 && here.dli_fname != NULL) {
        found = open_beside(here.dli_fname, "lib/liblsl64.so");
    }
    return found;
}

mhe_status lsl_load(const char *path, lsl_library *out, mhe_error *err) {
    void *library = open_any(path);
    if (library == NULL) {
        const char *why = dlerror();
        return path == NULL
                   ? mhe_fail(err, MHE_E_IO,
                              "Lab Streaming Layer needs liblsl, which is not there: run "
                              "vendor/take (as ./bootstrap does) and configure again, or install "
                              "it, or name its file by 'library'")
                   : mhe_fail(err, MHE_E_IO, "library: liblsl cannot be loaded: %s",
                              why == NULL ? path : why);
    }
    const char *missing = NULL;
#define LSL_TAKE(name, result, arguments)                  \
    do {                                                   \
        void *symbol = dlsym(library, "lsl_" #name);       \
        memcpy(&out->name, &symbol, sizeof out->name);     \
        missing = symbol == NULL ? "lsl_" #name : missing; \
    } while (0);
    LSL_FUNCTIONS(LSL_TAKE)
#undef LSL_TAKE
    return missing == NULL ? MHE_OK
                           : mhe_fail(err, MHE_E_IO,
                                      "liblsl lacks the function %s: is it older "
                                      "than 1.10?",
                                      missing);
}
