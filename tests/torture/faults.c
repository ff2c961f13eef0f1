/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE
#include "faults.h"

#include <errno.h>
#include <execinfo.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define OF_TEST __attribute__((visibility("default")))

/* The allocator behind the names that this file takes over. */
extern void *__libc_malloc(size_t size);                     /* NOLINT: reserved names, glibc's */
extern void *__libc_calloc(size_t n, size_t size);           /* NOLINT */
extern void *__libc_realloc(void *old, size_t size);         /* NOLINT */
extern void *__libc_memalign(size_t alignment, size_t size); /* NOLINT */

static atomic_long count, fail_at;
static atomic_int armed, and_onwards;
static const char *trace_path;

static void trace(void) {
    void *frames[40];
    const char *path = trace_path;
    const int file = path == NULL ? -1 : open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (file >= 0) {
        backtrace_symbols_fd(frames, backtrace(frames, 40), file);
        (void)close(file);
    }
}

static int fails(void) {
    if (!armed) {
        return 0;
    }
    const long k = ++count;
    if (fail_at > 0 && (and_onwards ? k >= fail_at : k == fail_at)) {
        if (k == fail_at && trace_path != NULL) {
            armed = 0;
            trace();
            armed = 1;
        }
        errno = ENOMEM;
        return 1;
    }
    return 0;
}

void faults_arm(long k, int onwards) {
    count = 0;
    fail_at = k;
    and_onwards = onwards;
    armed = 1;
}

long faults_disarm(void) {
    armed = 0;
    return count;
}

OF_TEST void *malloc(size_t size) {
    return fails() ? NULL : __libc_malloc(size);
}

OF_TEST void *calloc(size_t n, size_t size) {
    return fails() ? NULL : __libc_calloc(n, size);
}

OF_TEST void *realloc(void *old, size_t size) {
    return fails() ? NULL : __libc_realloc(old, size);
}

OF_TEST void *aligned_alloc(size_t alignment, size_t size) {
    return fails() ? NULL : __libc_memalign(alignment, size);
}

OF_TEST int posix_memalign(void **out, size_t alignment, size_t size) {
    *out = fails() ? NULL : __libc_memalign(alignment, size);
    return *out == NULL ? ENOMEM : 0;
}

/* ---- by the environment ---- */

__attribute__((constructor)) static void begin(void) {
    const char *which = getenv("TORTURE_ALLOCATION");
    void *frame = NULL;
    (void)backtrace(&frame, 1); /* loads what it needs now */
    trace_path = getenv("TORTURE_TRACE");
    if (which != NULL) {
        faults_arm(strtol(which, NULL, 10), strchr(which, '+') != NULL);
    }
}

__attribute__((destructor)) static void end(void) {
    const char *path = getenv("TORTURE_COUNT");
    if (path != NULL) {
        const long n = faults_disarm();
        FILE *file = fopen(path, "w");
        if (file != NULL) {
            (void)fprintf(file, "%ld\n", n);
            (void)fclose(file);
        }
    }
}
