/* SPDX-License-Identifier: Apache-2.0 */
/* priority.h: what a live run asks of the system: a thread that goes first, memory that stays. */
#ifndef MHI_LIVE_PRIORITY_H
#define MHI_LIVE_PRIORITY_H

#include "config/run.h"

#include <pthread.h>

typedef struct mhi_priority {
    int32_t raised; /* SCHED_FIFO priority that was taken; 0: none */
    int32_t locked; /* memory */
} mhi_priority;

/* What realtime.priority and realtime.lock_memory wish for the calling thread and the process; what
 * is not granted is told and left. SCHED_FIFO is taken only where another core is left for whoever
 * sends: a thread that is always ready would starve a sender on its own. [cold] */
void mhi_priority_take(const mhi_run *run, const mhe_host *host, mhi_priority *priority);
void mhi_priority_give_back(mhi_priority *priority); /* [cold], by the same thread */

/* Cores that this process may use. [any] */
int32_t mhi_priority_cores(void);

/* A mutex; where `inherits`, its holder goes as first as the thread that waits for it: an ordinary
 * thread that holds it cannot keep the solver's waiting behind others. [cold] */
void mhi_priority_mutex(pthread_mutex_t *mutex, int32_t inherits);

#endif
