/* SPDX-License-Identifier: Apache-2.0 */
/* exports.c: a plugin library shows the world mhe_plugin_entry and nothing else. */
#include "kit.h"

#include <fcntl.h>
#include <link.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#define SYMBOL_TYPE(s) ((s)->st_info & 0xf)
#define SYMBOL_BIND(s) ((s)->st_info >> 4)

/* The dynamic symbols of a mapped shared object whose tables the loader has already accepted. */
static void check_symbols(mhi_kit *kit, const char *base, size_t size) {
    const char *check = "exports mhe_plugin_entry alone";
    const ElfW(Ehdr) *head = (const void *)base;
    const ElfW(Shdr) *sections = (const void *)(base + head->e_shoff);
    int n_templates = 0;
    for (int i = 0; i < head->e_shnum; i++) {
        const ElfW(Shdr) *s = &sections[i];
        if (s->sh_type != SHT_DYNSYM || s->sh_link >= head->e_shnum ||
            s->sh_offset + s->sh_size > size) {
            continue;
        }
        const ElfW(Sym) *symbols = (const void *)(base + s->sh_offset);
        const char *names = base + sections[s->sh_link].sh_offset;
        for (size_t k = 0; k < s->sh_size / sizeof *symbols; k++) {
            const ElfW(Sym) *symbol = &symbols[k];
            if (symbol->st_shndx == SHN_UNDEF || symbol->st_shndx == SHN_ABS ||
                SYMBOL_BIND(symbol) == STB_LOCAL ||
                strcmp(names + symbol->st_name, MHE_PLUGIN_ENTRY) == 0) {
                continue;
            }
            /* C++ library templates are visible whatever the plugin asks for */
            if (SYMBOL_BIND(symbol) != STB_GLOBAL) {
                n_templates++;
                continue;
            }
            mhi_kit_fail(kit, check, "%s is visible too", names + symbol->st_name);
            return;
        }
    }
    mhi_kit_pass(kit, check);
    if (n_templates > 0) {
        mhi_kit_note(kit, check, "%d C++ template symbols are visible too", n_templates);
    }
}

void mhi_check_exports(mhi_kit *kit, const char *file) {
    int fd = open(file, O_RDONLY | O_CLOEXEC);
    struct stat info;
    if (fd < 0 || fstat(fd, &info) != 0) {
        mhi_kit_fail(kit, "exports", "the file cannot be read");
    } else {
        void *base = mmap(NULL, (size_t)info.st_size, PROT_READ, MAP_PRIVATE, fd, 0);
        if (base != MAP_FAILED) {
            check_symbols(kit, base, (size_t)info.st_size);
            (void)munmap(base, (size_t)info.st_size);
        }
    }
    if (fd >= 0) {
        (void)close(fd);
    }
}
