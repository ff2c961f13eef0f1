/* SPDX-License-Identifier: Apache-2.0 */
/* kinds.h: warnings of a kind are counted: the first few are told, then their number. */
#ifndef MHI_KINDS_H
#define MHI_KINDS_H

#include <mhe/abi.h>

#define MHI_KINDS_MAX 64  /* more kinds than any reader has; what is beyond is told */
#define MHI_KINDS_SHOWN 4 /* of a kind, before only their number grows */

typedef struct mhi_kind {
    const char *format; /* its address is what a kind is known by */
    int32_t n, last_line;
    int32_t place; /* of the last one that was told, in the caller's list */
} mhi_kind;

/* {0} is empty. */
typedef struct mhi_kinds {
    mhi_kind of[MHI_KINDS_MAX];
    int32_t n;
} mhi_kinds;

/* Counts one more of a kind in `line`; 1: it is to be told, and will stand at `place` of the
 * caller's list; 0: only counted. [any] */
int32_t mhi_kinds_count(mhi_kinds *kinds, const char *format, int32_t line, int32_t place);
/* " (and 1234 more of this kind, the last in line 99)" for a kind of which some were only counted,
 * "" for the others. [any] */
const char *mhi_kinds_rest(const mhi_kind *kind, char *out, size_t size);

#endif
