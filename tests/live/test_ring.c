/* SPDX-License-Identifier: Apache-2.0 */
/* The ring between the estimator's thread and a sink's: whole records, in order, and an honest
 * count of those that a slow reader lost. */
#include "live/ring.h"
#include "support.h"

#include <pthread.h>

#define N 9
#define RECORDS 200000

static void fill(double *record, int64_t k) {
    for (int32_t i = 0; i < N; i++) {
        record[i] = (double)(k * 10 + i);
    }
}

static void in_order_while_it_is_read(void **state) {
    (void)state;
    mhi_ring *ring = mhi_ring_create(8, N);
    double record[N], back[N];
    int64_t lost = 0;
    assert_int_equal(mhi_ring_take(ring, back, &lost), 0);
    for (int64_t k = 0; k < 100; k++) {
        fill(record, k);
        mhi_ring_put(ring, record);
        assert_int_equal(mhi_ring_take(ring, back, &lost), 1);
        assert_memory_equal(record, back, sizeof record);
    }
    assert_int_equal(lost, 0);
    mhi_ring_free(ring);
}

static void the_oldest_are_lost(void **state) {
    (void)state;
    mhi_ring *ring = mhi_ring_create(8, N);
    double record[N], back[N];
    int64_t lost = 0;
    for (int64_t k = 0; k < 20; k++) {
        fill(record, k);
        mhi_ring_put(ring, record);
    }
    for (int64_t k = 12; k < 20; k++) {
        fill(record, k);
        assert_int_equal(mhi_ring_take(ring, back, &lost), 1);
        assert_memory_equal(record, back, sizeof record);
    }
    assert_int_equal(lost, 12);
    assert_int_equal(mhi_ring_take(ring, back, &lost), 0);
    mhi_ring_free(ring);
}

static void *write_all(void *data) {
    mhi_ring *ring = data;
    double record[N];
    for (int64_t k = 0; k < RECORDS; k++) {
        fill(record, k);
        mhi_ring_put(ring, record);
    }
    return NULL;
}

/* The reader sees whole records only, ever newer, and lost + seen is what was written. */
static void two_threads(void **state) {
    (void)state;
    mhi_ring *ring = mhi_ring_create(16, N);
    pthread_t writer;
    int64_t lost = 0, seen = 0, last = -1;
    assert_int_equal(pthread_create(&writer, NULL, write_all, ring), 0);
    while (last < RECORDS - 1) {
        double back[N];
        if (!mhi_ring_take(ring, back, &lost)) {
            continue;
        }
        const int64_t k = (int64_t)back[0] / 10;
        for (int32_t i = 0; i < N; i++) {
            assert_true(back[i] == (double)(k * 10 + i));
        }
        assert_true(k > last);
        last = k;
        seen++;
    }
    assert_int_equal(pthread_join(writer, NULL), 0);
    assert_int_equal(seen + lost, RECORDS);
    mhi_ring_free(ring);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(in_order_while_it_is_read),
        cmocka_unit_test(the_oldest_are_lost),
        cmocka_unit_test(two_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
