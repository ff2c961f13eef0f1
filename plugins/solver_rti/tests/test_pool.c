/* SPDX-License-Identifier: Apache-2.0 */
/* The threads of a loop: every item once, whoever does it, asleep or awake. */
#include "pool.h"
#include "support.h"

#include <stdatomic.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define N_ITEMS 23
#define N_WORKERS 5

typedef struct count {
    int done[N_ITEMS];        /* each by one worker at a time: no atomic, for TSan to look at */
    int by_worker[N_WORKERS]; /* likewise */
    int32_t refused;          /* item that stops the loop */
    double seconds;           /* of an item */
} count;

static void rest(double seconds) {
    const struct timespec time = {.tv_nsec = (long)(1e9 * seconds)};
    (void)nanosleep(&time, NULL);
}

static int32_t add_one(void *data, int32_t worker, int32_t item) {
    count *c = data;
    c->done[item]++;
    c->by_worker[worker]++;
    if (c->seconds > 0) {
        rest(c->seconds);
    }
    return item == c->refused;
}

static void assert_all_done(const count *c, int rounds) {
    int sum = 0;
    for (int i = 0; i < N_ITEMS; i++) {
        assert_int_equal(c->done[i], rounds);
    }
    for (int i = 0; i < N_WORKERS; i++) {
        sum += c->by_worker[i];
    }
    assert_int_equal(sum, rounds * N_ITEMS);
}

static void every_item_once(void **state) {
    (void)state;
    static const double spin[] = {0, 50e-6, 1e-2};
    for (int s = 0; s < 3; s++) {
        for (int workers = 1; workers <= N_WORKERS; workers++) {
            rti_pool *pool = rti_pool_create(workers, spin[s]);
            count c = {.refused = -1};
            for (int round = 0; round < 200; round++) {
                rti_pool_run(pool, N_ITEMS, add_one, &c);
                if (round % 50 == 0) {
                    rest(2e-4); /* threads fall asleep */
                }
            }
            assert_all_done(&c, 200);
            rti_pool_destroy(pool);
        }
    }
}

/* Items that take long are shared, and the caller sleeps while it waits for them. */
static void long_items_are_shared(void **state) {
    (void)state;
    rti_pool *pool = rti_pool_create(N_WORKERS, 50e-6);
    count c = {.refused = -1, .seconds = 2e-3};
    rti_pool_run(pool, N_ITEMS, add_one, &c);
    assert_all_done(&c, 1);
    assert_true(c.by_worker[0] < N_ITEMS);
    rti_pool_destroy(pool);
}

static void refusal_ends_the_loop(void **state) {
    (void)state;
    for (int workers = 1; workers <= N_WORKERS; workers++) {
        rti_pool *pool = rti_pool_create(workers, 50e-6);
        count c = {.refused = 4};
        rti_pool_run(pool, N_ITEMS, add_one, &c);
        for (int i = 0; i <= 4; i++) { /* all before it are done, and no item twice */
            assert_int_equal(c.done[i], 1);
        }
        for (int i = 5; i < N_ITEMS; i++) {
            assert_true(c.done[i] <= (workers > 1));
        }
        c.refused = -1;
        memset(c.done, 0, sizeof c.done);
        memset(c.by_worker, 0, sizeof c.by_worker);
        rti_pool_run(pool, N_ITEMS, add_one, &c); /* and the next is whole */
        assert_all_done(&c, 1);
        rti_pool_destroy(pool);
    }
}

/* A child has the pool's memory, but none of its threads (it crashed when it waited for them). */
static void a_child_works_alone(void **state) {
    (void)state;
    rti_pool *pool = rti_pool_create(N_WORKERS, 50e-6);
    count c = {.refused = -1};
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        rti_pool_run(pool, N_ITEMS, add_one, &c);
        rti_pool_destroy(pool);
        _exit(c.by_worker[0] == N_ITEMS ? 0 : 1);
    }
    int status = -1;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
    rti_pool_run(pool, N_ITEMS, add_one, &c);
    assert_all_done(&c, 1);
    rti_pool_destroy(pool);
}

static void ends_unused(void **state) {
    (void)state;
    for (int i = 0; i < 20; i++) {
        rti_pool_destroy(rti_pool_create(N_WORKERS, i % 2 ? 0 : 1e-3));
    }
    assert_null(rti_pool_create(1, 0)); /* alone: no thread, no pool */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_item_once), cmocka_unit_test(long_items_are_shared),
        cmocka_unit_test(refusal_ends_the_loop), cmocka_unit_test(a_child_works_alone),
        cmocka_unit_test(ends_unused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
