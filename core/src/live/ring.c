/* SPDX-License-Identifier: Apache-2.0 */
/* ring.c: each slot has a version that is odd while it is written (a seqlock, Lameter 2005). The
 * numbers are atomics, too: a reader that was overtaken reads nonsense, sees it by the version, and
 * goes on to the oldest record that is left. */
#include "live/ring.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

typedef struct slot {
    _Atomic uint64_t version;  /* 2 k + 2: holds record k; odd: being written */
    _Atomic uint64_t *numbers; /* [n] bits of doubles */
} slot;

struct mhi_ring {
    uint64_t capacity;
    int32_t n;
    _Atomic uint64_t written; /* records put so far */
    uint64_t next;            /* the reader's */
    slot *slots;
    _Atomic uint64_t *numbers;
};

mhi_ring *mhi_ring_create(int32_t capacity, int32_t n) {
    mhi_ring *ring = calloc(1, sizeof *ring);
    if (ring == NULL) {
        return NULL;
    }
    ring->capacity = (uint64_t)capacity;
    ring->n = n;
    ring->slots = calloc((size_t)capacity, sizeof *ring->slots);
    ring->numbers = calloc((size_t)capacity * (size_t)n + 1, sizeof *ring->numbers);
    if (ring->slots == NULL || ring->numbers == NULL) {
        mhi_ring_free(ring);
        return NULL;
    }
    for (int32_t i = 0; i < capacity; i++) {
        ring->slots[i].numbers = ring->numbers + (size_t)i * (size_t)n;
    }
    return ring;
}

void mhi_ring_free(mhi_ring *ring) {
    if (ring != NULL) {
        free(ring->slots);
        free(ring->numbers);
        free(ring);
    }
}

void mhi_ring_put(mhi_ring *ring, const double *record) {
    const uint64_t k = atomic_load_explicit(&ring->written, memory_order_relaxed);
    slot *s = &ring->slots[k & (ring->capacity - 1)];
    /* as an exchange, so that no number is stored before it */
    (void)atomic_exchange_explicit(&s->version, 2 * k + 1, memory_order_acq_rel);
    for (int32_t i = 0; i < ring->n; i++) {
        uint64_t bits;
        memcpy(&bits, &record[i], sizeof bits);
        atomic_store_explicit(&s->numbers[i], bits, memory_order_relaxed);
    }
    atomic_store_explicit(&s->version, 2 * k + 2, memory_order_release);
    atomic_store_explicit(&ring->written, k + 1, memory_order_release);
}

int32_t mhi_ring_take(mhi_ring *ring, double *record, int64_t *lost) {
    for (;;) {
        const uint64_t written = atomic_load_explicit(&ring->written, memory_order_acquire);
        if (ring->next >= written) {
            return 0;
        }
        if (written - ring->next > ring->capacity) {
            *lost += (int64_t)(written - ring->capacity - ring->next);
            ring->next = written - ring->capacity;
        }
        slot *s = &ring->slots[ring->next & (ring->capacity - 1)];
        const uint64_t wanted = 2 * ring->next + 2;
        const uint64_t before = atomic_load_explicit(&s->version, memory_order_acquire);
        for (int32_t i = 0; i < ring->n; i++) {
            const uint64_t bits = atomic_load_explicit(&s->numbers[i], memory_order_acquire);
            memcpy(&record[i], &bits, sizeof bits);
        }
        const uint64_t after = atomic_load_explicit(&s->version, memory_order_relaxed);
        if (before == wanted && after == wanted) {
            ring->next++;
            return 1;
        }
        ring->next++; /* written over while it was read */
        *lost += 1;
    }
}
