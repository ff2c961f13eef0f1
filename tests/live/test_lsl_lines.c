/* SPDX-License-Identifier: Apache-2.0 */
/* Several connections to one stream, in any order in which they may have its samples: each sample
 * is given once and in its order, by whichever connection has it first. */
#include "../../plugins/source_lsl/source_lsl.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SENT 2000
#define MOST 40 /* samples at once */

static uint32_t seed;

static int32_t chance(int32_t n) { /* 0 .. n - 1 */
    seed = seed * 1664525u + 1013904223u;
    return (int32_t)((seed >> 8) % (uint32_t)n);
}

typedef struct sending {
    lsl_stream stream;
    double values[2 * MOST], stamps[MOST];
    double stamp[SENT];                  /* of each sample that was sent */
    int32_t next[LSL_MOST_LINES];        /* that a line has not handed out yet */
    int32_t given[2 * SENT], n_given, n; /* numbers of samples given; of samples sent */
    int32_t first_by[LSL_MOST_LINES];    /* how many each line gave */
} sending;

static void begin(sending *s, int32_t n_lines) {
    memset(s, 0, sizeof *s);
    s->stream.n_channels = 2;
    s->stream.values = s->values;
    s->stream.stamps = s->stamps;
    s->stream.n_lines = n_lines;
    for (int32_t i = 0; i < SENT; i++) {
        s->stamp[i] = 100 + 0.01 * i;
    }
}

/* The line hands out what it has of the samples sent before `end`, less `lost` of them. */
static void hand_out(sending *s, int32_t line, int32_t end, int32_t lost) {
    int32_t n = 0;
    s->next[line] += lost;
    for (; s->next[line] < end && n < MOST; n++, s->next[line]++) {
        s->stamps[n] = s->stamp[s->next[line]];
        s->values[2 * n] = s->next[line];
        s->values[2 * n + 1] = -s->next[line];
    }
    const int32_t kept = lsl_take_new(&s->stream, line, n);
    for (int32_t i = 0; i < kept; i++) {
        assert_true(s->values[2 * i] == -s->values[2 * i + 1]);
        assert_memory_equal(&s->stamps[i], &s->stamp[(int32_t)s->values[2 * i]], sizeof(double));
        assert_true(s->n_given < 2 * SENT);
        s->given[s->n_given++] = (int32_t)s->values[2 * i];
    }
    s->first_by[line] += kept;
}

static void must_be_all(const sending *s) {
    assert_int_equal(s->n_given, SENT);
    for (int32_t i = 0; i < SENT; i++) {
        assert_int_equal(s->given[i], i);
    }
}

static void in_any_order(void **state) {
    (void)state;
    static sending s;
    for (seed = 1; seed < 200; seed = seed % 1000 + 7) {
        const uint32_t kept = seed;
        begin(&s, 2 + chance(3));
        if (kept % 2 == 0) { /* the others come in later, where the sender is then */
            for (int32_t line = 1; line < s.stream.n_lines; line++) {
                s.next[line] = chance(30);
            }
        }
        for (int32_t end = 0; end < SENT; end += 1 + chance(3)) {
            const int32_t line = chance(s.stream.n_lines);
            hand_out(&s, line, end, 0);
            hand_out(&s, chance(s.stream.n_lines), end, 0);
        }
        for (int32_t k = 0; k < SENT; k++) {
            hand_out(&s, chance(s.stream.n_lines), SENT, 0);
        }
        must_be_all(&s);
        assert_true(s.first_by[1] > 0); /* not by the main one alone */
        seed = kept;
    }
}

/* A clock that jumps, stands still or says nothing is the core's to deal with. */
static void whatever_the_stamps(void **state) {
    (void)state;
    static sending s;
    seed = 5;
    begin(&s, 3);
    for (int32_t i = 0; i < SENT; i++) {
        s.stamp[i] = i % 400 < 100 ? 7 : i % 400 < 200 ? NAN : 1000 - 0.01 * (i % 400);
    }
    for (int32_t end = 0; end <= SENT; end++) {
        hand_out(&s, chance(3), end, 0);
    }
    for (int32_t line = 0; line < 3; line++) {
        for (int32_t k = 0; k < SENT; k += MOST) {
            hand_out(&s, line, SENT, 0);
        }
    }
    assert_int_equal(s.n_given, SENT);
}

/* One that loses samples, stops or falls far behind takes nothing from what the main one gives. */
static void one_that_loses_some(void **state) {
    (void)state;
    static sending s;
    seed = 9;
    begin(&s, 3);
    for (int32_t end = 1; end <= SENT; end++) {
        hand_out(&s, 0, end, 0);
        if (end < 600 || end > 1500) {
            hand_out(&s, 1, end, end % 50 == 0);
        }
        if (end < 300) {
            hand_out(&s, 2, end, 0);
        }
    }
    must_be_all(&s);
}

/* The main one stops for longer than the others may be ahead, and goes on. */
static void the_main_one_stops(void **state) {
    (void)state;
    static sending s;
    begin(&s, 2);
    for (int32_t end = 1; end <= SENT; end++) {
        if (end < 500 || end > 900) {
            hand_out(&s, 0, end, 0);
        }
        hand_out(&s, 1, end, 0);
    }
    for (int32_t k = 0; k < SENT; k += MOST) {
        hand_out(&s, 0, SENT, 0);
    }
    must_be_all(&s);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(in_any_order), cmocka_unit_test(whatever_the_stamps),
        cmocka_unit_test(one_that_loses_some), cmocka_unit_test(the_main_one_stops)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
