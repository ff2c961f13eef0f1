/* SPDX-License-Identifier: Apache-2.0 */
/* The generator against its published answers, and the deviates against their distribution. */
#include "noise/random.h"
#include "support.h"

#include <math.h>

/* Answers of Random123's kat_vectors for philox4x32-10, the authors' own test. */
static void known_answers(void **state) {
    (void)state;
    static const struct {
        uint32_t counter[4];
        uint64_t key;
        uint32_t answer[4];
    } known[] = {{{0, 0, 0, 0}, 0, {0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}},
                 {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff},
                  UINT64_C(0xffffffffffffffff),
                  {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}},
                 {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344},
                  UINT64_C(0x299f31d0a4093822),
                  {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        uint32_t c[4];
        for (int k = 0; k < 4; k++) {
            c[k] = known[i].counter[k];
        }
        mhi_philox(c, known[i].key);
        for (int k = 0; k < 4; k++) {
            assert_int_equal(c[k], known[i].answer[k]);
        }
    }
}

#define N 200000

/* Standard errors of the first four moments of n normal deviates: 1, 2, 15 and 96 over n. */
static void moments(void **state) {
    (void)state;
    const mhi_stream stream = {42, 7, 3};
    double sum[5] = {0};
    for (uint64_t i = 0; i < N; i++) {
        const double x = mhi_random_normal(&stream, i);
        assert_true(fabs(x) < 8.6);
        for (int p = 1; p <= 4; p++) {
            sum[p] += pow(x, p) / N;
        }
    }
    const double expected[5] = {0, 0, 1, 0, 3}, variance[5] = {0, 1, 2, 15, 96};
    for (int p = 1; p <= 4; p++) {
        assert_true(fabs(sum[p] - expected[p]) <= 5 * sqrt(variance[p] / N));
    }
}

/* Shares below fixed bounds, against the normal distribution: binomial standard errors. */
static void distribution(void **state) {
    (void)state;
    const mhi_stream stream = {1, 1, 1};
    for (double bound = -3; bound <= 3; bound += 0.5) {
        int below = 0;
        for (uint64_t i = 0; i < N; i++) {
            below += mhi_random_normal(&stream, i) < bound;
        }
        const double p = 0.5 * erfc(-bound / sqrt(2));
        assert_true(fabs((double)below / N - p) <= 5 * sqrt(p * (1 - p) / N));
    }
}

/* Neighbours in index, channel, kind and seed have nothing to do with each other. */
static void streams_are_independent(void **state) {
    (void)state;
    const mhi_stream stream = {42, 7, 3};
    const mhi_stream others[] = {{43, 7, 3}, {42, 8, 3}, {42, 7, 4}, {42, 3, 7}};
    for (int s = -1; s < 4; s++) {
        double correlation = 0;
        for (uint64_t i = 0; i < N; i++) {
            const double other =
                s < 0 ? mhi_random_normal(&stream, i + 1) : mhi_random_normal(&others[s], i);
            correlation += mhi_random_normal(&stream, i) * other / N;
        }
        assert_true(fabs(correlation) <= 5 / sqrt(N));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(known_answers), cmocka_unit_test(moments),
                                       cmocka_unit_test(distribution),
                                       cmocka_unit_test(streams_are_independent)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
