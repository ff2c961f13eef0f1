/* SPDX-License-Identifier: Apache-2.0 */
/* work.h: how much may be computed before somebody must come back.
 *
 * One account for all threads, in units of half an acceleration of the system. Contexts of the
 * system draw from it in small loans and give back what they did not use; where it is empty, or the
 * time is over, the system has no value any more (MHE_RETRY), so that no integrator goes on for
 * ever. As long as it lasts nothing depends on it; with several threads it may be another interval
 * that finds it empty. */
#ifndef MHI_WORK_H
#define MHI_WORK_H

#include <stdatomic.h>
#include <stdint.h>

#define MHI_WORK_ACCELERATION 2
#define MHI_WORK_DERIVATIVES 6 /* one with its derivatives and what integrators make of them */
#define MHI_WORK_LOAN 64

typedef struct mhi_work {
    atomic_llong left;
    int64_t most;
    int64_t before;  /* done since it was made, up to the last begin */
    double deadline; /* s of CLOCK_MONOTONIC; 0: none */
    atomic_int
        refused; /* since begin: the deadline broke something off, and nothing is given now */
    int32_t (*look)(
        void *looker); /* who answers mhi_work_spent beside the account; NULL: the clock */
    void *looker;
} mhi_work;

/* `most` 0: no bound. Nobody but the clock is asked until `look` is set. [hot] */
void mhi_work_begin(mhi_work *work, int64_t most, double deadline);
/* Since then, without what is on loan; and in all. */
int64_t mhi_work_done(const mhi_work *work);
int64_t mhi_work_total(const mhi_work *work);
/* 1: nothing is left, or it is too late. On the thread that began it alone. */
int32_t mhi_work_spent(const mhi_work *work);
void mhi_work_refuse(mhi_work *work); /* nothing more is given until the next begin */
int32_t mhi_work_is_refused(const mhi_work *work);
/* Takes from the account, `*loan` first. 0: there is no more. */
int32_t mhi_work_take(mhi_work *work, int64_t units, int64_t *loan);
/* The same whatever the clock says. */
int32_t mhi_work_count(mhi_work *work, int64_t units, int64_t *loan);
void mhi_work_return(mhi_work *work, int64_t *loan);

#endif
