/* SPDX-License-Identifier: Apache-2.0 */
/* arena.h: memory that is taken piece by piece and given back all at once. */
#ifndef MHI_ARENA_H
#define MHI_ARENA_H

#include <mhe/abi.h>
#include <stddef.h>

typedef struct mhi_arena {
    struct mhi_arena_block *blocks; /* {0} is an empty arena */
    int32_t failed;                 /* something was not given: what was made of it is not whole */
} mhi_arena;

/* Zeroed, 64-byte aligned memory that lives until mhi_arena_free; NULL when memory is out. n = 0
 * gives a valid pointer. [cold] */
void *mhi_arena_take(mhi_arena *arena, size_t bytes);
char *mhi_arena_text(mhi_arena *arena, const char *text); /* copy of a string */
char *mhi_arena_text_n(mhi_arena *arena, const char *text,
                       size_t length); /* copy of its first `length` bytes */
MHE_PRINTF(2, 3) char *mhi_arena_format(mhi_arena *arena, const char *format, ...);
void mhi_arena_free(mhi_arena *arena);

/* Array of n values of type T. */
#define MHI_TAKE(arena, T, n) ((T *)mhi_arena_take((arena), sizeof(T) * (size_t)(n)))

/* Arrays of numbers that are taken together. */
typedef struct mhi_room {
    double **array;
    ptrdiff_t n;
} mhi_room;

/* Each of the n rooms gets its array; MHE_E_MEMORY where one does not. [cold] */
mhe_status mhi_arena_rooms(mhi_arena *arena, const mhi_room *rooms, size_t n, mhe_error *err);
#define MHI_TAKE_ROOMS(arena, rooms, err) \
    mhi_arena_rooms((arena), (rooms), sizeof(rooms) / sizeof *(rooms), (err))

#endif
