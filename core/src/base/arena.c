/* SPDX-License-Identifier: Apache-2.0 */
#include "base/arena.h"

#include <stdlib.h>
#include <string.h>

/* One allocation a piece: the address sanitizer then sees every overrun, and all pieces are taken
 * while cold. */
struct mhi_arena_block {
    _Alignas(64) struct mhi_arena_block *next;
    _Alignas(64) unsigned char bytes[];
};

void *mhi_arena_take(mhi_arena *arena, size_t bytes) {
    if (bytes > SIZE_MAX / 2) {
        arena->failed = 1;
        return NULL;
    }
    size_t total = sizeof(struct mhi_arena_block) + (bytes + 63) / 64 * 64;
    struct mhi_arena_block *block = aligned_alloc(64, total);
    if (block == NULL) {
        arena->failed = 1;
        return NULL;
    }
    memset(block, 0, total);
    block->next = arena->blocks;
    arena->blocks = block;
    return block->bytes;
}

char *mhi_arena_text_n(mhi_arena *arena, const char *text, size_t length) {
    char *copy = mhi_arena_take(arena, length + 1);
    if (copy != NULL) {
        memcpy(copy, text, length);
    }
    return copy;
}

char *mhi_arena_text(mhi_arena *arena, const char *text) {
    return mhi_arena_text_n(arena, text, strlen(text));
}

char *mhi_arena_format(mhi_arena *arena, const char *format, ...) {
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    int n = vsnprintf(NULL, 0, format, args);
    va_end(args);
    char *text = n < 0 ? NULL : mhi_arena_take(arena, (size_t)n + 1);
    if (text != NULL) {
        (void)vsnprintf(text, (size_t)n + 1, format, again);
    }
    va_end(again);
    return text;
}

mhe_status mhi_arena_rooms(mhi_arena *arena, const mhi_room *rooms, size_t n, mhe_error *err) {
    for (size_t i = 0; i < n; i++) {
        *rooms[i].array = MHI_TAKE(arena, double, rooms[i].n);
        if (*rooms[i].array == NULL) {
            return mhe_fail(err, MHE_E_MEMORY, "out of memory");
        }
    }
    return MHE_OK;
}

void mhi_arena_free(mhi_arena *arena) {
    struct mhi_arena_block *block = arena->blocks;
    while (block != NULL) {
        struct mhi_arena_block *next = block->next;
        free(block);
        block = next;
    }
    arena->blocks = NULL;
}
