/* SPDX-License-Identifier: Apache-2.0 */
/* Lengths that are polynomials: sums within sums give what term by term gives, in any order of the
 * terms, for powers and for Chebyshev's. */
#include "../route.h"
#include "support.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TERMS 40
#define MOST 4

typedef struct values {
    double length, gradient[MOST], hessian[MOST * MOST];
} values;

/* Of `n` coordinates, the last of which may be one that no term has. */
static values evaluate(int32_t n, const uint8_t *exponents, const double *coef, int chebyshev) {
    static const int32_t numbers[MOST] = {0, 1, 2, 3};
    static const double centre[MOST] = {0.1, -0.2, 0.3, 0}, scale[MOST] = {0.7, 1.1, 0.9, 1};
    double place[4 * MOST] = {0}, scratch[3 * MOST * POLYNOMIAL_POWERS + MOST + MOST * MOST];
    const double *factors[MOST];
    static shared_factors shared[MOST];
    const mhe_polynomial p = {n, numbers, centre, scale, TERMS, coef, exponents};
    const path_route whole = {0};
    path_route route = {.length = &p,
                        .n_own = n,
                        .degree = 7,
                        .length_local = (int32_t *)numbers,
                        .exact = chebyshev ? &whole : NULL};
    route_work work = {.polynomial = scratch, .factors = factors, .shared = shared};
    values out = {0};
    for (int32_t k = 0; k < n; k++) {
        place[4 * k] = 0.2 * (k + 1);
        place[4 * k + 1] = 1;
        shared[k].degree = 0;
    }
    out.length = polynomial_length(&route, place, &work, out.gradient, out.hessian);
    assert_true(polynomial_length(&route, place, &work, NULL, NULL) - out.length < 1e-12);
    return out;
}

static void sums_within_sums(void **state) {
    (void)state;
    srand(5);
    for (int trial = 0; trial < 60; trial++) {
        const int32_t n = 1 + trial % 3;
        uint8_t short_of[MOST * TERMS], long_of[MOST * TERMS] = {0};
        double coef[TERMS];
        for (int t = 0; t < TERMS; t++) {
            coef[t] = (double)rand() / RAND_MAX - 0.5;
            for (int32_t k = 0; k < n; k++) { /* runs of equal exponents, and none */
                short_of[n * t + k] = (uint8_t)(k + 1 < n ? rand() % 3 : rand() % 8);
                long_of[MOST * t + k] = short_of[n * t + k];
            }
        }
        const values a = evaluate(n, short_of, coef, trial % 2);
        const values b = evaluate(MOST, long_of, coef, trial % 2);
        assert_true(fabs(a.length - b.length) < 1e-12);
        for (int32_t i = 0; i < n; i++) {
            assert_true(fabs(a.gradient[i] - b.gradient[i]) < 1e-11);
            for (int32_t j = 0; j < n; j++) {
                assert_true(fabs(a.hessian[n * i + j] - b.hessian[MOST * i + j]) < 1e-10);
            }
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(sums_within_sums)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
