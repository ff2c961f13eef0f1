/* SPDX-License-Identifier: Apache-2.0 */
/* allocations.c: definitions of malloc and its kin that count and hand on to the C library's. A
 * program's own definitions come before the library's, for shared objects loaded RTLD_LOCAL too.
 * Not in sanitizer builds: they bring their own. */
#include "allocations.h"

#include <errno.h>
#include <mhe/abi.h>
#include <stdatomic.h>
#include <stdlib.h>

/* glibc's own entry points; what they return goes to the ordinary free(). */
extern void *__libc_malloc(size_t size);              /* NOLINT: reserved name, glibc's */
extern void *__libc_calloc(size_t n, size_t size);    /* NOLINT */
extern void *__libc_realloc(void *old, size_t size);  /* NOLINT */
extern void *__libc_memalign(size_t at, size_t size); /* NOLINT */

static _Thread_local uint64_t count;
static atomic_uint_fast64_t count_of_all;

uint64_t mhi_allocations(void) {
    return count;
}

uint64_t mhi_allocations_of_all(void) {
    return atomic_load(&count_of_all);
}

static void add(void) {
    count++;
    atomic_fetch_add(&count_of_all, 1);
}

MHE_EXPORT void *malloc(size_t size) {
    add();
    return __libc_malloc(size);
}

MHE_EXPORT void *calloc(size_t n, size_t size) {
    add();
    return __libc_calloc(n, size);
}

MHE_EXPORT void *realloc(void *old, size_t size) {
    add();
    return __libc_realloc(old, size);
}

MHE_EXPORT void *aligned_alloc(size_t alignment, size_t size) {
    add();
    return __libc_memalign(alignment, size);
}

MHE_EXPORT int posix_memalign(void **out, size_t alignment, size_t size) {
    add();
    *out = __libc_memalign(alignment, size);
    return *out != NULL ? 0 : ENOMEM;
}
