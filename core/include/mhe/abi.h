/* SPDX-License-Identifier: Apache-2.0 */
/* abi.h: version of the binary interface, status codes, errors.
 *
 * Everything that crosses between the core and a plugin is constant data plus functions. Public
 * structs hold only fixed-width integers, double, pointers and NUL-terminated UTF-8; they grow only
 * at their end and start with their own size in bytes where they may grow. */
#ifndef MHE_ABI_H
#define MHE_ABI_H

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

#define MHE_MAGIC 0x4d484531u /* "MHE1" */
/* While the major number is 0 the minor number must match too. */
#define MHE_ABI_MAJOR 0
#define MHE_ABI_MINOR 2

/* MHE_EXPORT: the entry of a plugin. MHE_API: a function of libmhe.so. */
#if defined(__GNUC__)
#define MHE_EXPORT __attribute__((visibility("default")))
#define MHE_PRINTF(at, first) __attribute__((format(printf, at, first)))
#else
#define MHE_EXPORT
#define MHE_PRINTF(at, first)
#endif
#define MHE_API MHE_EXPORT

/* 0: done. Positive: this point is no good, another may be (solvers and integrators shorten the
 * step). Negative: give up. */
typedef int32_t mhe_status;

#define MHE_STATUS_LIST(X)                                                              \
    X(MHE_OK, 0, "done")                                                                \
    X(MHE_RETRY, 1, "no value at this point; another point may have one")               \
    X(MHE_E_ARGUMENT, -1, "an argument is not valid")                                   \
    X(MHE_E_MEMORY, -2, "out of memory")                                                \
    X(MHE_E_CONFIG, -3, "the configuration is wrong")                                   \
    X(MHE_E_INPUT, -4, "an input file is wrong")                                        \
    X(MHE_E_PLUGIN, -5, "a plugin is missing or was refused")                           \
    X(MHE_E_UNSUPPORTED, -6, "the model or file holds something that is not supported") \
    X(MHE_E_NUMERIC, -7, "the computation failed")                                      \
    X(MHE_E_IO, -8, "a file could not be written")                                      \
    X(MHE_E_INTERRUPTED, -9, "interrupted by the caller")                               \
    X(MHE_E_INTERNAL, -10, "a bug in the framework or in a plugin")

enum {
#define MHE_STATUS_ENUM(name, value, text) name = value,
    MHE_STATUS_LIST(MHE_STATUS_ENUM)
#undef MHE_STATUS_ENUM
};

#define MHE_ERROR_TEXT 768

/* Whose refusal an error is. */
#define MHE_PART_NONE 0
#define MHE_PART_MODEL 1
#define MHE_PART_MUSCLE 2
#define MHE_PART_INTEGRATOR 3
#define MHE_PART_SOLVER 4
#define MHE_PART_COST 5  /* number `entry` of the list */
#define MHE_PART_FORCE 6 /* number `entry` of the list */

/* Detail of a failure, owned by the caller; may be NULL wherever it is taken. [any] */
typedef struct mhe_error {
    int32_t code;
    char text[MHE_ERROR_TEXT]; /* one line, no trailing newline */
    int32_t part;  /* MHE_PART_*: the plugin that refused; the core sets it, mhe_fail leaves it */
    int32_t entry; /* of a list, from 0 */
} mhe_error;

/* Writes the detail and returns `code`, so that `return mhe_fail(...)` reads well. A NULL `err` is
 * allowed. [any] */
MHE_PRINTF(3, 4)
static inline mhe_status mhe_fail(mhe_error *err, mhe_status code, const char *format, ...) {
    if (err != NULL) {
        va_list args;
        va_start(args, format);
        err->code = code;
        (void)vsnprintf(err->text, sizeof err->text, format, args);
        va_end(args);
        for (char *c = err->text; *c != '\0'; c++) { /* one line, whatever a file put into it */
            if ((unsigned char)*c < ' ' || *c == 127) {
                *c = ' ';
            }
        }
    }
    return code;
}

#ifdef __cplusplus
}
#endif
#endif
