/* SPDX-License-Identifier: Apache-2.0 */
/* Stamps of senders on this machine's time: clocks that are set between packets and within one,
 * stamps in another unit, and what is no setting of a clock: late packets and pauses. */
#include "live/clocks.h"
#include "support.h"

#include <math.h>

#define N 27
#define RATE 2000.0
#define PACKET (N / RATE)

typedef struct sent {
    double stamp[N], time[N];
    int32_t n_set, unused;
} sent;

/* A packet whose samples are stamped by `stamp_of` at this machine's time of each. */
static void take(mhi_clock *clock, sent *s, double first, double received,
                 double (*stamp_of)(double time)) {
    const mhi_packet p = {.n = N, .received = received, .offset = -5, .stamp = s->stamp};
    mhi_clock_packet work;
    double set;
    for (int32_t k = 0; k < N; k++) {
        s->stamp[k] = stamp_of(first + k / RATE);
    }
    mhi_clock_begin(clock, &p, RATE, &work);
    for (int32_t k = 0; k < N; k++) {
        s->time[k] = mhi_clock_time(clock, &work, k, &set);
        s->n_set += set != 0;
    }
    s->unused += mhi_clock_end(clock, &work);
}

/* The sender's clock is 5 s ahead; it is set at 2 s, in the middle of a packet. */
static double right(double t) {
    return t + 5;
}
static double set_ahead(double t) {
    return t + 5 + (t > 2.001 ? 300 : 0);
}
static double set_back(double t) {
    return t + 5 - (t > 2.001 ? 300 : 0);
}
static double in_ms(double t) {
    return 1000 * t;
}

static void set_within_a_packet(void **state) {
    (void)state;
    double (*const clocks[])(double) = {right, set_ahead, set_back};
    for (size_t i = 0; i < 3; i++) {
        mhi_clock clock;
        sent s = {.n_set = 0};
        mhi_clock_start(&clock);
        for (int32_t k = 0; k < 300; k++) {
            take(&clock, &s, k * PACKET, (k + 1) * PACKET + 0.01, clocks[i]);
            for (int32_t j = 0; j < N; j++) {
                assert_true(fabs(s.time[j] - k * PACKET - j / RATE) < 1e-6);
            }
        }
        assert_int_equal(s.n_set, i > 0);
        assert_int_equal(s.unused, 0);
    }
}

/* Late packets come all at once; a sender that pauses has stamps that go on by themselves. */
static void late_and_paused(void **state) {
    (void)state;
    mhi_clock clock;
    sent s = {.n_set = 0};
    mhi_clock_start(&clock);
    double first = 0;
    for (int32_t k = 0; k < 600; k++) {
        const double pause = k == 200 ? 30 : 0;
        first += PACKET + pause;
        const double received = first + PACKET + (k > 300 && k < 400 ? (400 - k) * PACKET : 0);
        take(&clock, &s, first, received, right);
        assert_true(fabs(s.time[0] - first) < 1e-6);
    }
    assert_int_equal(s.n_set, 0);
}

/* Stamps that do not go with the time are told a few times and left alone then. */
static void in_another_unit(void **state) {
    (void)state;
    mhi_clock clock;
    sent s = {.n_set = 0};
    mhi_clock_start(&clock);
    for (int32_t k = 0; k < 100; k++) {
        const double received = 10 + (k + 1) * PACKET;
        take(&clock, &s, 10 + k * PACKET, received, in_ms);
        assert_true(k < 10 || fabs(s.time[N - 1] - received) < 1e-9);
        assert_true(k < 10 || fabs(s.time[0] - received + (N - 1) / RATE) < 1e-9);
    }
    assert_in_range(s.n_set, 1, 6);
    assert_int_equal(s.unused, 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(set_within_a_packet),
                                       cmocka_unit_test(late_and_paused),
                                       cmocka_unit_test(in_another_unit)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
