/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* dladdr */
#include "plugin/loader.h"

#include "plugin/check.h"
#include "plugin/guard.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <link.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

static mhe_status truncated(mhe_error *err) {
    return mhe_fail(err, MHE_E_PLUGIN, "the file is truncated");
}

static mhe_status unreadable(mhe_error *err) {
    return mhe_fail(err, errno == ENOMEM ? MHE_E_MEMORY : MHE_E_PLUGIN, "cannot be read: %s",
                    strerror(errno));
}

/* dlopen maps a file without asking whether it is whole and then dies of SIGBUS where it is not, so
 * the parts that the ELF header promises are looked for first. */
static mhe_status check_elf(int file, off_t size, mhe_error *err) {
    ElfW(Ehdr) head;
    ssize_t got = pread(file, &head, sizeof head, 0);
    if (got < 0) {
        return unreadable(err);
    }
    if (got < (ssize_t)SELFMAG || memcmp(head.e_ident, ELFMAG, SELFMAG) != 0) {
        return mhe_fail(err, MHE_E_PLUGIN, "not a shared object (no ELF header)");
    }
    if (got < (ssize_t)sizeof head) {
        return truncated(err);
    }
    if (head.e_ident[EI_CLASS] != (sizeof(void *) == 8 ? ELFCLASS64 : ELFCLASS32) ||
        head.e_type != ET_DYN || head.e_phentsize != sizeof(ElfW(Phdr))) {
        return mhe_fail(err, MHE_E_PLUGIN, "not a shared object for this machine");
    }
    const ElfW(Off) end = (ElfW(Off))size;
    if (head.e_shoff > end || (ElfW(Off))head.e_shnum * head.e_shentsize > end - head.e_shoff) {
        return truncated(err);
    }
    for (int i = 0; i < head.e_phnum; i++) {
        ElfW(Phdr) part;
        const ElfW(Off) at = head.e_phoff + (ElfW(Off))i * sizeof part;
        got = at > end ? 0 : pread(file, &part, sizeof part, (off_t)at);
        if (got < 0) {
            return unreadable(err);
        }
        if (got != (ssize_t)sizeof part || part.p_offset > end ||
            part.p_filesz > end - part.p_offset) {
            return truncated(err);
        }
    }
    return MHE_OK;
}

static mhe_status check_file(const char *path, mhe_error *err) {
    int file = open(path, O_RDONLY | O_CLOEXEC);
    struct stat info;
    mhe_status status = MHE_OK;
    if (file < 0 || fstat(file, &info) != 0) {
        status = unreadable(err);
    } else if (!S_ISREG(info.st_mode)) {
        status = mhe_fail(err, MHE_E_PLUGIN, "not a file");
    } else {
        status = check_elf(file, info.st_size, err);
    }
    if (file >= 0) {
        (void)close(file);
    }
    return status;
}

/* dlerror() without the path that it starts with. */
static const char *link_error(const char *path) {
    const char *text = dlerror();
    if (text == NULL) {
        return "unknown error of the dynamic linker";
    }
    size_t n = strlen(path);
    return strncmp(text, path, n) == 0 && strncmp(text + n, ": ", 2) == 0 ? text + n + 2 : text;
}

/* Is that a lack of memory? The linker says it in many ways: of a file that it cannot open or of a
 * segment that it cannot map without the reason, which of a segment may also be that files of that
 * disk are not to be run. */
static int is_short_of_memory(const char *path, const char *why) {
    static const char *const ways[] = {"out of memory", "cannot allocate",
                                       "cannot map zero-fill pages", "cannot create cache",
                                       "cannot create shared object descriptor"};
    static const char unopened[] = "cannot open shared object file";
    for (size_t i = 0; i < sizeof ways / sizeof ways[0]; i++) {
        if (strstr(why, ways[i]) != NULL) {
            return 1;
        }
    }
    const size_t length = strlen(why), tail = sizeof unopened - 1;
    if (length >= tail && strcmp(why + length - tail, unopened) == 0) {
        return 1;
    }
    struct statvfs disk;
    return strstr(why, strerror(ENOMEM)) != NULL ||
           (strstr(why, "failed to map segment") != NULL && statvfs(path, &disk) == 0 &&
            (disk.f_flag & ST_NOEXEC) == 0);
}

typedef struct entry_call {
    mhe_plugin_entry_function entry;
    const mhe_library *library;
} entry_call;

static mhe_status call_entry(void *data) {
    entry_call *c = data;
    c->library = c->entry();
    return MHE_OK;
}

static mhe_status load(const char *path, const mhe_library **library, mhe_error *err) {
    void *handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (handle == NULL) {
        const char *why = link_error(path);
        return mhe_fail(err, is_short_of_memory(path, why) ? MHE_E_MEMORY : MHE_E_PLUGIN,
                        "cannot be linked: %.500s", why);
    }
    entry_call call = {0};
    void *symbol = dlsym(handle, MHE_PLUGIN_ENTRY);
    if (symbol == NULL) {
        return mhe_fail(err, MHE_E_PLUGIN, "not a plugin (no symbol %s)", MHE_PLUGIN_ENTRY);
    }
    memcpy(&call.entry, &symbol, sizeof call.entry);
    mhi_guard_watch(handle);
    mhe_error thrown = {0};
    if (mhi_guard(call_entry, &call, &thrown) != MHE_OK) {
        return mhe_fail(err, MHE_E_PLUGIN, "%s() %.500s", MHE_PLUGIN_ENTRY, thrown.text);
    }
    *library = call.library;
    return MHE_OK;
}

mhe_status mhi_loader_open(const char *path, mhi_arena *arena, const mhe_plugin *const **plugins,
                           int32_t *n_plugins, mhe_error *err) {
    const mhe_library *library = NULL;
    mhe_status status = check_file(path, err);
    if (status == MHE_OK) {
        status = load(path, &library, err);
    }
    if (status == MHE_OK) {
        status = mhi_check_library(library, err);
    }
    if (status != MHE_OK) {
        return status;
    }
    const int32_t n = (int32_t)library->plugin_count;
    const mhe_plugin **list = MHI_TAKE(arena, const mhe_plugin *, n);
    if (list == NULL) {
        return mhe_fail(err, MHE_E_MEMORY, "out of memory");
    }
    for (int32_t i = 0; i < n; i++) {
        status = mhi_check_plugin(library->plugins[i], arena, &list[i], err);
        if (status != MHE_OK) {
            return status;
        }
        for (int32_t j = 0; j < i; j++) {
            if (strcmp(list[i]->id, list[j]->id) == 0) {
                return mhe_fail(err, MHE_E_PLUGIN, "two plugins of the library have the id '%s'",
                                list[i]->id);
            }
        }
    }
    *plugins = list;
    *n_plugins = n;
    return MHE_OK;
}

mhe_status mhi_plugin_library(const mhe_plugin *plugin, const char **path, mhe_error *err) {
    Dl_info place; /* of its texts: the descriptor may be a copy */
    if (dladdr(plugin->id, &place) == 0 || place.dli_fname == NULL) {
        return mhe_fail(err, MHE_E_INPUT, "%s: its file is not known", plugin->id);
    }
    *path = place.dli_fname;
    return MHE_OK;
}
