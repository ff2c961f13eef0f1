/* SPDX-License-Identifier: Apache-2.0 */
#include "model/work.h"

#include <time.h>

#define NO_BOUND (INT64_MAX / 4)

void mhi_work_begin(mhi_work *w, int64_t most, double deadline) {
    w->before += w->most > 0 ? mhi_work_done(w) : 0;
    w->most = most > 0 ? most : NO_BOUND;
    w->deadline = deadline;
    w->look = NULL;
    atomic_store_explicit(&w->refused, 0, memory_order_relaxed);
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

static int32_t is_empty(const mhi_work *w) {
    return atomic_load_explicit(&w->left, memory_order_relaxed) <= 0;
}

int32_t mhi_work_spent(const mhi_work *w) {
    return is_empty(w) || (w->look != NULL ? w->look(w->looker) : is_late(w));
}

void mhi_work_refuse(mhi_work *w) {
    atomic_store_explicit(&w->refused, 1, memory_order_relaxed);
}

int32_t mhi_work_is_refused(const mhi_work *w) {
    return atomic_load_explicit(&w->refused, memory_order_relaxed);
}

int32_t mhi_work_count(mhi_work *w, int64_t units, int64_t *loan) {
    if (*loan < units) {
        if (is_empty(w)) {
            return 0;
        }
        (void)atomic_fetch_sub_explicit(&w->left, MHI_WORK_LOAN, memory_order_relaxed);
        *loan += MHI_WORK_LOAN;
    }
    *loan -= units;
    return 1;
}

int32_t mhi_work_take(mhi_work *w, int64_t units, int64_t *loan) {
    if (is_late(w)) {
        mhi_work_refuse(w);
    }
    return !mhi_work_is_refused(w) && mhi_work_count(w, units, loan);
}

void mhi_work_return(mhi_work *w, int64_t *loan) {
    (void)atomic_fetch_add_explicit(&w->left, *loan, memory_order_relaxed);
    *loan = 0;
}
