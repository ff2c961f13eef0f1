/* SPDX-License-Identifier: Apache-2.0 */
#include "model/work.h"

#include <time.h>

#define NO_BOUND (INT64_MAX / 4)

void mhi_work_begin(mhi_work *w, int64_t most, double deadline) {
    w->before += w->most > 0 ? mhi_work_done(w) : 0;
    w->most = most > 0 ? most : NO_BOUND;
    w->deadline = deadline;
    atomic_store_explicit(&w->left, w->most, memory_order_relaxed);
}

int64_t mhi_work_done(const mhi_work *w) {
    return w->most - (int64_t)atomic_load_explicit(&w->left, memory_order_relaxed);
}

int64_t mhi_work_total(const mhi_work *w) {
    return w->before + mhi_work_done(w);
}

static int32_t is_late(const mhi_work *w) {
    struct timespec t;
    if (!(w->deadline > 0)) {
        return 0;
    }
    (void)clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec >= w->deadline;
}

int32_t mhi_work_spent(const mhi_work *w) {
    return atomic_load_explicit(&w->left, memory_order_relaxed) <= 0 || is_late(w);
}

int32_t mhi_work_take(mhi_work *w, int64_t units, int64_t *loan) {
    if (*loan < units) {
        if (mhi_work_spent(w)) {
            return 0;
        }
        (void)atomic_fetch_sub_explicit(&w->left, MHI_WORK_LOAN, memory_order_relaxed);
        *loan += MHI_WORK_LOAN;
    }
    *loan -= units;
    return !(w->deadline > 0) || !is_late(w);
}

void mhi_work_return(mhi_work *w, int64_t *loan) {
    (void)atomic_fetch_add_explicit(&w->left, *loan, memory_order_relaxed);
    *loan = 0;
}
