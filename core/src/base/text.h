/* SPDX-License-Identifier: Apache-2.0 */
/* text.h: growing text, and the nearest of a list of names. */
#ifndef MHI_TEXT_H
#define MHI_TEXT_H

#include <mhe/abi.h>

/* A growing NUL-terminated text; {0} is empty. After a failed allocation `failed` is set and the
 * text stops growing. */
typedef struct mhi_text {
    char *data;
    size_t length, capacity;
    int32_t failed;
} mhi_text;

MHE_PRINTF(2, 3) void mhi_text_add(mhi_text *text, const char *format, ...);
void mhi_text_free(mhi_text *text);
/* Hands what was built to a caller outside, who gives it back with mhe_free(). MHE_E_MEMORY: it
 * failed; the text is freed. */
mhe_status mhi_text_give(mhi_text *text, char **out, mhe_error *err);

/* The entry of names [n] nearest to `name` (edit distance, letter case free); NULL if none is near
 * enough to be what was meant. NULL entries are passed over. */
const char *mhi_nearest(const char *name, const char *const *names, int32_t n);

/* The entry that `name` misses by a letter or two: what a slip of the keyboard makes; else NULL. */
const char *mhi_slip_of(const char *name, const char *const *names, int32_t n);

/* Writes " (did you mean 'x'?)", or with no near name " (valid: a, b, ...)" cut to the room, into
 * out [size]. */
const char *mhi_suggest(char *out, size_t size, const char *name, const char *const *names,
                        int32_t n);

#endif
