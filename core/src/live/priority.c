/* SPDX-License-Identifier: Apache-2.0 */
#define _GNU_SOURCE /* sched_getaffinity */
#include "live/priority.h"

#include <errno.h>
#include <sched.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

int32_t mhi_priority_cores(void) {
    cpu_set_t set;
    return sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 1;
}

void mhi_priority_mutex(pthread_mutex_t *mutex, int32_t inherits) {
    pthread_mutexattr_t attributes;
    (void)pthread_mutexattr_init(&attributes);
    (void)pthread_mutexattr_setprotocol(&attributes,
                                        inherits ? PTHREAD_PRIO_INHERIT : PTHREAD_PRIO_NONE);
    if (pthread_mutex_init(mutex, &attributes) != 0) { /* the system has no such mutexes */
        (void)pthread_mutex_init(mutex, NULL);
    }
    (void)pthread_mutexattr_destroy(&attributes);
}

static void tell(const mhe_host *host, int32_t level, const char *text) {
    char line[MHE_ERROR_TEXT];
    (void)snprintf(line, sizeof line, "%s", text);
    host->log(host, level, line);
}

static void raise_thread(int32_t wanted, const mhe_host *host, mhi_priority *p) {
    const struct sched_param parameters = {.sched_priority = wanted};
    struct sched_param given;
    int policy = SCHED_OTHER;
    char line[300];
    if (pthread_getschedparam(pthread_self(), &policy, &given) == 0 && policy != SCHED_OTHER) {
        return; /* whoever started the program has chosen */
    }
    if (mhi_priority_cores() < 2) {
        tell(host, MHE_LOG_WARNING,
             "realtime.priority is not taken: there is one core, and a sender on it would starve");
        return;
    }
    const int code = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    if (code != 0) {
        (void)snprintf(line, sizeof line,
                       "realtime.priority is not taken: %s; as root, or with rtprio %d in "
                       "/etc/security/limits.conf, it is",
                       strerror(code), (int)wanted);
        tell(host, MHE_LOG_WARNING, line);
        return;
    }
    p->raised = wanted;
    (void)snprintf(line, sizeof line, "estimates are made with real-time priority %d", (int)wanted);
    tell(host, MHE_LOG_INFO, line);
}

/* Memory that comes later is locked, too, where no limit could make it fail. */
static void lock_memory(const mhe_host *host, mhi_priority *p) {
    struct rlimit limit = {0, 0};
    const int free = geteuid() == 0 ||
                     (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
    char line[300];
    if (mlockall(free ? MCL_CURRENT | MCL_FUTURE : MCL_CURRENT) == 0) {
        p->locked = 1;
        return;
    }
    (void)snprintf(line, sizeof line,
                   "realtime.lock_memory: not done: %s; as root, or with memlock in "
                   "/etc/security/limits.conf, it is",
                   strerror(errno));
    tell(host, MHE_LOG_WARNING, line);
}

void mhi_priority_take(const mhi_run *run, const mhe_host *host, mhi_priority *p) {
    *p = (mhi_priority){0};
    if (run->realtime.lock_memory) {
        lock_memory(host, p);
    }
    if (run->realtime.priority > 0) {
        raise_thread(run->realtime.priority, host, p);
    }
}

void mhi_priority_give_back(mhi_priority *p) {
    const struct sched_param ordinary = {.sched_priority = 0};
    if (p->raised > 0) {
        (void)pthread_setschedparam(pthread_self(), SCHED_OTHER, &ordinary);
    }
    if (p->locked) {
        (void)munlockall();
    }
}
