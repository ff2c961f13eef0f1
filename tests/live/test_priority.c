/* SPDX-License-Identifier: Apache-2.0 */
/* Real-time priority is taken where another core is left for senders, and for the calling thread
 * alone; what is not granted is told and the run goes on as an ordinary one. Each case is a process
 * of its own: cores, users and limits are a process's. */
#define _GNU_SOURCE /* sched_setaffinity */
#include "live/priority.h"
#include "support.h"

#include <sched.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

/* Sanitizers turn mlockall into nothing. */
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define LOCKS 0
#endif
#endif
#if !defined(LOCKS) && (defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__))
#define LOCKS 0
#endif
#ifndef LOCKS
#define LOCKS 1
#endif

static char told[1000];

static void keep(const mhe_host *host, int32_t level, const char *text) {
    (void)host, (void)level;
    (void)snprintf(told, sizeof told, "%s", text);
}

static const mhe_host host = {.size = sizeof host, .log = keep};

static int32_t policy_of_this_thread(void) {
    struct sched_param given;
    int policy = -1;
    return pthread_getschedparam(pthread_self(), &policy, &given) == 0 ? policy : -1;
}

static mhi_priority take(int32_t wanted, int32_t lock_memory) {
    mhi_run run = {.realtime = {.priority = wanted, .lock_memory = lock_memory}};
    mhi_priority p;
    told[0] = '\0';
    mhi_priority_take(&run, &host, &p);
    return p;
}

static int is_ordinary(void) {
    return policy_of_this_thread() == SCHED_OTHER;
}

/* 0: as it should be; what the child makes its exit status. */
static int in_a_child(int (*what)(void)) {
    int status = 0;
    const pid_t child = fork();
    if (child == 0) {
        _exit(what());
    }
    return waitpid(child, &status, 0) == child && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void *ordinary_beside(void *data) {
    *(int32_t *)data = policy_of_this_thread();
    return NULL;
}

/* Threads that were there before stay what they are, and the caller becomes again what it was. */
static int as_allowed(void) {
    if (!is_ordinary()) {
        return TEST_SKIPPED; /* the whole test runs with a priority: nothing is to be taken */
    }
    mhi_priority p = take(7, 0);
    const int32_t during = policy_of_this_thread();
    mhi_priority_give_back(&p);
    if (mhi_priority_cores() < 2) {
        return p.raised != 0 || strstr(told, "there is one core") == NULL;
    }
    if (p.raised == 0) {
        return during != SCHED_OTHER || strstr(told, "limits.conf") == NULL;
    }
    return p.raised != 7 || during != SCHED_FIFO || !is_ordinary() ||
           strstr(told, "priority 7") == NULL;
}

static int on_one_core(void) {
    cpu_set_t set;
    if (!is_ordinary()) {
        return TEST_SKIPPED;
    }
    if (sched_getaffinity(0, sizeof set, &set) != 0) {
        return 1;
    }
    for (size_t i = 0, n = 0; i < CPU_SETSIZE; i++) {
        n += CPU_ISSET(i, &set) ? 1 : 0;
        if (n > 1) {
            CPU_CLR(i, &set);
        }
    }
    if (sched_setaffinity(0, sizeof set, &set) != 0) {
        return 2;
    }
    const mhi_priority p = take(7, 0);
    return p.raised != 0 || !is_ordinary() || strstr(told, "there is one core") == NULL;
}

/* A user without the right gets one line and an ordinary run. */
static int as_nobody(void) {
    const struct rlimit none = {0, 0};
    if (!is_ordinary() || mhi_priority_cores() < 2 || setrlimit(RLIMIT_RTPRIO, &none) != 0 ||
        setrlimit(RLIMIT_MEMLOCK, &none) != 0 || (geteuid() == 0 && setuid(65534) != 0)) {
        return TEST_SKIPPED;
    }
    mhi_priority p = take(7, 0);
    if (p.raised != 0 || !is_ordinary() || strstr(told, "rtprio 7") == NULL) {
        return 1;
    }
    p = take(0, 1);
    mhi_priority_give_back(&p);
    return LOCKS && (p.locked || strstr(told, "memlock") == NULL);
}

static int nothing_wished(void) {
    const int32_t before = policy_of_this_thread();
    mhi_priority p = take(0, 0);
    mhi_priority_give_back(&p);
    return p.raised != 0 || p.locked || told[0] != '\0' || policy_of_this_thread() != before;
}

static int memory_stays(void) {
    if (geteuid() != 0 || !LOCKS) {
        return TEST_SKIPPED;
    }
    mhi_priority p = take(0, 1);
    if (!p.locked) { /* a container may forbid it to root as well */
        return strstr(told, "memlock") == NULL;
    }
    long locked = 0;
    char line[200];
    FILE *file = fopen("/proc/self/status", "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        (void)sscanf(line, "VmLck: %ld", &locked);
    }
    if (file != NULL) {
        (void)fclose(file);
    }
    mhi_priority_give_back(&p);
    return locked < 100; /* kB: a program is larger */
}

/* Another thread that holds such a mutex does not keep its waiter for good, and the kind is there.
 */
static int a_mutex(void) {
    pthread_mutex_t mutex;
    pthread_t thread;
    int32_t policy = -1;
    mhi_priority p = take(7, 0);
    mhi_priority_mutex(&mutex, 1);
    const int whole = pthread_mutex_lock(&mutex) == 0 && pthread_mutex_unlock(&mutex) == 0 &&
                      pthread_mutex_destroy(&mutex) == 0;
    mhi_priority_give_back(&p);
    const int ran = pthread_create(&thread, NULL, ordinary_beside, &policy) == 0 &&
                    pthread_join(thread, NULL) == 0;
    return !whole || !ran || policy != policy_of_this_thread();
}

#define CASE(name)                         \
    static void name##_(void **state) {    \
        (void)state;                       \
        const int code = in_a_child(name); \
        if (code == TEST_SKIPPED) {        \
            skip();                        \
        }                                  \
        assert_int_equal(code, 0);         \
    }
CASE(as_allowed)
CASE(on_one_core)
CASE(as_nobody)
CASE(nothing_wished)
CASE(memory_stays)
CASE(a_mutex)

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(as_allowed_),   cmocka_unit_test(on_one_core_),
        cmocka_unit_test(as_nobody_),    cmocka_unit_test(nothing_wished_),
        cmocka_unit_test(memory_stays_), cmocka_unit_test(a_mutex_)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
