/* SPDX-License-Identifier: Apache-2.0 */
#include "pool.h"

#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#define OPEN 0x40000000 /* in `inside`: threads may join the loop */
#define PAUSES 32       /* between looks at the clock */

typedef struct pool_thread {
    rti_pool *pool;
    pthread_t id;
    int32_t worker;
} pool_thread;

struct rti_pool {
    /* The loop; written by the caller while nobody is inside, read by those who are. */
    int32_t (*work)(void *data, int32_t worker, int32_t item);
    void *data;
    int32_t n_items;
    atomic_int next;   /* item to be handed out */
    atomic_int inside; /* threads in the loop, and OPEN */
    atomic_uint round; /* of loops; one more to end the threads */
    atomic_int ends;
    /* Sleep. A sleeper counts itself before it looks once more, and whoever changes what it looks
     * at does so before reading the count: one of the two sees the other. */
    atomic_int sleepers, caller_sleeps;
    pthread_mutex_t mutex;
    pthread_cond_t wake, done;
    double spin;
    pid_t process; /* after fork() a child has the memory, but no thread but its own */
    int32_t n_threads;
    pool_thread threads[];
};

static double now(void) {
    struct timespec time;
    (void)clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void pause_briefly(void) {
    for (int32_t i = 0; i < PAUSES; i++) {
#if defined(__x86_64__) || defined(__i386__)
        __builtin_ia32_pause();
#elif defined(__aarch64__)
        __asm__ volatile("yield");
#endif
    }
}

static void take_items(rti_pool *p, int32_t worker) {
    for (;;) {
        const int32_t item = atomic_fetch_add(&p->next, 1);
        if (item >= p->n_items) {
            return;
        }
        if (p->work(p->data, worker, item) != 0) {
            atomic_store(&p->next, p->n_items);
        }
    }
}

/* The next round after `seen`. */
static unsigned await_round(rti_pool *p, unsigned seen) {
    const double end = now() + p->spin;
    do {
        if (atomic_load(&p->round) != seen) {
            return atomic_load(&p->round);
        }
        pause_briefly();
    } while (now() < end);
    (void)pthread_mutex_lock(&p->mutex);
    atomic_fetch_add(&p->sleepers, 1);
    while (atomic_load(&p->round) == seen) {
        (void)pthread_cond_wait(&p->wake, &p->mutex);
    }
    atomic_fetch_sub(&p->sleepers, 1);
    (void)pthread_mutex_unlock(&p->mutex);
    return atomic_load(&p->round);
}

static void wake_sleepers(rti_pool *p) {
    if (atomic_load(&p->sleepers) > 0) {
        (void)pthread_mutex_lock(&p->mutex);
        (void)pthread_cond_broadcast(&p->wake);
        (void)pthread_mutex_unlock(&p->mutex);
    }
}

/* 0: the loop is over; who wakes late must not touch it. */
static int32_t enter(rti_pool *p) {
    int32_t inside = atomic_load(&p->inside);
    while (inside & OPEN) {
        if (atomic_compare_exchange_weak(&p->inside, &inside, inside + 1)) {
            return 1;
        }
    }
    return 0;
}

static void leave(rti_pool *p) {
    if (atomic_fetch_sub(&p->inside, 1) == 1 && atomic_load(&p->caller_sleeps)) {
        (void)pthread_mutex_lock(&p->mutex);
        (void)pthread_cond_signal(&p->done);
        (void)pthread_mutex_unlock(&p->mutex);
    }
}

static void await_last(rti_pool *p) {
    const double end = now() + p->spin;
    do {
        if (atomic_load(&p->inside) == 0) {
            return;
        }
        pause_briefly();
    } while (now() < end);
    (void)pthread_mutex_lock(&p->mutex);
    atomic_store(&p->caller_sleeps, 1);
    while (atomic_load(&p->inside) != 0) {
        (void)pthread_cond_wait(&p->done, &p->mutex);
    }
    atomic_store(&p->caller_sleeps, 0);
    (void)pthread_mutex_unlock(&p->mutex);
}

static void *serve(void *argument) {
    const pool_thread *thread = argument;
    rti_pool *p = thread->pool;
    unsigned seen = 0;
    for (;;) {
        seen = await_round(p, seen);
        if (atomic_load(&p->ends)) {
            return NULL;
        }
        if (enter(p)) {
            take_items(p, thread->worker);
            leave(p);
        }
    }
}

rti_pool *rti_pool_create(int32_t n_workers, double spin) {
    const size_t n = n_workers > 1 ? (size_t)n_workers - 1 : 0;
    rti_pool *p = n > 0 ? calloc(1, sizeof *p + n * sizeof p->threads[0]) : NULL;
    if (p == NULL) {
        return NULL;
    }
    p->spin = spin;
    p->process = getpid();
    (void)pthread_mutex_init(&p->mutex, NULL);
    (void)pthread_cond_init(&p->wake, NULL);
    (void)pthread_cond_init(&p->done, NULL);
    sigset_t all, before; /* signals are for the program's own threads */
    (void)sigfillset(&all);
    (void)pthread_sigmask(SIG_SETMASK, &all, &before);
    for (size_t i = 0; i < n; i++) {
        p->threads[i] = (pool_thread){.pool = p, .worker = (int32_t)i + 1};
        if (pthread_create(&p->threads[i].id, NULL, serve, &p->threads[i]) != 0) {
            break;
        }
        p->n_threads++;
    }
    (void)pthread_sigmask(SIG_SETMASK, &before, NULL);
    return p;
}

void rti_pool_destroy(rti_pool *p) {
    if (p == NULL || p->process != getpid()) {
        free(p);
        return;
    }
    atomic_store(&p->ends, 1);
    atomic_fetch_add(&p->round, 1);
    wake_sleepers(p);
    for (int32_t i = 0; i < p->n_threads; i++) {
        (void)pthread_join(p->threads[i].id, NULL);
    }
    (void)pthread_cond_destroy(&p->done);
    (void)pthread_cond_destroy(&p->wake);
    (void)pthread_mutex_destroy(&p->mutex);
    free(p);
}

void rti_pool_run(rti_pool *p, int32_t n_items,
                  int32_t (*work)(void *data, int32_t worker, int32_t item), void *data) {
    if (p == NULL || p->process != getpid()) {
        for (int32_t i = 0; i < n_items && work(data, 0, i) == 0; i++) {
        }
        return;
    }
    p->work = work;
    p->data = data;
    p->n_items = n_items;
    atomic_store(&p->next, 0);
    atomic_store(&p->inside, OPEN);
    atomic_fetch_add(&p->round, 1);
    wake_sleepers(p);
    take_items(p, 0);
    atomic_fetch_and(&p->inside, ~OPEN);
    await_last(p);
}
